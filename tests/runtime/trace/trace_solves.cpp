// Traces of runs whose steps begin with a solve: loops of solvers are in them like the time step.
#include <doctest/doctest.h>

#include <algorithm>
#include <numeric>
#include <set>

#include "graph/stage_loop.h"
#include "physics/base/error.h"
#include "runtime/trace/analyse/analysis.h"
#include "runtime/trace/analyse/project.h"
#include "runtime/trace/analyse/replay.h"
#include "tests/runtime/step/falling_water.h"
#include "tests/runtime/trace/recorded.h"
#include "tests/within.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// A block on a floor under its weight.
Model<2> implicit_model(LinearSolver::Method method = LinearSolver::Method::iterative) {
  Model<2> model = model_of_text<2>(R"({
    "mesh": {"structured": {"cell_size": 0.1, "extent": [2, 1.5]},
             "boundary_conditions": {"velocity_constraints": [
               {"nset": "floor", "dir": "x", "velocity": 0},
               {"nset": "floor", "dir": "y", "velocity": 0}]}},
    "sets": {"nodes": {"floor": {"half_space": {"point": [0, 0], "normal": [0, 1]}}}},
    "materials": [{"type": "LinearElastic", "density": 1000, "youngs_modulus": 1e6,
                   "poisson_ratio": 0.3}],
    "particles": [{"generator": {"type": "region", "per_cell": 2, "material": 0,
                                 "region": {"box": {"min": [0.4, 0], "max": [1.6, 1]}}}}],
    "external_loading_conditions": {"gravity": [0, -10]},
    "analysis": {"mpm_scheme": "newmark", "dt": 0.01, "nsteps": 4, "patch_particles": 60}})");
  model.analysis.linear.method = method;
  return model;
}

Model<2> projection_model() {
  Model<2> model = falling_water(LinearSolver::Method::iterative);
  model.analysis.nsteps = 4;
  return model;
}

/// (The graph of an implicit time step is drained after each step, which verifying does not know.)
ExecutionOptions on(int threads) {
  return {.threads = threads};
}

std::vector<std::string> names_of(const TraceLog& log) {
  std::vector<std::string> names;
  for (const TraceRun::Loop& loop : log.run.loops) names.push_back(loop.name);
  return names;
}

std::int64_t turns(const TraceReport& report, const std::string& loop) {
  for (const LoopUse& use : report.loops)
    if (use.name == loop) return use.turns;
  return -1;
}

double on_path(const TraceReport& report, PathPart::Kind kind) {
  return report.path.by_kind[static_cast<std::size_t>(kind)];
}

}  // namespace

TEST_CASE("a trace has every round of a solve, stage by stage, and is sound") {
  for (const int threads : {1, 3}) {
    CAPTURE(threads);
    const auto [log, solves] = recorded(implicit_model(), on(threads));
    CHECK(names_of(log) == std::vector<std::string>{"time step", "begin", "linearize", "solve"});
    CHECK(problems_of(log) == std::vector<std::string>{});
    const TraceReport report = analyse(log);
    CHECK(turns(report, "time step") == 4);
    CHECK(turns(report, "begin") == 4);
    // Before each linear solve and after the last, and for the first accelerations.
    CHECK(turns(report, "linearize") == solves.iterations + 4 + 1);
    CHECK(turns(report, "solve") == solves.products.count);
    std::set<std::string> stages;
    for (const StageUse& use : report.stages) {
      CHECK(use.count > 0);
      if (use.loop != "time step") stages.insert(use.loop + ": " + use.stage);
    }
    CHECK(stages == std::set<std::string>{"begin: P2G", "begin: motion", "linearize: linearize",
                                          "linearize: balance", "solve: multiply",
                                          "solve: advance"});
    // Sums of the round before are taken over by a task, but in the first round of a solve.
    std::set<Step> with_sums;
    for (const TraceTask& task : log.tasks)
      if (task.kind == TraceKind::dt && log.run.loop_of(task.phase) == 3)
        with_sums.insert(task.round);
    CHECK(static_cast<std::int64_t>(with_sums.size()) >= solves.products.count - solves.iterations);
  }
}

