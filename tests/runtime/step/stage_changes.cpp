// Stages that go on from a state with other particles.
#include "runtime/patches/stage_changes.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include "runtime/step/restart.h"
#include "tests/runtime/step/restart_checks.h"
#include "tests/within.h"

using namespace lahar;
using namespace lahar::test;

namespace {

Model<2> stage_of(const std::string& text, std::size_t stage) {
  ScenarioOptions options = plain_defaults(text);
  options.stage = stage;
  return std::get<Model<2>>(read_scenario_text(text, "", options).model);
}

const std::string load = R"({"particle_surface_traction": [
  {"pset": "top", "dir": "y", "traction": -1e5}]})";

/// A column that gets no wider, of a `height` and with `more` sections.
std::string column(const std::string& grid, const std::string& height, const std::string& more) {
  return R"({
    "mesh": {"structured": )" +
         grid + R"(, "boundary_conditions": {"velocity_constraints": [
        {"nset": -1, "dir": "x", "velocity": 0}, {"nset": "base", "dir": "y", "velocity": 0}]}},
    "sets": {"nodes": {"base": {"half_space": {"point": [0, 0], "normal": [0, 1]}}},
             "particles": {"top": {"half_space": {"point": [0, 0.95], "normal": [0, -1]}}}},
    "materials": [{"name": "m", "type": "LinearElastic", "density": 1000, "youngs_modulus": 1e9,
                   "poisson_ratio": 0}],
    "particles": [{"generator": {"type": "region", "material": "m", "per_cell": 2,
      "cut_cells": "exact", "region": {"box": {"min": [0, 0], "max": [0.1, )" +
         height + R"(]}}}}],
    "analysis": {"preset": "lahar", "mpm_scheme": "newmark", "shape_functions": "element",
      "scheme_settings": {"quasi_static": true}, "dt": 0.1, "nsteps": 1}, )" +
         more + "}";
}

/// A column of cells that are half as wide as high and cut at the top. Its load comes in a stage.
Model<2> loaded_late(std::size_t stage) {
  return stage_of(column(R"({"cell_size": [0.05, 0.1], "counts": [2, 12]})", "0.968",
                         R"("stages": [{"name": "empty"},
      {"name": "loaded", "external_loading_conditions": )" +
                             load + "}]"),
                  stage);
}

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
  return stage_of(text, stage);
}

/// Sand at rest, which the second stage gives another strength.
Model<2> weakened(std::size_t stage) {
  const std::string text = R"({
    "mesh": {"structured": {"cell_size": 0.1, "counts": [4, 4]}},
    "materials": [{"name": "sand", "type": "MohrCoulomb", "density": 1000, "youngs_modulus": 1e6,
      "poisson_ratio": 0.2, "friction": 30, "dilation": 0, "cohesion": 1e5, "tension_cutoff": 1e4,
      "softening": false}],
    "particles": [{"generator": {"type": "region", "material": "sand", "per_cell": 2,
      "region": {"box": {"min": [0.1, 0.1], "max": [0.3, 0.3]}}}}],
    "analysis": {"dt": 0.001, "nsteps": 2},
    "stages": [{"name": "strong"}, {"name": "weak", "materials": [{"name": "sand",
      "type": "MohrCoulomb", "density": 1000, "youngs_modulus": 1e6, "poisson_ratio": 0.2,
      "friction": 10, "dilation": 0, "cohesion": 100, "tension_cutoff": 50, "softening": false}]}]
  })";
  return stage_of(text, stage);
}

/// A loaded column, the stages after its first one, and what they do to it.
Model<2> loaded_first(const std::string& later, std::size_t stage) {
  return stage_of(column(R"({"cell_size": 0.1, "counts": [2, 12]})", "1",
                         R"("external_loading_conditions": )" + load +
                             R"(, "stages": [{"name": "loaded"})" + later + "]"),
                  stage);
}
const std::string softer = R"(, {"name": "softer", "materials": [{"name": "m",
  "type": "LinearElastic", "density": 1000, "youngs_modulus": 5e8, "poisson_ratio": 0}]})";

