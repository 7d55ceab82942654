// A cantilever under a load at its tip that bends it far, against the elastica (Bisshopp and
// Drucker 1945, Quart. Appl. Math. 3, 272-275).
#include <doctest/doctest.h>

#include <fmt/format.h>

#include <cmath>

#include "tests/verification/case.h"

using namespace lahar;
using namespace lahar::verification;

namespace {

constexpr double E = 1e6, rho = 1000, length = 10, depth = 0.5, cell = 0.125;

/// Drop of the tip and how much nearer to the wall it comes, over the length.
struct Tip {
  double drop, shortening;
};

/// The beam at rest under P = alpha E I / length^2, a dead load on the last column of cells.
Tip bend(const std::string& functions, double alpha) {
  const double inertia = depth * depth * depth / 12, P = alpha * E * inertia / (length * length);
  // The load of a particle is traction * volume / size, size the edge of its square.
  const double per_particle = cell / 2, particles = 2 * depth / per_particle;
  const double traction = -P / (particles * per_particle);
  Model<2> model = model_of_text<2>(fmt::format(
      R"({{
    "mesh": {{"structured": {{"origin": [0, -8], "cell_size": {cell}, "extent": [10.5, 9]}},
             "boundary_conditions": {{"velocity_constraints": [
               {{"nset": "wall", "dir": "x", "velocity": 0}},
               {{"nset": "wall", "dir": "y", "velocity": 0}}]}}}},
    "sets": {{"nodes": {{"wall": {{"half_space": {{"point": [0, 0], "normal": [1, 0]}}}}}},
             "particles": {{"tip": {{"box": {{"min": [{last}, -1], "max": [11, 2]}}}}}}}},
    "materials": [{{"type": "NeoHookean", "density": {rho}, "youngs_modulus": {E},
                   "poisson_ratio": 0}}],
    "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": 0,
                                 "region": {{"box": {{"min": [0, 0], "max": [10, {depth}]}}}}}}}}],
    "external_loading_conditions": {{"particle_surface_traction": [
      {{"pset": "tip", "dir": "y", "traction": {traction}, "math_function_id": 0}}]}},
    "math_functions": [{{"id": 0, "type": "Linear", "xvalues": [0, 40], "fxvalues": [0, 1]}}],
    "analysis": {{"mpm_scheme": "usl", "shape_functions": "{functions}", "dt": 7e-4, "nsteps": 1000000, "end_time": 100,
                 "damping": {{"type": "Cundall", "damping_factor": 0.02}}}}}})",
      fmt::arg("cell", cell), fmt::arg("functions", functions), fmt::arg("last", length - cell),
      fmt::arg("rho", rho), fmt::arg("E", E), fmt::arg("depth", depth),
      fmt::arg("traction", traction)));
  Simulation<2> simulation(std::move(model));
  simulation.run();
  const State end(simulation.frame());
  // The end of the axis: the mean over the last column of cells, carried on by half a cell.
  const auto column = [&](int n) {
    return [&end, n](Index p) {
      const double X = end.x(p, 0) - end.get("displacement", p, 0);
      return X > length - n * cell && X < length - (n - 1) * cell;
    };
  };
  const auto displacement = [&](int d) {
    return [&end, d](Index p) { return end.get("displacement", p, d); };
  };
  const auto at_tip = [&](int d) {
    return 1.5 * mean(end, column(1), displacement(d)) - 0.5 * mean(end, column(2), displacement(d));
  };
  const HistoryRow row = simulation.history();
  MESSAGE("kinetic / strain energy " << row.kinetic / row.internal);
  CHECK(row.kinetic < 1e-4 * row.internal);
  return {-at_tip(1) / length, -at_tip(0) / length};
}

}  // namespace

TEST_CASE("a cantilever bends as the elastica says") {
  // alpha = P L^2 / (E I) and the solution by shooting; shear adds 0.1 %.
  constexpr double alpha = 2, drop = 0.49346, shortening = 0.16064;
  const Tip tip = bend("quadratic_spline", alpha);
  MESSAGE("quadratic B-splines: drop " << tip.drop << ", shortening " << tip.shortening);
  CHECK(tip.drop == doctest::Approx(drop).epsilon(0.02));
  CHECK(tip.shortening == doctest::Approx(shortening).epsilon(0.02));
}
