// Stages that go on from a state with other particles.
#include "runtime/patches/stage_changes.h"

#include <doctest/doctest.h>

#include "runtime/step/restart.h"
#include "tests/runtime/step/restart_checks.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// A block that flies to the left through small patches. Then all that is left of it vanishes.
Model<2> flying_block(std::size_t stage) {
  const std::string text = R"({
    "mesh": {"structured": {"cell_size": 0.1, "counts": [12, 9]}},
    "materials": [{"type": "LinearElastic", "density": 1000, "youngs_modulus": 5e4,
                   "poisson_ratio": 0.25}],
    "particles": [{"generator": {"type": "region", "per_cell": 2, "material": 0,
      "region": {"box": {"min": [0.3, 0.3], "max": [1, 0.7]}}, "velocity": [-3, -0.5]}}],
    "analysis": {"dt": 0.002, "nsteps": 25, "locate_particles": false, "patch_particles": 16,
                 "split_steps": 0},
    "stages": [{"name": "first"}, {"name": "second",
      "remove": [{"region": {"box": {"max": [0.6, 2]}}}]}]})";
  ScenarioOptions options = plain_defaults(text);
  options.stage = stage;
  return std::get<Model<2>>(read_scenario_text(text, "", options).model);
}

}  // namespace

TEST_CASE(
    "of the particles that a stage begins with, the new ones keep the values that are theirs") {
  ParticleTable<2> table;
  constexpr std::size_t rows = 5;
  for (std::size_t i = 0; i < rows; ++i) {
    table.x.emplace_back(i, i);
    table.reach.push_back(static_cast<double>(i));  // to the surface of a body
    table.opening.push_back(static_cast<double>(i));
    table.mass.push_back(static_cast<double>(i));
  }
  keep_rows_from(table, 3);
  CHECK(table.id == std::vector<Index>{3, 4});
  CHECK(table.x == std::vector<Vec<2>>{{3, 3}, {4, 4}});
  for (const auto& column : {table.reach, table.opening, table.mass})
    CHECK(column == std::vector<double>{3, 4});
  CHECK(table.velocity.empty());
}

TEST_CASE("a patch that a stage empties forgets how its particles lay") {
  Simulation first(flying_block(0), serial());
  first.run();
  const StoredState begin(first.state());
  const Model<2> model = flying_block(1);
  Simulation whole(model, serial(), {}, state_at_start(begin.view(), false));
  REQUIRE(whole.history().particles > 0);
  REQUIRE(whole.history().particles < first.history().particles);
  const StoredState start(whole.state());
  Simulation resumed(model, serial(), {}, start.view());
  for (Simulation* simulation : {&whole, &resumed}) simulation->run();
  CHECK(difference(StoredState(whole.state()), StoredState(resumed.state())) == "");
}
