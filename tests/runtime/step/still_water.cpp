// Water at rest stays at rest.
#include <doctest/doctest.h>

#include <cmath>
#include <string>

#include "tests/runtime/step/models.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// Water 0.2 m deep and so long, whose weight grows for 0.5 s, with more keys of the scenario and
/// of analysis.
Model<2> still_water(double length, const std::string& keys, const std::string& constraints,
                     const std::string& analysis) {
  return model_of_text<2>(R"({
    "mesh": {"structured": {"cell_size": 0.04, "extent": [0.68, 0.4]},
      "boundary_conditions": {"velocity_constraints": [
        {"nset": "floor", "dir": "y", "velocity": 0},
        {"nset": "left", "dir": "x", "velocity": 0})" +
                          constraints + R"(]}},
    "sets": {"nodes": {
      "floor": {"half_space": {"point": [0, 0], "normal": [0, 1]}},
      "left": {"half_space": {"point": [0, 0], "normal": [1, 0]}},
      "right": {"half_space": {"point": [0.48, 0], "normal": [-1, 0]}}}},
    "materials": [{"name": "water", "type": "Newtonian", "density": 1000, "bulk_modulus": 1e6,
                   "dynamic_viscosity": 1e-3}],
    "particles": [{"generator": {"type": "region", "per_cell": 2, "material": 0,
      "region": {"box": {"min": [0, 0], "max": [)" +
                          std::to_string(length) +
                          R"(, 0.2]}}}}],
    "external_loading_conditions": {"gravity": {"gravity": [0, -9.81], "ramping_time": 0.5}},
    )" + keys + R"("analysis": {"end_time": 3, "mpm_scheme": "musl", "damping": {"type": "Cundall",
      "damping_factor": 0.1}, )" +
                          analysis + R"(}})");
}

}  // namespace

TEST_CASE("water rests beside a rigid body") {
  // By the elastic energy of the water: p^2 / 2 K.
  const double elastic = 0.48 * std::pow(1000 * 9.81, 2) * std::pow(0.2, 3) / 3 / 2e6;
  for (const std::string functions : {"quadratic_spline", "element", "gimp"})
    for (const double edge : {0.48, 0.46}) {  // a line of nodes, and within a cell
      CAPTURE(functions);
      CAPTURE(edge);
      // Pressure at the centre of a cell that is half full is not where its weight is.
      if (functions == "element" && edge != 0.48) continue;
      const std::string wall = R"("rigid_bodies": [{"name": "wall", "region": {"half_space": {
        "point": [)" + std::to_string(edge) +
                               R"(, 0], "normal": [-1, 0]}}}], )";
      Model<2> model = still_water(
          edge, wall, "",
          std::string(R"("shape_functions": ")") + functions +
              R"(", "velocity_update_settings": {"relaxation": 0.01, "viscosity": 0.005})");
      Simulation simulation(std::move(model), serial());
      simulation.run();
      const HistoryRow end = simulation.history();
      CHECK(end.kinetic < 0.01 * elastic);
      CHECK(std::abs(end.balance) < 0.3 * elastic);
      CHECK(end.external < 4 * elastic);
    }
}

TEST_CASE("water with B-bar rests, with the functions of elements, too") {
  for (const std::string functions : {"element", "gimp"}) {
    CAPTURE(functions);
    Simulation simulation(
        still_water(0.48, "", R"(, {"nset": "right", "dir": "x", "velocity": 0})",
                    std::string(R"("b_bar": true, "shape_functions": ")") + functions + '"'),
        serial());
    simulation.run();
    const HistoryRow end = simulation.history();
    CHECK(end.kinetic < 1e-6 * end.internal);
    CHECK(std::abs(end.balance) < 0.01 * end.internal);
  }
}
