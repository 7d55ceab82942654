// A dam breaks over shallow water: a bore runs ahead, and behind it the water is as deep and as
// fast as shallow-water theory says (Stoker 1957, Water Waves). With h1 and h0 [m] in front of the
// dam and behind it, hm is the root of
//   hm (S - um) = h0 S,  um = 2 (sqrt(g h1) - sqrt(g hm)),  S = sqrt(g hm (hm + h0) / (2 h0)).
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>
#include <string>
#include <variant>

#include "tests/verification/case.h"

using namespace lahar;
using namespace lahar::verification;

namespace {

constexpr double g = 9.81, h1 = 0.4, h0 = 0.08;

/// Between the bore and what falls behind the dam.
struct Plateau {
  double depth, velocity;
};

Plateau in_theory() {
  const auto speed = [](double hm) { return 2 * (std::sqrt(g * h1) - std::sqrt(g * hm)); };
  double low = h0, high = h1;
  for (int k = 0; k < 60; ++k) {
    const double hm = (low + high) / 2, bore = std::sqrt(g * hm * (hm + h0) / (2 * h0));
    (hm * (bore - speed(hm)) < h0 * bore ? low : high) = hm;
  }
  return {low, speed(low)};
}

/// With native defaults; the dam is at x = 0.
Plateau flow(double cell, double safety) {
  const std::string text = fmt::format(
      R"({{
    "mesh": {{"structured": {{"origin": [-4, 0], "cell_size": {}, "extent": [9, 0.6]}},
              "boundary_conditions": {{"walls": [{{"nset": "floor", "normal": [0, 1]}},
                                                 {{"nset": "start", "normal": [1, 0]}},
                                                 {{"nset": "end", "normal": [-1, 0]}}]}}}},
    "sets": {{"nodes": {{"floor": {{"half_space": {{"point": [0, 0], "normal": [0, 1]}}}},
                         "start": {{"half_space": {{"point": [-4, 0], "normal": [1, 0]}}}},
                         "end": {{"half_space": {{"point": [5, 0], "normal": [-1, 0]}}}}}}}},
    "materials": [{{"name": "water", "type": "Newtonian", "density": 1000, "bulk_modulus": 4e5,
                    "dynamic_viscosity": 1e-3}}],
    "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": "water",
      "region": {{"union": [{{"box": {{"min": [-4, 0], "max": [0, {}]}}}},
                            {{"box": {{"min": [0, 0], "max": [5, {}]}}}}]}}}}}}],
    "external_loading_conditions": {{"gravity": [0, -9.81]}},
    "analysis": {{"time_step": {{"safety": {}}}, "end_time": 1.2}}}})",
      cell, h1, h0, safety);
  Simulation simulation(std::get<Model<2>>(read_scenario_text(text, LAHAR_SOURCE_DIR).model));
  simulation.run();
  const State state(simulation.frame());
  double mass = 0, momentum = 0;
  for (Index p = 0; p < state.size(); ++p)
    if (state.x(p, 0) > 0.2 && state.x(p, 0) < 1.2) {
      mass += state.get("mass", p);
      momentum += state.get("mass", p) * state.get("velocity", p);
    }
  return {mass / 1000, momentum / mass};
}

}  // namespace

TEST_CASE("behind the bore of a dam break over water, depth and velocity are those of Stoker") {
  const Plateau theory = in_theory();
  CHECK(std::abs(theory.depth - 0.20315) < 1e-5);
  const Plateau coarse = flow(0.04, 0.4), small_steps = flow(0.04, 0.2), fine = flow(0.02, 0.4);
  const auto compare = [](const Plateau& found, const Plateau& with, double depth,
                          double velocity) {
    MESSAGE("depth " << found.depth / with.depth << ", velocity "
                     << found.velocity / with.velocity);
    CHECK(std::abs(found.depth / with.depth - 1) < depth);
    CHECK(std::abs(found.velocity / with.velocity - 1) < velocity);
  };
  for (const Plateau& found : {coarse, small_steps, fine}) compare(found, theory, 0.04, 0.03);
  compare(small_steps, coarse, 0.01, 0.01);
  compare(fine, coarse, 0.02, 0.02);
}
