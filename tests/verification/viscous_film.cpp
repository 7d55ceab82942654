// A viscous film flows down a plane, with defaults: u(y) = g sin(t) (H y - y^2 / 2) / nu.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>

#include "tests/verification/case.h"

using namespace lahar;
using namespace lahar::verification;

namespace {

/// Mean velocity of the middle of the film over that of the formula, far from both ends.
double share_of_flow(double cell, const char* keys = "") {
  constexpr double g = 9.81, tilt = 0.175, depth = 0.1, viscosity = 0.02, rho = 1000;
  Simulation simulation(
      model_of_text<2>(fmt::format(
          R"({{"mesh": {{"structured": {{"cell_size": {}, "extent": [2.6, 0.16]}},
            "boundary_conditions": {{"walls": [{{"nset": "floor", "normal": [0, 1], "friction": "rough"}}]}}}},
          "sets": {{"nodes": {{"floor": {{"half_space": {{"point": [0, 0], "normal": [0, 1]}}}}}}}},
          "materials": [{{"name": "m", "type": "Newtonian", "density": {}, "bulk_modulus": 2e5,
                          "dynamic_viscosity": {}}}],
          "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": "m",
             "region": {{"box": {{"min": [0.2, 0], "max": [2, {}]}}}}}}}}],
          "external_loading_conditions": {{"gravity": [{}, {}]}},
          "analysis": {{"end_time": 0.8{}}}}})",
          cell, rho, rho * viscosity, depth, g * std::sin(tilt), -g * std::cos(tilt), keys)),
      {.threads = 2});
  simulation.run();
  const State state(simulation.frame());
  const auto in_the_middle = [&](Index p) { return state.x(p, 0) > 1 && state.x(p, 0) < 1.4; };
  double volume = 0, found = 0, exact = 0;  // it is a little thinner than at the start
  for (Index p = 0; p < state.size(); ++p)
    if (in_the_middle(p)) volume += state.get("volume", p);
  const double H = volume / 0.4;
  for (Index p = 0; p < state.size(); ++p) {
    if (!in_the_middle(p)) continue;
    const double y = state.x(p, 1);
    found += state.get("velocity", p, 0);
    exact += g * std::sin(tilt) * (H * y - 0.5 * y * y) / viscosity;
  }
  return found / exact;
}

}  // namespace

TEST_CASE("a viscous film flows down a plane as its own viscosity says, by default") {
  const double coarse = share_of_flow(0.02), fine = share_of_flow(0.01);
  const double half = share_of_flow(0.02, R"(, "time_step": {"safety": 0.25})");
  MESSAGE("mean velocity over the formula: " << coarse << ", with half the step " << half
                                             << ", half the cell " << fine);
  CHECK(std::abs(coarse - 1) < 0.06);
  CHECK(std::abs(half - coarse) < 0.01);
  CHECK(std::abs(fine - 1) < 0.04);
}
