// Forces of still water on the wall and the floor of a tank in three dimensions.
#include <doctest/doctest.h>

#include <string>
#include <vector>

#include "tests/runtime/step/models.h"
#include "tests/within.h"

using namespace lahar;
using namespace lahar::test;

namespace {

constexpr double length = 0.5, width = 0.3, depth = 0.3;  ///< [m] of the water

/// A tank that is full up to two cells, with smooth walls. `mesh`: more keys of the mesh;
/// `damping`: of analysis.
Model<3> tank(const std::string& mesh, const std::string& damping) {
  return model_of_text<3>(R"({
    "mesh": {"structured": {"cell_size": 0.05, "extent": [0.5, 0.3, 0.4]},)" +
                          mesh + R"(
      "boundary_conditions": {"velocity_constraints": [
        {"nset": "floor", "dir": "z", "velocity": 0},
        {"nset": "left", "dir": "x", "velocity": 0}, {"nset": "right", "dir": "x", "velocity": 0},
        {"nset": "front", "dir": "y", "velocity": 0},
        {"nset": "back", "dir": "y", "velocity": 0}]}},
    "sets": {"nodes": {
      "floor": {"half_space": {"point": [0, 0, 0], "normal": [0, 0, 1]}},
      "left": {"half_space": {"point": [0, 0, 0], "normal": [1, 0, 0]}},
      "right": {"half_space": {"point": [0.5, 0, 0], "normal": [-1, 0, 0]}},
      "front": {"half_space": {"point": [0, 0, 0], "normal": [0, 1, 0]}},
      "back": {"half_space": {"point": [0, 0.3, 0], "normal": [0, -1, 0]}}}},
    "materials": [{"name": "water", "type": "Newtonian", "density": 1000, "bulk_modulus": 2e6,
                   "dynamic_viscosity": 1e-3}],
    "particles": [{"generator": {"type": "region", "per_cell": 2, "material": 0,
      "region": {"box": {"min": [0, 0, 0], "max": [0.5, 0.3, 0.3]}}}}],
    "external_loading_conditions": {"gravity": [0, 0, -9.81]},
    "analysis": {"end_time": 0.6, "time_step": {"safety": 0.5})" +
                          damping + R"(},
    "post_processing": {"gauge_dt": 0.2, "gauges": [
      {"name": "right", "type": "force", "nset": "right", "at": [0.5, 0, 0]},
      {"name": "back", "type": "force", "nset": "back", "at": [0, 0.3, 0]},
      {"name": "floor", "type": "force", "nset": "floor"}]}})");
}

}  // namespace

TEST_CASE("in three dimensions still water presses on walls and floor as hydrostatics says") {
  struct Case {
    std::string mesh, damping;
    double share;  ///< [-] of forces that may be missing
  };
  const std::string k0 = R"("particles_stresses": {"type": "k0", "k0": 1},)",
                    damped = R"(, "damping": {"type": "Cundall", "damping_factor": 0.2})";
  // Water that comes to rest under its weight, and water that begins with its pressure.
  for (const Case& one : {Case{"", damped, 0.005}, Case{k0, "", 1e-9}}) {
    CAPTURE(one.mesh);
    std::vector<std::vector<double>> last;
    Observer observer;
    observer.gauges = [&](const GaugeRows& rows) { last = rows.values; };
    Simulation simulation(tank(one.mesh, one.damping), flow(2), observer);
    simulation.gauges();
    simulation.run();
    REQUIRE(last.size() == 3);
    const double g = 9.81, density = 1000;
    const double of_side = 0.5 * density * g * depth * depth, weight = density * g * depth;
    const auto &right = last[0], &back = last[1], &floor = last[2];
    CHECK(right[0] == within(one.share, of_side * width));
    CHECK(back[1] == within(one.share, of_side * length));
    CHECK(floor[2] == within(one.share, -weight * length * width));
    // The resultant acts at a third of the depth and in the middle of the width. Pressures are
    // means over cells, which makes moments of the depth larger by 1 / (2 n^2) with n cells of
    // water.
    CHECK(right[4] == within(0.015, of_side * width * depth / 3));
    CHECK(back[3] == within(0.015, -of_side * length * depth / 3));
    CHECK(right[5] == within(one.share, -of_side * width * width / 2));
    CHECK(floor[3] == within(one.share, -weight * length * width * width / 2));
    CHECK(floor[4] == within(one.share, weight * length * width * length / 2));
  }
}
