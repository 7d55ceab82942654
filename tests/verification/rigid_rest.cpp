// Blocks that rest on rigid planes stay at rest, with the defaults that users have. Where pushes
// acted at surfaces, and their springs were measured at centres, energy came out of nothing: blocks
// began to shake after some seconds, and slid down slopes that hold them.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <string>

#include "tests/verification/case.h"

using namespace lahar;
using namespace lahar::verification;

namespace {

constexpr const char* soil =
    R"("type": "MohrCoulomb", "friction": 35, "dilation": 0, "cohesion": 5e4, "tension_cutoff": 1e4)";
constexpr const char* elastic = R"("type": "LinearElastic")";

struct Rest {
  const char* law = soil;
  const char* analysis = "";
  double degrees = 0, cell = 0.05, height = 3;
};

/// What is left of the motion of a block of 1 x 0.5 m, and its energies [J], after `end_time`.
HistoryRow after(const Rest& rest, double end_time) {
  const double angle = rest.degrees * std::numbers::pi / 180, c = std::cos(angle),
               s = std::sin(angle);
  const auto corner = [&](double along, double above) {
    return fmt::format("[{}, {}]", 0.7 + along * c + above * s,
                       rest.height - along * s + above * c);
  };
  Simulation simulation(model_by_default<2>(fmt::format(
      R"({{
      "mesh": {{"structured": {{"origin": [-0.2, 1.8], "cell_size": {}, "extent": [3, 2.4]}}}},
      "materials": [{{{}, "density": 2000, "youngs_modulus": 1e7, "poisson_ratio": 0.3}}],
      "rigid_bodies": [{{"region": {{"half_space": {{"point": {}, "normal": [{}, {}]}}}},
                        "friction": 0.7}}],
      "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": 0,
        "region": {{"polygon": {{"points": [{}, {}, {}, {}]}}}}}}}}],
      "external_loading_conditions": {{"gravity": {{"gravity": [0, -9.81], "ramping_time": 0.5}}}},
      "analysis": {{"end_time": {}{}}}}})",
      rest.cell, rest.law, corner(0, 0), s, c, corner(0, 0), corner(1, 0), corner(1, 0.5),
      corner(0, 0.5), end_time, rest.analysis)));
  simulation.run();
  return simulation.history();
}

}  // namespace

TEST_CASE("rigid bodies: a block of soil at rest on a slope stays at rest") {
  for (const double degrees : {15.0, 31.0}) {
    CAPTURE(degrees);
    const HistoryRow end = after({.degrees = degrees}, 5);
    MESSAGE(degrees << " degrees: kinetic " << end.kinetic << " J, internal " << end.internal
                    << " J, of " << end.external << " J, friction " << end.friction << " J");
    CHECK(end.kinetic < 1e-4);
    CHECK(end.internal > 0.5 * end.external);
    CHECK(end.friction < 0.2 * end.external);
    CHECK(std::abs(end.balance) < 0.02 * end.external);
  }
}

TEST_CASE(
    "rigid bodies: blocks at rest on a level plane stay at rest, wherever it cuts the cells") {
  for (const char* const analysis :
       {R"(, "shape_functions": "gimp")", R"(, "shape_functions": "cpdi")",
        R"(, "velocity_update": "flip")"})
    for (const char* const law : {elastic, soil})
      for (const double height : {3.0, 3.04}) {
        CAPTURE(analysis);
        CAPTURE(law);
        CAPTURE(height);
        const HistoryRow end =
            after({.law = law, .analysis = analysis, .cell = 0.1, .height = height}, 4);
        MESSAGE(std::string(analysis) << ", plane at " << height << " m: kinetic " << end.kinetic
                                      << " J, internal " << end.internal << " J, of "
                                      << end.external << " J, friction " << end.friction << " J");
        CHECK(end.kinetic < 0.01);
        CHECK(end.internal > 0.5 * end.external);
        CHECK(end.friction < 0.2 * end.external);
      }
}
