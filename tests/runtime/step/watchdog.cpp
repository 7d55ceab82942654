// Runs whose results cannot be right end with a message, the same however they are executed.
#include "runtime/step/watchdog.h"

#include <doctest/doctest.h>

#include <limits>
#include <string>
#include <vector>

#include "physics/base/error.h"
#include "tests/runtime/step/models.h"

using namespace lahar;
using namespace lahar::test;

namespace {

using Kind = WatchdogAlarm::Kind;

/// Sums of 2 kg that began with 5 J.
HistoryRow row(double kinetic, double internal, double external, double damping, double speed) {
  HistoryRow row;
  row.step = 64;
  row.time = 0.5;
  row.mass = 2;
  row.kinetic = kinetic;
  row.internal = internal;
  row.external = external;
  row.damping = damping;
  row.max_speed = speed;
  return row;
}
constexpr double start = 5;

/// What is wrong with such sums: "" or a kind.
std::string judged(const Watchdog& bounds, const SpeedScales& scales, const HistoryRow& row,
                   double stored = 0, bool strained = false) {
  WatchdogJudge judge(bounds, scales);
  judge.state.stored = stored;
  const auto alarm = judge.judge(row, start, strained);
  if (!alarm) return "";
  return alarm->kind == Kind::energy ? "energy" : alarm->kind == Kind::speed ? "speed" : "volume";
}

/// Discs whose speed is more than the watchdog takes for possible.
Model<2> watched_discs() {
  Model<2> model = two_discs();
  model.watchdog.speed = 0.1;
  return model;
}

std::string end_of(Simulation& simulation) {
  try {
    simulation.run();
  } catch (const WatchdogError& error) {
    return error.what();
  }
  return "";
}

}  // namespace

TEST_CASE("energy is judged against what was put in") {
  const Watchdog bounds;
  CHECK(judged(bounds, {}, row(5, 0, 0, 0, 0)) == "");
  CHECK(judged(bounds, {}, row(9.9, 0, 0, 0, 0)) == "");  // less than twice
  CHECK(judged(bounds, {}, row(10.1, 0, 0, 0, 0)) == "energy");
  CHECK(judged(bounds, {}, row(5, 5.1, 0, 0, 0)) == "energy");
  CHECK(judged(bounds, {}, row(5, 0, 0, 5.1, 0)) == "energy");
  CHECK(judged(bounds, {}, row(105, 0, 100, 0, 0)) == "");  // a fall
  CHECK(judged(bounds, {}, row(5, 50, 100, 50, 0)) == "");
  CHECK(judged(bounds, {}, row(0, -5, -100, 0, 0)) == "energy");  // work done by 5 J
  CHECK(judged(bounds, {}, row(2, 0, 0, 0, 0)) == "");            // lost by the transfer
  CHECK(judged({.energy = 2}, {}, row(14.9, 0, 0, 0, 0)) == "");
  CHECK(judged({.energy = 0}, {}, row(1e9, 0, 0, 0, 0)) == "");
}

TEST_CASE("a fluid without stiffness stores no energy, and its checkpoints can be read") {
  Model<2> model = dam_break();
  std::get<Newtonian>(model.materials[0].law).incompressible = true;
  Simulation simulation(model, serial());
  simulation.advance(3);
  CheckpointHeader header;
  header.run = simulation.state().run;
  CHECK(header.run.watchdog.stored == 0);
  CHECK(header_text(read_header(header_text(header))) == header_text(header));
}

TEST_CASE("stresses give no more energy than they held at the start") {
  const Watchdog bounds;
  CHECK(judged(bounds, {}, row(25, -20, 0, 0, 0), 20) == "");  // a spring that is let go
  CHECK(judged(bounds, {}, row(105, -100, 0, 0, 0), 20) == "energy");
  CHECK(judged(bounds, {}, row(105, -100, 0, 0, 0)) == "energy");
}

TEST_CASE("energies of small strains and small falls are not judged") {
  // 2 kg, waves of 1000 m/s: a strain of 0.1 % is 1 J; a fall of 200 m/s in the mesh: 1 % is 400 J.
  HistoryRow rest = row(0.9, 0, 0, 0, 0);
  WatchdogJudge stiff({}, {.waves = 1000}), falls({}, {.fall = 200});
  CHECK(!stiff.judge(rest, 0, false));
  rest.kinetic = 1.1;
  CHECK(stiff.judge(rest, 0, false));
  rest.kinetic = 399;
  CHECK(!falls.judge(rest, 0, false));
  rest.kinetic = 401;
  CHECK(falls.judge(rest, 0, false));
}

