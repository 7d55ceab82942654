// Adaptive implicit steps: their lengths by numbers, and runs whose steps are cut.
#include "runtime/step/load_steps.h"

#include <doctest/doctest.h>

#include <cmath>
#include <string>
#include <vector>

#include "tests/runtime/step/restart_checks.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// Steps of 1 s and less, down to 1 ms. Few iterations are up to 8, many are above 30.
LoadSteps seconds() {
  Analysis analysis;
  analysis.step = {.adaptive = true, .dt = 1.0, .safety = 0.2};
  return {analysis, Watchdog{.time_step = 1e-3}};
}

ImplicitReport solved(int iterations, double cells = 0.0) {
  ImplicitReport report;
  report.converged = true;
  report.iterations = iterations;
  report.longest_move.cells = cells;
  return report;
}

/// A beam of clay that is held at its left end and bends further down than it is long, while its
/// weight grows for a second. Half a second is too long a step for that.
Model<2> bending_beam(bool adaptive, double dt = 0.5) {
  Model<2> model = model_of_text<2>(R"({
    "mesh": {"structured": {"cell_size": 0.25, "extent": [4, 3]},
             "boundary_conditions": {"velocity_constraints": [
               {"nset": "wall", "dir": "x", "velocity": 0},
               {"nset": "wall", "dir": "y", "velocity": 0}]}},
    "sets": {"nodes": {"wall": {"half_space": {"point": [0, 0], "normal": [1, 0]}}}},
    "materials": [{"type": "VonMises", "density": 1000, "youngs_modulus": 1e6,
                   "poisson_ratio": 0.3, "yield_stress": 30000, "hardening_modulus": 1e5}],
    "particles": [{"generator": {"type": "region", "per_cell": 2, "material": 0,
                                 "region": {"box": {"min": [0, 1.5], "max": [2, 2.5]}}}}],
    "external_loading_conditions": {"gravity": {"gravity": [0, -12], "ramping_time": 1}},
    "analysis": {"mpm_scheme": "newmark", "dt": 0.5, "end_time": 1, "patch_particles": 24,
                 "time_step": {"adaptive": true, "safety": 0.2},
                 "scheme_settings": {"quasi_static": true}},
    "post_processing": {"history_steps": 1}})");
  model.analysis.step.adaptive = adaptive;
  model.analysis.step.dt = dt;
  return model;
}

double lowest(const Frame& frame) {
  double y = frame.coordinates[1];
  for (std::size_t k = 1; k < frame.coordinates.size(); k += 2)
    y = std::min(y, frame.coordinates[k]);
  return y;
}

}  // namespace

TEST_CASE("load steps: few iterations make the next step longer, many make it shorter") {
  const LoadSteps steps = seconds();
  const auto next = [&](double planned, double dt, const ImplicitReport& report) {
    return steps.next({.planned = planned, .dt = dt}, false, report);
  };
  CHECK(next(0.1, 0.1, solved(1)) == doctest::Approx(0.15));
  CHECK(next(0.1, 0.1, solved(8)) == doctest::Approx(0.15));
  CHECK(next(0.1, 0.1, solved(9)) == 0.1);
  CHECK(next(0.1, 0.1, solved(30)) == 0.1);
  CHECK(next(0.1, 0.1, solved(31)) == 0.05);
  CHECK(next(0.9, 0.9, solved(1)) == 1.0);      // the largest
  CHECK(next(1e-3, 1e-3, solved(40)) == 1e-3);  // the smallest
}

TEST_CASE("load steps: what output shortened is as long again, unless it took many iterations") {
  const LoadSteps steps = seconds();
  const auto next = [&](double dt, int iterations) {
    return steps.next({.planned = 0.1, .dt = dt}, false, solved(iterations));
  };
  CHECK(next(0.01, 3) == 0.1);
  CHECK(next(0.01, 12) == 0.1);
  CHECK(next(0.09, 3) == doctest::Approx(0.135));
  CHECK(next(0.01, 35) == 0.005);
  // Nothing was planned before the first step but the largest one.
  CHECK(steps.next({.planned = HUGE_VAL, .dt = 0.01}, false, solved(3)) == 1.0);
}

TEST_CASE("load steps: a step is cut to a quarter, and the next is not longer") {
  const LoadSteps steps = seconds();
  CHECK(steps.cut(0.4) == 0.1);
  CHECK(steps.cut(2e-3) == 1e-3);
  CHECK(steps.is_smallest(1e-3));
  CHECK(steps.is_smallest(1e-3 * (1 + 1e-9)));  // as times are rounded
  CHECK_FALSE(steps.is_smallest(1.01e-3));
  CHECK(steps.next({.planned = 0.4, .dt = 0.1}, true, solved(2)) == 0.1);
  CHECK(steps.next({.planned = 0.4, .dt = 0.1}, true, solved(35)) == 0.05);
  Analysis analysis;
  analysis.step = {.adaptive = true, .dt = 1.0, .safety = 0.2};
  const LoadSteps unbounded(analysis, Watchdog{.time_step = 0});
  double dt = 1;
  int cuts = 0;
  for (; !unbounded.is_smallest(dt) && cuts < 100; ++cuts) dt = unbounded.cut(dt);
  CHECK(cuts < 20);
}