/// A loaded column. Its strains begin anew in the second stage, and it gets softer in the third.
Model<2> measured_anew(std::size_t stage) {
  return stage_of(
      column(R"({"cell_size": 0.1, "counts": [1, 12]})", "1",
             R"("external_loading_conditions": )" + load +
                 R"(, "stages": [{"name": "loaded"}, {"name": "reset", "reset": ["strain"]},
      {"name": "softer", "materials": [{"name": "m", "type": "LinearElastic", "density": 1000,
                                        "youngs_modulus": 5e8, "poisson_ratio": 0}]}])"),
      stage);
}

/// A column that bears its weight. Its upper half goes in the second stage, at once or in time.
struct Lightened {
  std::string steps;      ///< of the second stage
  Index look;             ///< at the stress, every so many steps
  std::string over = "";  ///< [s]
};
const std::string explicit_steps =
    R"({"mpm_scheme": "usl", "scheme_settings": null, "dt": 2e-5, "nsteps": 20000})";
const std::string quasi_static_steps = R"({"dt": 0.05, "nsteps": 40})";
Model<2> lightened(const Lightened& way, std::size_t stage) {
  return stage_of(
      column(R"({"cell_size": 0.1, "counts": [1, 12]})", "1",
             R"("external_loading_conditions": {"gravity": [0, -10]},
      "stages": [{"name": "rest"}, {"name": "lighter", "analysis": )" +
                 way.steps +
                 R"(, "remove": [{"region": {"box": {"min": [0, 0.5], "max": [1, 2]}})" +
                 (way.over.empty() ? "" : ", \"over\": " + way.over) + "}]}]"),
      stage);
}

/// Mean vertical stress of the lowest cell [Pa].
double stress_at_base(Simulation& simulation) {
  const Frame frame = simulation.frame();
  const FrameColumn* stress = frame.find("stress");
  REQUIRE(stress);
  double sum = 0, n = 0;
  for (std::size_t p = 0; p < frame.id.size(); ++p)
    if (frame.coordinates[2 * p + 1] < 0.1) sum += stress->values[6 * p + 1], ++n;
  return sum / n;
}

struct Lightening {
  double least = std::numeric_limits<double>::max(), end = 0;  ///< [Pa] pressure at the base
  std::vector<std::pair<double, double>> mass;                 ///< [kg] at a time [s]
  Index particles = 0;
};
Lightening lighten(const Lightened& way) {
  Simulation first(lightened(way, 0), serial());
  first.run();
  const StoredState between(first.state());
  Simulation second(lightened(way, 1), serial(), {}, state_at_start(between.view(), false));
  Lightening found;
  while (!second.finished()) {
    second.advance(way.look);
    found.end = -stress_at_base(second);
    found.least = std::min(found.least, found.end);
    found.mass.emplace_back(second.time(), second.history().mass);
  }
  found.particles = second.history().particles;
  return found;
}

}  // namespace

TEST_CASE("strains begin anew where a stage says so, and do not follow from new parameters") {
  const auto check = [](Simulation& simulation, double strain) {
    const Frame frame = simulation.frame();
    const FrameColumn *found = frame.find("strain"), *stress = frame.find("stress");
    REQUIRE(found);
    REQUIRE(stress);
    for (std::size_t p = 0; p < frame.id.size(); ++p) {
      CHECK(std::abs(found->values[6 * p + 1] - strain) < 1e-7);
      CHECK(stress->values[6 * p + 1] == within(1e-3, -1e5));
    }
  };
  Simulation loaded(measured_anew(0), serial());
  loaded.run();
  check(loaded, -1e-4);
  StoredState before(loaded.state());
  for (const std::size_t stage : {1, 2}) {
    Simulation simulation(measured_anew(stage), serial(), {}, state_at_start(before.view(), false));
    simulation.run();
    check(simulation, 0.0);
    before = StoredState(simulation.state());
  }
}

