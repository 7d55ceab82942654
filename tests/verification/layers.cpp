// Ground of two layers that settles by its weight: exact in one dimension,
//   u(y) = -int_0^y rho g (H - s) / M(s) ds.
// Smooth functions have no kinks where the stiffness jumps: with splines the softer layer acts as
// if it were thinner by up to a cell, which `check` warns of. With GIMP and a border on faces of
// cells it does not.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>
#include <string>
#include <variant>

#include "tests/verification/case.h"

using namespace lahar;
using namespace lahar::verification;

namespace {

constexpr double soft = 1e8, contrast = 100, density = 2000, g = 10, layer = 0.4;  // SI

/// Mean settlement of a soft layer on a stiff one over the exact one; layers have so many cells.
double settlement(const std::string& functions, int cells) {
  const std::string text = fmt::format(
      R"({{
    "mesh": {{"structured": {{"cell_size": {0}, "counts": [2, {1}]}},
              "boundary_conditions": {{"velocity_constraints": [
                {{"nset_id": -1, "dir": "x", "velocity": 0}},
                {{"nset": "floor", "dir": "y", "velocity": 0}}]}}}},
    "sets": {{"nodes": {{"floor": {{"half_space": {{"point": [0, 0], "normal": [0, 1]}}}}}}}},
    "materials": [
      {{"name": "stiff", "type": "LinearElastic", "density": {2}, "youngs_modulus": {3},
        "poisson_ratio": 0}},
      {{"name": "soft", "type": "LinearElastic", "density": {2}, "youngs_modulus": {4},
        "poisson_ratio": 0}}],
    "particles": [
      {{"generator": {{"type": "region", "per_cell": 2, "material": "stiff",
                       "region": {{"box": {{"min": [0, 0], "max": [1, {5}]}}}}}}}},
      {{"generator": {{"type": "region", "per_cell": 2, "material": "soft",
                       "region": {{"box": {{"min": [0, {5}], "max": [1, {6}]}}}}}}}}],
    "external_loading_conditions": {{"gravity": [0, -{7}]}},
    "analysis": {{"mpm_scheme": "newmark", "scheme_settings": {{"quasi_static": true}},
                  "shape_functions": "{8}", "dt": 1, "nsteps": 1}}}})",
      layer / cells, 2 * cells + 3, density, contrast * soft, soft, layer, 2 * layer, g, functions);
  Simulation simulation(std::get<Model<2>>(read_scenario_text(text, LAHAR_SOURCE_DIR).model));
  simulation.run();
  const State state(simulation.frame());
  const auto exact = [](double y) {
    const auto weight = [](double s) { return density * g * (2 * layer * s - s * s / 2); };
    return y < layer ? weight(y) / (contrast * soft)
                     : weight(layer) / (contrast * soft) + (weight(y) - weight(layer)) / soft;
  };
  double found = 0, expected = 0;
  for (Index p = 0; p < state.size(); ++p) {
    const double u = state.get("displacement", p, 1);
    found -= u;
    expected += exact(state.x(p, 1) - u);
  }
  return found / expected;
}

}  // namespace

TEST_CASE("soft ground on stiff ground settles as it should with GIMP, too little with splines") {
  const double coarse = settlement("gimp", 4), fine = settlement("gimp", 8);
  CAPTURE(coarse);
  CAPTURE(fine);
  CHECK(std::abs(coarse - 1) < 0.03);
  CHECK(std::abs(fine - 1) < 0.015);
  const double lost = 1 - settlement("quadratic_spline", 4),
               lost_fine = 1 - settlement("quadratic_spline", 8);
  CAPTURE(lost);
  CAPTURE(lost_fine);
  CHECK(lost > 0.2);  // what the warning is for
  CHECK(std::abs(lost_fine / lost - 0.5) < 0.1);
}
