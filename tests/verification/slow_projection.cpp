// Projections: the flow in a cavity that a lid drives, Re = 100 (U. Ghia, K. N. Ghia and C. T.
// Shin, J. Comput. Phys. 48, 1982, 387-411).
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "tests/verification/case.h"

using namespace lahar;
using namespace lahar::verification;

namespace {

Model<2> cavity(int cells, double end) {
  const double h = 1.0 / cells;
  return model_of_text<2>(fmt::format(
      R"({{
    "mesh": {{"structured": {{"cell_size": {0}, "counts": [{1}, {1}]}},
      "boundary_conditions": {{"velocity_constraints": [
        {{"nset": "walls", "dir": "x", "velocity": 0}},
        {{"nset": "walls", "dir": "y", "velocity": 0}},
        {{"nset": "lid", "dir": "x", "velocity": 1}},
        {{"nset": "lid", "dir": "y", "velocity": 0}}]}}}},
    "sets": {{"nodes": {{
      "walls": {{"union": [{{"half_space": {{"point": [0, 0], "normal": [1, 0]}}}},
                           {{"half_space": {{"point": [1, 0], "normal": [-1, 0]}}}},
                           {{"half_space": {{"point": [0, 0], "normal": [0, 1]}}}}]}},
      "lid": {{"half_space": {{"point": [0, 1], "normal": [0, -1]}}}}}}}},
    "materials": [{{"type": "Newtonian", "density": 1, "bulk_modulus": 1e9,
                    "dynamic_viscosity": 0.01}}],
    "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": 0,
                    "region": {{"box": {{"min": [0, 0], "max": [1, 1]}}}}}}}}],
    "analysis": {{"mpm_scheme": "projection", "dt": {2}, "end_time": {3},
      "velocity_update": "flip", "velocity_update_settings": {{"relaxation_time": 0.3}},
      "free_surface_detection": {{"type": "none"}}}}}})",
      h, cells, 0.2 * h, end));
}

/// Means over time, of particles weighted by linear functions of a cell.
struct Profile {
  double u_low = 0;    ///< at (0.5, 0.4531)
  double v_left = 0;   ///< at (0.2344, 0.5)
  double v_right = 0;  ///< at (0.8047, 0.5)
  int count = 0;
};

double velocity_at(const State& state, double x, double y, int d, double h) {
  double sum = 0, all = 0;
  for (Index p = 0; p < state.size(); ++p) {
    const double w = std::max(0.0, 1 - std::abs(state.x(p, 0) - x) / h) *
                     std::max(0.0, 1 - std::abs(state.x(p, 1) - y) / h);
    sum += w * state.get("velocity", p, d);
    all += w;
  }
  return sum / all;
}

Profile profile(int cells) {
  constexpr double settled = 10, end = 16, every = 0.25;
  Simulation simulation(cavity(cells, end));
  const auto steps = static_cast<Index>(std::lround(every * cells / 0.2));
  const double h = 1.0 / cells;
  Profile mean;
  while (!simulation.finished()) {
    simulation.advance(steps);
    if (simulation.time() < settled) continue;
    const State state(simulation.frame());
    mean.u_low += velocity_at(state, 0.5, 0.4531, 0, h);
    mean.v_left += velocity_at(state, 0.2344, 0.5, 1, h);
    mean.v_right += velocity_at(state, 0.8047, 0.5, 1, h);
    ++mean.count;
  }
  for (double* sum : {&mean.u_low, &mean.v_left, &mean.v_right}) *sum /= mean.count;
  return mean;
}

}  // namespace

TEST_CASE("projection: the vortex in a driven cavity is that of Ghia, Ghia and Shin") {
  for (const int cells : {32, 64}) {
    const Profile found = profile(cells);
    MESSAGE(fmt::format("{} cells: u {:.4f}, v {:.4f} and {:.4f}", cells, found.u_low, found.v_left,
                        found.v_right));
    CHECK(std::abs(found.u_low / -0.2109 - 1) < 0.03);
    CHECK(std::abs(found.v_left / 0.1753 - 1) < 0.05);
    // Beside the corner where lid and wall meet particles crowd: an error of the first order.
    CHECK(std::abs(found.v_right / -0.2453 - 1) < (cells == 32 ? 0.2 : 0.1));
  }
}