TEST_CASE("load steps: nodes move by a cell at most") {
  const LoadSteps steps = seconds();
  CHECK(steps.accepts(solved(5, 1.0)));
  CHECK_FALSE(steps.accepts(solved(5, 1.01)));
  CHECK_FALSE(steps.accepts(ImplicitReport{}));
  CHECK(steps.next({.planned = 0.1, .dt = 0.1}, false, solved(5, 0.8)) == doctest::Approx(0.125));
  CHECK(steps.next({.planned = 0.1, .dt = 0.1}, false, solved(5, 0.5)) == doctest::Approx(0.15));
}

TEST_CASE("adaptive implicit steps go on where fixed ones are too long") {
  const Outcome fixed = run(bending_beam(false), serial());
  CHECK(fixed.error != "");
  Simulation adaptive(bending_beam(true), serial());
  adaptive.run();
  CHECK(adaptive.finished());
  CHECK(adaptive.info().solves.cuts > 0);
  CHECK(adaptive.info().solves.in_parts == 0);
  Simulation fine(bending_beam(false, 0.01), serial());
  fine.run();
  const double down = 1.5 - lowest(fine.frame());
  CHECK(down > 1);
  CHECK(lowest(adaptive.frame()) == doctest::Approx(lowest(fine.frame())).epsilon(0.05 * down));
  CHECK(adaptive.step() < fine.step() / 4);
}

TEST_CASE("adaptive implicit steps end at times of output, and at the end time") {
  Model<2> model = bending_beam(true);
  model.output.frame_dt = 0.3;
  Outcome outcome = run(model, serial());
  REQUIRE(outcome.error == "");
  outcome.rows.pop_back();  // the last state once more
  std::vector<double> frames;
  for (const Frame& frame : outcome.frames) frames.push_back(frame.time);
  CHECK(frames == std::vector{0.3, 0.6, 3 * 0.3, 1.0});
  double before = 0, shortest = 1, longest = 0;
  for (const HistoryRow& row : outcome.rows) {
    CHECK(row.dt == doctest::Approx(row.time - before).epsilon(1e-12));
    before = row.time;
    shortest = std::min(shortest, row.dt);
    longest = std::max(longest, row.dt);
  }
  CHECK(before == 1.0);
  CHECK(longest <= 0.5);
  CHECK(shortest > 0.05 * longest);  // none is tiny
  CHECK(shortest < 0.5 * longest);
}

TEST_CASE("adaptive implicit steps have the same bits on threads and after a restart") {
  const Model<2> model = bending_beam(true);
  check_ways(model);
  Simulation simulation(model, serial());
  std::vector<Index> cut;  // steps done before one is cut
  while (!simulation.finished()) {
    const Index cuts = simulation.info().solves.cuts;
    simulation.advance(1);
    if (simulation.info().solves.cuts > cuts) cut.push_back(simulation.step() - 1);
  }
  REQUIRE(cut.size() >= 2);
  CHECK(cut.front() == 0);
  const Index end = simulation.step();
  for (const Index middle : {cut[1], cut[1] + 1}) check_restart(model, middle, end, {flow(2)});
}

TEST_CASE("adaptive implicit steps go on from each checkpoint with the same bits") {
  Model<2> model = bending_beam(true);
  model.output.checkpoint_steps = 1;
  std::vector<StoredState> states;
  Observer observer;
  observer.checkpoint = [&](const SimulationState& state) { states.emplace_back(state); };
  Simulation simulation(model, flow(2), observer);
  simulation.run();
  REQUIRE(static_cast<Index>(states.size()) >= simulation.step() - 1);
  for (const StoredState& state : states) {
    CAPTURE(state.run.step);
    Simulation resumed(model, serial(), {}, state.view());
    resumed.run();
    CHECK(resumed.step() == simulation.step());
    CHECK(same_bits(resumed.frame(), simulation.frame()));
  }
}

TEST_CASE("Newmark's steps adapt as well, with the same bits after a restart") {
  Model<2> model = bending_beam(true);
  model.analysis.implicit.quasi_static = false;
  Simulation simulation(model, serial());
  simulation.run();
  CHECK(simulation.time() == 1.0);
  CHECK(simulation.info().solves.cuts > 0);
  check_ways(model);
  check_restart(model, simulation.step() / 2, simulation.step(), {flow(2)});
}

TEST_CASE("where the smallest step has no equilibrium, the run says so and keeps its last state") {
  Model<2> model = bending_beam(true);
  entries_of<NodeVelocity>(model).clear();  // it falls
  model.watchdog.time_step = 0.1;
  Simulation simulation(model, serial());
  const Frame before = simulation.frame();
  std::string said;
  try {
    simulation.run();
  } catch (const SimulationError& error) {
    said = error.what();
  }
  CAPTURE(said);
  CHECK(said.find("step 1 (t = 0 s): no equilibrium found in the smallest step, 0.05 s") == 0);
  CHECK(said.find("N are not in balance") != std::string::npos);
  CHECK(said.find("allow smaller steps (time_step of watchdog)") != std::string::npos);
  CHECK(simulation.step() == 0);
  CHECK(simulation.info().solves.cuts == 2);
  CHECK(simulation.frame().coordinates == before.coordinates);
}

TEST_CASE("adaptive implicit steps come to rest when loads have ceased to grow") {
  Model<2> model = bending_beam(true, 0.25);
  model.gravity[1] = -3;
  model.analysis.end_time = 10;
  model.analysis.until.imbalance = 1e-3;
  Simulation simulation(model, serial());
  simulation.run();
  CHECK(simulation.info().rest.reached);
  CHECK(simulation.time() >= 1.0);
  CHECK(simulation.time() < 2.0);
}
