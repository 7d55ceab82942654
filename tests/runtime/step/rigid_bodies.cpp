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
