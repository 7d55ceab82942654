// A rough strip footing on clay without weight: Prandtl (1920), q = (2 + pi) s_u.
#include <doctest/doctest.h>

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "tests/verification/case.h"

using namespace lahar;
using namespace lahar::verification;

namespace {

constexpr double su = 1e4, half_width = 0.5, cell = 0.05;

/// Load on the footing over its width and s_u, when it has gone down far enough.
double bearing_capacity(const std::string& functions) {
  Model<2> model = model_of_text<2>(fmt::format(
      R"({{
    "mesh": {{"structured": {{"cell_size": {cell}, "extent": [5, 3.2]}},
             "boundary_conditions": {{"velocity_constraints": [
               {{"nset": "sides", "dir": "x", "velocity": 0}},
               {{"nset": "base", "dir": "y", "velocity": 0}},
               {{"nset": "footing", "dir": "y", "velocity": -0.02}},
               {{"nset": "footing", "dir": "x", "velocity": 0}}]}}}},
    "sets": {{"nodes": {{
      "sides": {{"union": [{{"half_space": {{"point": [0, 0], "normal": [1, 0]}}}},
                          {{"half_space": {{"point": [5, 0], "normal": [-1, 0]}}}}]}},
      "base": {{"half_space": {{"point": [0, 0], "normal": [0, 1]}}}},
      "footing": {{"box": {{"min": [-0.01, 2.99], "max": [{edge}, 4]}}}}}}}},
    "materials": [{{"type": "MohrCoulomb2D", "density": 2000, "youngs_modulus": 1e7,
                   "poisson_ratio": 0.45, "friction": 0, "dilation": 0, "cohesion": {su},
                   "tension_cutoff": 1e9, "softening": false}}],
    "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": 0,
                                 "region": {{"box": {{"min": [0, 0], "max": [5, 3]}}}}}}}}],
    "analysis": {{"mpm_scheme": "usl", "shape_functions": "{functions}", "dt": 1e-4, "nsteps": 20000,
                 "damping": {{"type": "Cundall", "damping_factor": 0.05}}}}}})",
      fmt::arg("cell", cell), fmt::arg("functions", functions), fmt::arg("su", su),
      fmt::arg("edge", half_width + 0.01)));
  Simulation<2> simulation(std::move(model));
  simulation.run();
  const State end(simulation.frame());
  // Without weight the layer above any plane carries the load down to it: summed over the whole
  // width, here the second row of particles below the footing.
  double force = 0;
  for (Index p = 0; p < end.size(); ++p) {
    const double Y = end.x(p, 1) - end.get("displacement", p, 1);
    if (Y < 3 - cell && Y > 3 - 1.5 * cell) force -= end.get("stress", p, 1) * cell / 2;
  }
  // At collapse the footing's velocity meets a band around its edge that has the width of a cell.
  return force / half_width / su;
}

}  // namespace

TEST_CASE("a strip footing fails at Prandtl's load") {
  const double prandtl = 2 + std::numbers::pi;
  const double smooth = bearing_capacity("quadratic_spline"), linear = bearing_capacity("element");
  MESSAGE("q / s_u: quadratic B-splines " << smooth << ", linear " << linear << ", Prandtl "
                                          << prandtl);
  CHECK(smooth == doctest::Approx(prandtl).epsilon(0.08));
}