TEST_CASE("speeds are judged against all that mean something") {
  const Watchdog bounds;
  const HistoryRow fast = row(5, 0, 0, 0, 100);
  CHECK(judged(bounds, {}, fast) == "speed");
  CHECK(judged(bounds, {.waves = 9}, fast) == "speed");
  CHECK(judged(bounds, {.waves = 11}, fast) == "");
  CHECK(judged(bounds, {.prescribed = 11}, fast) == "");
  CHECK(judged(bounds, {.acceleration = 19}, fast) == "speed");  // for 0.5 s
  CHECK(judged(bounds, {.acceleration = 21}, fast) == "");
  CHECK(judged(bounds, {.fall = 11}, fast) == "");
  CHECK(judged(bounds, {}, row(5, 0, 100, 0, 100)) == "");  // 105 J for 2 kg
  CHECK(judged({.speed = 0}, {}, fast) == "");
  CHECK(judged(bounds, {.waves = 11}, fast, 0, true) == "volume");
}

TEST_CASE("an adaptive step is judged against the first one, and against the time") {
  WatchdogJudge judge({.time_step = 1e-3}, {});
  CHECK(!judge.judge_step(0, 0, 0.01));
  CHECK(!judge.judge_step(1, 0.01, 1.1e-5));
  CHECK(!judge.judge_step(2, 0.02, 2));
  const auto small = judge.judge_step(3, 0.03, 0.9e-5);
  REQUIRE(small);
  CHECK(small->text ==
        "the time step fell to 9e-06 s, 0.0009 times the first, 0.01 s; 0.001 times are allowed.");
  WatchdogJudge lax({.time_step = 0}, {});
  CHECK(!lax.judge_step(0, 0, 0.01));
  CHECK(!lax.judge_step(1, 1, 1e-15));
  CHECK(lax.judge_step(1, 1, 1e-17));
  CHECK(lax.judge_step(1, 1, 0));
}

TEST_CASE("the watchdog ends a run at the same step with the same message in every way") {
  const Model<2> model = watched_discs();
  const Outcome reference = run(model, serial());
  CHECK(reference.error.find("step 64 (t = 0.256 s): the largest speed is ") == 0);
  CHECK(reference.error.find(" The fastest particle after step 67: particle ") !=
        std::string::npos);
  CHECK(reference.error.find(" Try a time step below 0.004 s, or \"mpm_scheme\": \"musl\"; ") !=
        std::string::npos);
  CHECK(reference.error.find("analysis.watchdog.speed") != std::string::npos);
  CHECK(reference.frames.back().step == 67);
  for (const ExecutionOptions& way : other_ways()) {
    CAPTURE(describe(way));
    CHECK(same_bits(run(model, way), reference));
  }
  Model<2> unwatched = model;
  unwatched.watchdog.action = Watchdog::Action::none;
  Simulation simulation(unwatched, serial());
  simulation.advance(67);
  CHECK(same_bits(simulation.frame(), reference.frames.back()));
}

TEST_CASE("a run that goes on beyond the bounds of the watchdog says so once") {
  Model<2> model = watched_discs();
  model.watchdog.action = Watchdog::Action::warn;
  model.analysis.nsteps = 200;
  model.analysis.step.dt = 1e-3;
  for (const ExecutionOptions& way : {serial(), flow(3)}) {
    std::vector<std::string> warnings;
    Observer observer;
    observer.warning = [&](const std::string& text) { warnings.push_back(text); };
    Simulation simulation(model, way, observer);
    simulation.run();
    CHECK(simulation.step() == 200);
    REQUIRE(warnings.size() == 1);
    CHECK(warnings[0].find("step 64 (t = 0.064 s): the largest speed is ") == 0);
  }
}

TEST_CASE("a run that was restarted between alarm and end ends as the one that was not") {
  const Model<2> model = watched_discs();
  Simulation whole(model, serial());
  const std::string expected = end_of(whole);
  REQUIRE(expected != "");
  for (const Index steps : {60, 64, 65, 67}) {
    CAPTURE(steps);
    Simulation first(model, flow(2));
    try {
      first.advance(steps);
    } catch (const WatchdogError&) {
      CHECK(steps == 67);
    }
    CHECK(first.step() == steps);
    Simulation second(model, flow(2), {}, first.state());
    CHECK(end_of(second) == expected);
    CHECK(second.step() == 67);
    Model<2> lax = model;  // other bounds: it goes on
    lax.watchdog.speed = 10;
    Simulation third(lax, serial(), {}, first.state());
    CHECK(end_of(third) == "");
    CHECK(third.step() == 80);
  }
}

