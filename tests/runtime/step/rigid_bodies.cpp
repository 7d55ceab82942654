// Rigid bodies: the same bits however the tasks are executed, and after any restart.
#include <doctest/doctest.h>

#include "tests/runtime/step/restart_checks.h"
#include "tests/runtime/step/rigid_models.h"

using namespace lahar;
using namespace lahar::test;

TEST_CASE("rigid bodies in motion: the serial loop's bits, and those after a restart") {
  for (const char* scheme : {"musl", "usf"})
    for (const char* analysis :
         {R"("dt": 1e-3)", R"("time_step": {"adaptive": true, "safety": 0.3}, "end_time": 0.2)",
          R"("dt": 1e-3, "shape_functions": "element", "velocity_update": "apic")",
          R"("dt": 1e-3, "shape_functions": "gimp")", R"("dt": 1e-3, "shape_functions": "cpdi")"}) {
      CAPTURE(scheme);
      CAPTURE(analysis);
      Model<2> model = heap_and_bodies(scheme, analysis);
      model.output.frame_steps = model.output.history_steps = 10;
      check_ways(model);
      check_restart(model, 33, 80, {flow(2), serial()});
    }
}

TEST_CASE("saturated soil on rigid bodies: the serial loop's bits, and those after a restart") {
  for (const char* analysis :
       {R"("dt": 2e-4)",
        R"("time_step": {"adaptive": true, "safety": 0.3}, "pore_pressure_smoothing": true)",
        R"("dt": 2e-4, "shape_functions": "gimp", "velocity_update": "apic")"}) {
    CAPTURE(analysis);
    Model<2> model = bank_and_wall(analysis);
    model.output.frame_steps = model.output.history_steps = 10;
    check_ways(model);
    check_restart(model, 33, 80, {flow(2), serial()});
  }
}

TEST_CASE("a free rigid body that leaves the mesh is told of once, one that is held is not") {
  const auto warnings = [](const std::string& floor, double end_of_wall) {
    std::vector<std::string> said;
    Observer observer;
    observer.warning = [&](const std::string& text) { said.push_back(text); };
    Simulation simulation(model_of_text<2>(R"({
      "mesh": {"structured": {"cell_size": 0.1, "extent": [2, 1]},
        "boundary_conditions": {"walls": [{"nset": "floor", "normal": [0, 1]}]}},
      "sets": {"nodes": {"floor": {"box": {"min": [0, 0], "max": [)" +
                                           std::to_string(end_of_wall) + R"(, 0.01]}}}},
      "materials": [{"type": "LinearElastic", "density": 1000, "youngs_modulus": 1e5,
                     "poisson_ratio": 0.2}],
      "rigid_bodies": [)" + floor + R"({"name": "box", "density": 2000,
        "region": {"box": {"min": [1.2, 0.3], "max": [1.5, 0.5]}}}],
      "particles": [{"generator": {"type": "region", "per_cell": 2, "material": 0,
        "region": {"box": {"min": [0.2, 0], "max": [0.6, 0.3]}}}}],
      "external_loading_conditions": {"gravity": [0, -10]},
      "analysis": {"preset": "lahar", "end_time": 0.6}})"),
                          serial(), observer);
    simulation.run();
    return said;
  };
  const auto alone = warnings("", 1);
  REQUIRE(alone.size() == 1);
  CHECK(alone[0].find("rigid body 'box' has left the mesh: its y is -") != std::string::npos);
  CHECK(warnings(R"({"name": "floor", "region": {"half_space": {"point": [0, 0],
                     "normal": [0, 1]}}, "friction": 0.5}, )",
                 1)
            .empty());
  CHECK(warnings("", 2).empty());  // the wall is that of the whole side
}

TEST_CASE("rigid bodies in motion touch material, and each other") {
  Model<2> model = heap_and_bodies("musl", R"("dt": 1e-3)");
  model.output.history_steps = 1;
  std::array<int, 4> touched{};
  double fastest_spin = 0;
  Observer observer;
  observer.history = [&](const HistoryRow& row) {
    for (std::size_t k = 0; k < touched.size(); ++k) touched[k] += row.bodies[k].force[1] != 0;
    fastest_spin = std::max(fastest_spin, std::abs(row.bodies[3].spin[2]));
    CHECK(row.bodies[1].name == "wall");
  };
  Simulation simulation(std::move(model), serial(), observer);
  simulation.run();
  CHECK(touched[0] > 50);
  CHECK(touched[1] > 10);
  CHECK(touched[2] > 10);
  CHECK(fastest_spin > 0.1);  // the disc turned the box, which began without a spin
  const HistoryRow end = simulation.history();
  // The integral of its function is 0.125 s.
  CHECK(end.bodies[1].place[0] == doctest::Approx(0.6 + 1.5 * 0.05).epsilon(1e-9));
  CHECK(end.bodies[1].rotation[2] == doctest::Approx(0.4 * 0.05).epsilon(1e-9));
}

TEST_CASE("nothing is at rest while a free body falls or another one moves as prescribed") {
  const auto run = [](const std::string& body) {
    Model<2> model = model_of_text<2>(R"({
      "mesh": {"structured": {"cell_size": 0.1, "extent": [2, 2]},
        "boundary_conditions": {"velocity_constraints": [
          {"nset": "floor", "dir": "x", "velocity": 0}, {"nset": "floor", "dir": "y", "velocity": 0}]},
        "particles_stresses": {"type": "k0", "k0": 0.3}},
      "sets": {"nodes": {"floor": {"half_space": {"point": [0, 0], "normal": [0, 1]}}}},
      "materials": [{"name": "m", "type": "LinearElastic", "density": 2000, "youngs_modulus": 1e6,
                     "poisson_ratio": 0.2}],
      "particles": [{"generator": {"type": "region", "material": "m", "per_cell": 2,
        "region": {"box": {"min": [0, 0], "max": [2, 0.4]}}}}],
      "rigid_bodies": [{"name": "ball", "region": {"sphere": {"centre": [1, 0.9], "radius": 0.2}}, )" +
                                      body + R"(}],
      "external_loading_conditions": {"gravity": [0, -10]},
      "analysis": {"dt": 5e-4, "end_time": 0.2, "until": {"imbalance": 0.05},
                   "damping": {"type": "Cundall", "damping_factor": 0.7}}})");
    Simulation simulation(std::move(model), serial());
    simulation.run();
    return simulation.time();
  };
  CHECK(run(R"("friction": 0.3)") < 0.19);  // it is fixed
  CHECK(run(R"("density": 2000)") == doctest::Approx(0.2));
  CHECK(run(R"("velocity": [0.1, 0])") == doctest::Approx(0.2));
}