TEST_CASE("strains that begin at zero, because the stage before has stored none, are told of") {
  const auto lost = [](const std::string& known, const std::string& later, std::size_t stage) {
    Simulation first(loaded_first(known, 0), serial());
    first.run();
    const StoredState before(first.state());
    const Simulation second(loaded_first(later, stage), serial(), {},
                            state_at_start(before.view(), false));
    return second.info().changed.lost_strains;
  };
  const std::string same = R"(, {"name": "same"})",
                    anew = R"(, {"name": "anew", "reset": ["strain"]})";
  // The first stage has run before there was the second one.
  CHECK(lost(same, softer, 1));
  CHECK(lost(same, same + softer, 1));
  CHECK_FALSE(lost(same, anew, 1));
  CHECK_FALSE(lost(softer, softer, 1));
  CHECK_FALSE(lost(same, same, 1));
}

TEST_CASE("strains go on where a stage places particles of a law with strains of its own") {
  const std::string soil = R"(, {"name": "filled", "place": [{"generator": {"type": "region",
    "material": "m", "per_cell": 2, "stress": -10,
    "region": {"box": {"min": [0.1, 0], "max": [0.2, 0.2]}}}}]})";
  Simulation first(loaded_first(soil, 0), serial());
  first.run();
  const StoredState before(first.state());
  Simulation second(loaded_first(soil, 1), serial(), {}, state_at_start(before.view(), false));
  CHECK_FALSE(second.info().changed.lost_strains);
  const Frame frame = second.frame();
  const FrameColumn* strain = frame.find("strain");
  REQUIRE(strain);
  for (std::size_t p = 0; p < frame.id.size(); ++p)
    if (frame.coordinates[2 * p] < 0.1) CHECK(strain->values[6 * p + 1] == within(1e-2, -1e-4));
}

TEST_CASE("particles that a stage places where others are, are counted") {
  const auto occupied = [](const std::string& box, const std::string& more) {
    const std::string fill = R"(, {"name": "filled"{}, "place": [{"generator": {"type": "region",
      "material": "m", "per_cell": 2, "region": {"box": )" +
                             box + "}}}]}";
    std::string later = fill;
    later.replace(later.find("{}"), 2, more);
    Simulation first(loaded_first(later, 0), serial());
    first.run();
    const StoredState before(first.state());
    const Simulation second(loaded_first(later, 1), serial(), {},
                            state_at_start(before.view(), false));
    return second.info().changed.occupied;
  };
  // A column 1 m high and a cell wide lies in a grid of cells of 0.1 m.
  const OccupiedCells both = occupied(R"({"min": [0, 0.8], "max": [0.2, 1.2]})", "");
  CHECK(both.cells == 2);
  CHECK(both.particles == 8);
  CHECK(both.most == within(0.01, 2));
  CHECK(both.place[0] < 0.1);
  CHECK(both.place[1] == within(0.12, 0.9));
  CHECK(occupied(R"({"min": [0, 1], "max": [0.2, 1.2]})", "").cells == 0);
  CHECK(occupied(R"({"min": [0, 0.8], "max": [0.2, 1.2]})",
                 R"(, "remove": [{"region": {"box": {"min": [0, 0.8], "max": [0.2, 2]}}}])")
            .cells == 0);
}

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

TEST_CASE("a load that a stage brings acts on the area that its particles had at the beginning") {
  Simulation first(loaded_late(0), serial());
  first.run();
  const StoredState between(first.state());
  Simulation second(loaded_late(1), serial(), {}, state_at_start(between.view(), false));
  second.run();
  CHECK(stress_at_base(second) == within(1e-6, -1e5));
}

