// Injection in three dimensions, and of bodies in contact.
#include <doctest/doctest.h>

#include "tests/runtime/step/restart_checks.h"
#include "tests/runtime/step/soil_models.h"

using namespace lahar;
using namespace lahar::test;

TEST_CASE("a shaft is filled from above: points, volumes and the fall of the first particles") {
  const Model<3> model = filled_shaft();
  Simulation simulation(model, serial());
  simulation.advance(10);
  CHECK(simulation.frame().size() == 0);
  simulation.advance(7);  // seven steps with particles: 0.035 m, of 0.0394 m to where they are out
  const Frame falling = simulation.frame();
  REQUIRE(falling.size() == 8);
  const FrameColumn* volume = falling.find("volume");
  REQUIRE(volume);
  const double gauss = 0.025 / std::sqrt(3.0), dt = 1e-3;
  const double share = 0.5 * (1 + 1 / std::sqrt(3.0));  // of the cell: what has flowed in
  for (std::size_t k = 0; k < 8; ++k) {
    CHECK(volume->values[k] == doctest::Approx(share * 0.05 * 0.05 * 0.05 / 8).epsilon(1e-12));
    CHECK(std::abs(std::abs(falling.coordinates[3 * k] - 0.025) - gauss) < 1e-15);
    CHECK(std::abs(std::abs(falling.coordinates[3 * k + 1] - 0.025) - gauss) < 1e-15);
    // Speeds after n steps are 5 + n g dt, and places the sum of those.
    const double start = k < 4 ? 0.475 - gauss : 0.475 + gauss;
    CHECK(falling.coordinates[3 * k + 2] ==
          doctest::Approx(start - 7 * 5 * dt - 28 * 9.81 * dt * dt).epsilon(1e-13));
  }
  simulation.advance(83);  // the cell was empty once more before 0.02 s
  const Frame settled = simulation.frame();
  CHECK(settled.size() == 16);
  for (std::size_t k = 0; k < 16; ++k) CHECK(settled.coordinates[3 * k + 2] > 0);
}

TEST_CASE(
    "a shaft is filled with the same bits however its tasks are executed, over restarts too") {
  const Model<3> model = filled_shaft();
  const Outcome reference = run(model, serial());
  REQUIRE(reference.error == "");
  for (const ExecutionOptions& way : other_ways()) CHECK(same_bits(run(model, way), reference));
  check_restart(model, 14, 60);
  check_restart(model, 5, 40, {flow(2)});
}

TEST_CASE("injected jets of two bodies meet: contact acts, with the same bits for all ways") {
  const Model<2> model = jets_in_contact();
  const Outcome reference = run(model, serial());
  REQUIRE(reference.error == "");
  // Without contact they stick.
  Model<2> one = model;
  for (Material& material : one.materials) material.body = 0;
  one.analysis.contact = {};
  const Outcome sticking = run(one, serial());
  REQUIRE(sticking.error == "");
  CHECK(same_bits(reference.rows.at(10), sticking.rows.at(10)));  // at 0.5 s they are apart
  CHECK_FALSE(same_bits(reference.rows.back(), sticking.rows.back()));
  for (const ExecutionOptions& way : {flow(2), flow(8), random_order(2)})
    CHECK(same_bits(run(model, way), reference));
  check_restart(model, 130, 170, {flow(2), serial()});
}