TEST_CASE("a time step that falls to nothing ends a run") {
  // Waves of 0.3 m/s and a weight that is as good as infinite.
  Model<2> model = model_of_text<2>(R"({
    "mesh": {"structured": {"cell_size": 1, "extent": [4, 4]}},
    "materials": [{"type": "LinearElastic", "density": 1000, "youngs_modulus": 100,
                   "poisson_ratio": 0}],
    "particles": [{"generator": {"type": "region", "per_cell": 1, "material": 0,
                                 "region": {"box": {"min": [1, 3], "max": [3, 4]}}}}],
    "external_loading_conditions": {"gravity": [0, -1e7]},
    "analysis": {"time_step": {"adaptive": true, "safety": 1e-4}, "nsteps": 100000,
                 "patch_particles": 1}})");
  const Outcome reference = run(model, serial());
  CHECK(reference.error.find(": the time step fell to ") != std::string::npos);
  CHECK(reference.error.find(" times the first, ") != std::string::npos);
  CHECK(reference.error.find(" Try a \"safety\" below 0.0001 in \"time_step\"") !=
        std::string::npos);
  for (const ExecutionOptions& way : other_ways()) {
    CAPTURE(describe(way));
    CHECK(same_bits(run(model, way), reference));
  }
}

TEST_CASE("what a projection makes at a free surface is not blamed on the length of its steps") {
  const WatchdogAlarm alarm{.kind = Kind::energy, .step = 8, .time = 0.5, .value = 2, .text = "x."};
  const auto said = [&](const char* more) {
    const auto model = model_of_text<2>(std::string(R"({
      "mesh": {"structured": {"cell_size": 0.1, "counts": [4, 4]}},
      "materials": [{"type": "Newtonian", "density": 1000, "bulk_modulus": 2e6,
                     "dynamic_viscosity": 0.001}],
      "particles": [{"generator": {"type": "region", "per_cell": 2, "material": 0}}],
      "analysis": {"dt": 1e-5, "nsteps": 1)") +
                                        more + "}}");
    return watchdog_message(alarm, 8, "here", model);
  };
  const std::string projection = R"(, "mpm_scheme": "projection")";
  CHECK(said("").find("Try a time step below 1e-05 s") != std::string::npos);
  CHECK(said(projection.c_str()).find("Try a time step") == std::string::npos);
  CHECK(said(projection.c_str()).find("shorter steps make it worse") != std::string::npos);
  const std::string full = projection + R"(, "free_surface_detection": {"type": "none"})";
  CHECK(said(full.c_str()).find("Try a time step below") != std::string::npos);
}

TEST_CASE("a particle that is squeezed or blown up beyond measure ends a run") {
  Model<2> model = two_discs();
  model.watchdog.compression = 0.99;
  const Outcome reference = run(model, serial());
  CHECK(reference.error.find("a particle has less than 0.99 or more than 1e+06 times the volume") !=
        std::string::npos);
  CHECK(reference.error.find(" times its first volume. ") != std::string::npos);
  CHECK(run(model, flow(3)).error == reference.error);
  model.watchdog.compression = 0;
  CHECK(run(model, serial()).error == "");
}

// Affine velocities with functions of elements: where sand comes apart, stresses give energy that
// they never held.
TEST_CASE("a column of sand whose energy runs away ends with a message") {
  Model<2> model = model_of_text<2>(R"({
    "mesh": {"structured": {"cell_size": 0.01, "extent": [0.8, 0.3]}, "boundary_conditions": {
      "velocity_constraints": [{"nset": "floor", "dir": "y", "velocity": 0},
                               {"nset": "symmetry", "dir": "x", "velocity": 0}],
      "friction_constraints": [{"nset": "floor", "dir": "y", "sign_n": -1, "friction": 0.5}]}},
    "sets": {"nodes": {"floor": {"half_space": {"point": [0, 0], "normal": [0, 1]}},
                       "symmetry": {"half_space": {"point": [0, 0], "normal": [1, 0]}}}},
    "materials": [{"type": "MohrCoulomb", "density": 1600, "youngs_modulus": 1e6,
                   "poisson_ratio": 0.3, "friction": 30, "dilation": 0, "cohesion": 0,
                   "tension_cutoff": 0}],
    "particles": [{"generator": {"type": "region", "per_cell": 3, "material": 0,
                                 "region": {"box": {"min": [0, 0], "max": [0.1, 0.2]}}}}],
    "external_loading_conditions": {"gravity": [0, -9.81]},
    "analysis": {"time_step": {"adaptive": true}, "nsteps": 1000, "mpm_scheme": "musl"}})");
  model.analysis.affine = Affine::tpic;  // what scenarios cannot ask for
  model.analysis.transfer.flip = 0;
  const Outcome outcome = run(model, serial());
  if (outcome.error.empty()) {  // whoever mends it may do so
    CHECK(outcome.rows.back().kinetic < 32 * 9.81 * 0.2);
    return;
  }
  CHECK(outcome.error.find("\"velocity_update\": \"tpic\" with the functions of elements") !=
        std::string::npos);
  CHECK(outcome.frames.back().step < 400);
}