TEST_CASE("the strength that a stage gives a material is that of its particles, from the start") {
  Simulation first(weakened(0), serial());
  first.run();
  const StoredState between(first.state());
  Simulation second(weakened(1), serial(), {}, state_at_start(between.view(), false));
  const auto check = [&](Simulation& simulation, double cohesion, double degrees) {
    const Frame frame = simulation.frame();
    const FrameColumn *c = frame.find("cohesion"), *phi = frame.find("phi");
    REQUIRE(c);
    REQUIRE(phi);
    for (std::size_t p = 0; p < frame.id.size(); ++p) {
      CHECK(c->values[p] == doctest::Approx(cohesion));
      CHECK(phi->values[p] == doctest::Approx(degrees * std::numbers::pi / 180));
    }
  };
  check(first, 1e5, 30);
  check(second, 100, 10);
  second.run();
  check(second, 100, 10);
}

TEST_CASE(
    "ground that goes little by little leaves the stress of what lies on it, without a shock") {
  // 1 m of 1000 kg/m^3 under 10 m/s^2, in the middle of the lowest cell; then half of it. A wave
  // takes 1 ms through the column.
  constexpr double before = 9500, after = 4500;
  const Lightening at_once = lighten({.steps = explicit_steps, .look = 15}),
                   slowly = lighten({.steps = explicit_steps, .look = 15, .over = "0.2"}),
                   by_solves = lighten({.steps = quasi_static_steps, .look = 1, .over = "1"}),
                   rounded = lighten({.steps = R"({"dt": 0.02, "nsteps": 20})",
                                      .look = 1,
                                      .over = "0.2"});  // ten steps are 0.2 but for rounding
  // What is suddenly gone is missed twice.
  CHECK(at_once.least < after - 0.8 * (before - after));
  CHECK(slowly.least == within(0.01, after));
  CHECK(slowly.end == within(0.005, after));
  CHECK(by_solves.least == within(1e-4, after));
  CHECK(by_solves.end == within(1e-4, after));
  for (const auto& [way, over] :
       {std::pair(slowly, 0.2), std::pair(by_solves, 1.0), std::pair(rounded, 0.2)}) {
    CHECK(way.particles == 20);
    for (const auto& [time, mass] : way.mass)
      CHECK(mass == within(1e-9, 50 * (1 + std::max(0.0, 1 - time / over))));
  }
}

TEST_CASE("what goes little by little has not passed a plane, and goes on after a restart") {
  const Lightened way{.steps = R"({"mpm_scheme": "musl", "scheme_settings": null, "dt": 2e-5,
                                   "nsteps": 400})",
                      .look = 0,
                      .over = "0.006"};
  Simulation first(lightened(way, 0), serial());
  first.run();
  const StoredState between(first.state());
  Model<2> model = lightened(way, 1);
  Gauge plane;
  plane.kind = Gauge::Kind::plane;
  plane.name = "cut";
  plane.origin = {0, 0.7, 0};
  plane.direction = {0, 1, 0};
  model.output.measured.gauges = {plane};
  model.output.measured.steps = 20;
  std::vector<std::vector<double>> rows;  // mass beyond, volume, passed, flow
  Observer observer;
  observer.gauges = [&](const GaugeRows& row) { rows.push_back(row.values.front()); };
  bool any_removed = false;
  observer.removed = [&](std::span<const RemovedParticle>) { any_removed = true; };
  Simulation whole(model, serial(), observer, state_at_start(between.view(), false));
  whole.advance(190);
  const StoredState middle(whole.state());
  whole.run();
  CHECK(!any_removed);  // nothing has left the mesh
  REQUIRE(rows.size() == 20);
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const double share = std::max(0.0, 1 - 4e-4 * static_cast<double>(k + 1) / 0.006);
    CHECK(std::abs(rows[k][0] - 30 * share) < 1e-9);
    CHECK(std::abs(rows[k][2]) < 1e-9);
  }
  observer.removed = {};
  Simulation resumed(model, flow(2), observer, middle.view());
  resumed.run();
  CHECK(difference(StoredState(whole.state()), StoredState(resumed.state())) == "");
}