TEST_CASE("loops of a projection are in its trace") {
  const auto [log, solves] = recorded(projection_model(), on(2));
  CHECK(names_of(log) == std::vector<std::string>{"time step", "system", "solve"});
  CHECK(problems_of(log) == std::vector<std::string>{});
  const TraceReport report = analyse(log);
  CHECK(turns(report, "system") == 4);
  CHECK(turns(report, "solve") >= solves.products.count);  // cycles have rounds without a product
  CHECK(solves.products.count > 4);
}

TEST_CASE("the critical path of a run with solves is its time, and leads from loop to loop") {
  const TraceLog log = recorded(implicit_model(), on(2)).log;
  const TraceReport report = analyse(log);
  const auto& kinds = report.path.by_kind;
  CHECK(std::accumulate(kinds.begin(), kinds.end(), 0.0) == within(1e-6, log.run.wall));
  CHECK(on_path(report, PathPart::Kind::between) > 0);
  CHECK(on_path(report, PathPart::Kind::direct) == 0);
  std::set<int> loops;
  for (const PathPart& part : report.path.parts)
    if (part.kind == PathPart::Kind::task)
      loops.insert(log.run.loop_of(log.tasks[static_cast<std::size_t>(part.task)].phase));
  CHECK(loops == std::set<int>{0, 1, 2, 3});
  double wall = 0;
  for (const LoopUse& loop : report.loops) wall += loop.wall;
  // What is left is when others had the core.
  const double known = wall + on_path(report, PathPart::Kind::between);
  CHECK(known < 1.02 * log.run.wall);
  CHECK(known > 0.3 * log.run.wall);
}

TEST_CASE("a direct solve is a piece of the critical path") {
  const TraceLog log = recorded(implicit_model(LinearSolver::Method::direct), on(2)).log;
  CHECK(problems_of(log) == std::vector<std::string>{});
  double direct = 0;
  for (const TraceInterval& i : log.intervals)
    if (i.kind == TraceKind::direct) direct += i.end - i.begin;
  REQUIRE(direct > 0);
  CHECK(on_path(analyse(log), PathPart::Kind::direct) == within(0.01, direct));
}

TEST_CASE("steps that are not asked for leave no rounds in a trace") {
  const TraceLog log = recorded(implicit_model(), on(2), {.first = 1, .last = 2}).log;
  CHECK(log.run.first == 1);
  CHECK(log.run.last == 2);
  CHECK(problems_of(log) == std::vector<std::string>{});
  for (const TraceTask& task : log.tasks) CHECK((task.step == 1 || task.step == 2));
}

TEST_CASE("a replay of a run with solves takes the time that it took, and less with more threads") {
  const TraceLog log = recorded(implicit_model(), on(1)).log;
  const Replay r = replay(log, {});
  CHECK(r.step_time.size() == 4);
  // What interrupts a worker between two tasks is not in a replay.
  CHECK(r.total < 1.05 * log.run.wall);
  CHECK(r.total > analyse(log).path.work);
  const Replay two = replay(log, {.threads = 2});
  CHECK(two.total < r.total);
  CHECK(two.pauses == r.pauses);  // what solvers do between loops
  const Replay ranks = replay(log, {.ranks = 2, .network = Network::ideal()});
  Network slow = Network::ideal();
  slow.latency = 1e-3;
  // Each round waits for a message or for the sums of the round before.
  const auto rounds = static_cast<double>(turns(analyse(log), "solve"));
  CHECK(replay(log, {.ranks = 2, .network = slow}).total >= ranks.total + 0.9e-3 * rounds);
  CHECK(std::ranges::any_of(r.notes, [](const std::string& note) {
    return note.find("what solvers do between their loops") != std::string::npos;
  }));
}

TEST_CASE("a run with solves is not projected to larger machines, and told why") {
  const TraceLog log = recorded(projection_model(), on(1)).log;
  CHECK_THROWS_WITH_AS(project(log, {}),
                       "the steps of this run begin with a solve: they cannot be projected, as how "
                       "many rounds a larger model needs is not in a trace",
                       InputError);
}
