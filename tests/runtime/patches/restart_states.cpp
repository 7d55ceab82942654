// A run that goes on from its state gives the bits of one that was never interrupted.
#include <doctest/doctest.h>

#include <algorithm>
#include <cstring>
#include <numeric>

#include "physics/base/error.h"
#include "runtime/patches/patch_set.h"
#include "runtime/patches/patch_state.h"
#include "tests/runtime/step/restart_checks.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// All particles move off with one velocity: many change their patch, and patch sets are rebuilt.
template <int Dim>
void move_off(Model<Dim>& model, const Vec<Dim>& velocity) {
  model.particles.velocity.assign(static_cast<std::size_t>(model.particles.size()), velocity);
  model.output.frame_steps = model.output.history_steps = 5;
}

constexpr Scheme schemes[] = {Scheme::usf, Scheme::usl, Scheme::musl};

}  // namespace

TEST_CASE("restart: two discs, every scheme, fixed and adaptive steps") {
  for (const Scheme scheme : schemes)
    for (const bool adaptive : {false, true}) {
      Model<2> model = two_discs();
      model.analysis.scheme = scheme;
      model.analysis.damping = scheme == Scheme::musl ? 0.02 : 0.0;
      if (adaptive) model.analysis.step = {.adaptive = true, .dt = 1.0, .safety = 0.3};
      CAPTURE(static_cast<int>(scheme));
      CAPTURE(adaptive);
      check_restart(model, 17, 34);
      check_restart(model, 1, 12, {flow(2)});
      check_restart(model, 0, 9, {flow(2)});
      check_restart(model, 16, 34, {flow(2)});  // at a row of history
    }
}

TEST_CASE("restart: absorbing boundaries, whose springs remember the displacement") {
  for (const Scheme scheme : schemes) {
    Model<2> discs = with_absorbing(two_discs());
    discs.analysis.scheme = scheme;
    check_restart(discs, 17, 34);
    check_restart(discs, 0, 9, {flow(2)});
  }
  check_restart(with_absorbing(dam_break_3d()), 11, 30);
}

TEST_CASE("restart: GIMP, CPDI, splines and affine velocities") {
  for (const Scheme scheme : schemes) {
    Model<2> discs = with_functions(two_discs(), ShapeFunctions::gimp);
    discs.analysis.scheme = scheme;
    check_restart(discs, 17, 34);
    for (const ShapeFunctions functions : {ShapeFunctions::cpdi, ShapeFunctions::cpdi2}) {
      discs = with_functions(two_discs(), functions);
      discs.analysis.scheme = scheme;
      check_restart(discs, 17, 34);
    }
    discs = with_functions(two_discs(), ShapeFunctions::element, Affine::apic);
    discs.analysis.scheme = scheme;
    check_restart(discs, 17, 34);
    check_restart(separable(discs, ShapeFunctions::quadratic_spline), 17, 34);
  }
  Model<3> water = with_functions(dam_break_3d(), ShapeFunctions::quadratic_spline, Affine::apic);
  check_restart(water, 11, 30);
  check_restart(separable(water, ShapeFunctions::quadratic_spline), 11, 30);
  check_restart(with_functions(dam_break_3d(), ShapeFunctions::cpdi2), 11, 30);
}

TEST_CASE("restart: water with smoothed pressure, whose patch sets are rebuilt on the way") {
  for (const Scheme scheme : schemes)
    for (const bool adaptive : {false, true}) {
      Model<2> model = dam_break();
      model.analysis.scheme = scheme;
      model.analysis.pressure_smoothing = true;
      model.analysis.patch_particles = 16;
      if (scheme == Scheme::usl) move_off(model, {3, 0});
      if (adaptive) model.analysis.step = {.adaptive = true, .dt = 1.0, .safety = 0.5};
      const Index end = scheme == Scheme::usl ? 14 : 100;
      CAPTURE(static_cast<int>(scheme));
      CAPTURE(adaptive);
      Simulation whole(model, serial());
      const int patches = whole.info().patches;
      whole.advance(end);
      CHECK(whole.info().patches != patches);
      check_restart(model, end / 2, end);
      check_restart(model, end / 3, end, {flow(3)});
    }
}

TEST_CASE("restart: a jet that is injected, into nothing at first") {
  for (const char* scheme : {"usf", "usl", "musl"})
    for (const bool adaptive : {false, true}) {
      Model<2> model = jet(scheme, adaptive);
      CAPTURE(scheme);
      CAPTURE(adaptive);
      check_restart(model, 60, 120);
      check_restart(model, 0, 30, {flow(2)});
      check_restart(model, 7, 40, {flow(2)});  // before anything flows out of the wall
      if (adaptive) check_restart(distorted(std::move(model), 0.02), 50, 100, {flow(2)});
    }
}

TEST_CASE("restart: hexahedra, and distorted cells") {
  for (const Scheme scheme : schemes) {
    Model<3> model = dam_break_3d();
    model.analysis.scheme = scheme;
    if (scheme == Scheme::usl) move_off(model, {1.5, 0, 0});
    CAPTURE(static_cast<int>(scheme));
    check_restart(model, 9, 20);
    Model<2> discs = distorted(two_discs(), 0.012);
    discs.analysis.scheme = scheme;
    check_restart(discs, 15, 33);
    discs.analysis.step = {.adaptive = true, .dt = 1.0, .safety = 0.3};
    check_restart(discs, 15, 33, {flow(2)});
  }
  Model<3> water = distorted(dam_break_3d(), 0.03);
  water.analysis.step.dt = 5e-3;
  check_restart(water, 11, 30, {flow(2), serial()});
}

TEST_CASE("restart: loads travel with particles, and particles that left stay away") {
  Model<2> model = two_discs();
  ParticleTraction push{.particles = {}, .dir = 1, .traction = 300, .function = 0};
  ParticleVelocity drag{.particles = {}, .dir = 0, .velocity = 0.8};
  for (Index p = 0; p < model.particles.size(); p += 3) push.particles.push_back(p);
  for (Index p = 1; p < model.particles.size() / 4; p += 5) drag.particles.push_back(p);
  model.functions = {{.kind = MathFunction::Kind::linear, .x = {0, 0.1}, .f = {0, 1}}};
  model.tractions = {push};
  model.particle_velocities = {drag};
  entries_of<NodeForce>(model) = {{.node = 210, .dir = 0, .force = 2.0, .function = -1}};
  check_restart(model, 30, 60);
  model.analysis.drives_nodes = true;
  check_restart(model, 30, 60);

  Model<2> leaving = two_discs();
  leaving.analysis.remove_leaving_particles = true;
  leaving.analysis.nsteps = 200;
  leaving.particles.velocity.assign(static_cast<std::size_t>(leaving.particles.size()), {3, 1});
  Simulation whole(leaving, serial());
  whole.advance(60);
  const Index removed = whole.info().removed;
  CHECK(removed > 0);
  CHECK(removed < leaving.particles.size());
  check_restart(leaving, 60, 90);
  Model<2> few = leaving;
  few.analysis.most_lost = few.particles.size();  // the graph drains when one leaves
  check_restart(few, 60, 90);
  whole.advance(140);
  CHECK(whole.info().particles == 0);
  check_restart(leaving, 199, 200, {flow(2)});
}

TEST_CASE("restart: bodies in contact") {
  for (const Scheme scheme : {Scheme::usf, Scheme::usl, Scheme::musl}) {
    Model<2> discs = in_contact(two_discs());
    discs.analysis.scheme = scheme;
    check_restart(discs, 20, 34);
  }
}

TEST_CASE("restart after restart, at every step, leaves no trace") {
  Model<2> model = dam_break();
  model.analysis.scheme = Scheme::musl;
  model.analysis.step = {.adaptive = true, .dt = 1.0, .safety = 0.5};
  Simulation reference(model, serial());
  reference.advance(40);
  StoredState state(Simulation(model, serial()).state());
  for (int k = 0; k < 40; ++k) {
    Simulation next(model, k % 2 ? serial() : flow(2), {}, state.view());
    next.advance(1);
    state = StoredState(next.state());
  }
  CHECK(difference(state, StoredState(reference.state())) == "");
}

TEST_CASE("an adaptive run that ended at its last step or its end time can be made longer") {
  Model<2> model = two_discs();
  model.analysis.step = {.adaptive = true, .dt = 1.0, .safety = 0.3};
  model.analysis.nsteps = 20;
  Simulation first(model, serial());
  first.run();
  const StoredState state(first.state());
  model.analysis.nsteps = 40;
  Simulation longer(model, serial(), {}, state.view()), whole(model, serial());
  longer.run();
  whole.run();
  CHECK(difference(StoredState(longer.state()), StoredState(whole.state())) == "");

  model.analysis.end_time = longer.time();
  Simulation over(model, serial(), {}, StoredState(longer.state()).view());
  CHECK(over.finished());
  model.analysis.nsteps = 1000;
  model.analysis.end_time = longer.time() + 0.01;
  Simulation more(model, serial(), {}, StoredState(longer.state()).view());
  CHECK_FALSE(more.finished());
  more.run();
  CHECK(more.time() == doctest::Approx(model.analysis.end_time).epsilon(1e-12));
}

TEST_CASE("a checkpoint that is due or asked for gets the state of its step and changes no bit") {
  for (const ExecutionOptions& way : {serial(), flow(3)}) {
    Model<2> model = dam_break();
    model.output.checkpoint_steps = 15;
    std::vector<StoredState> states;
    Index asked = 0;
    Observer observer;
    observer.checkpoint = [&](const SimulationState& state) { states.emplace_back(state); };
    observer.checkpoint_wanted = [&] { return ++asked == 38; };  // after step 38
    Simulation simulation(model, way, observer);
    simulation.advance(60);
    CAPTURE(describe(way));
    REQUIRE(states.size() == 5);
    std::vector<Index> steps;
    for (const StoredState& state : states) {
      steps.push_back(state.run.step);
      Simulation alone(model, serial());
      alone.advance(state.run.step);
      CHECK(difference(state, StoredState(alone.state())) == "");
    }
    CHECK(steps[0] == 15);
    CHECK(steps[1] == 30);
    CHECK(steps[2] > 37);
    CHECK(steps[2] <= 45);
    CHECK(steps.back() == 60);
  }
}

TEST_CASE("states that tasks copy while steps are taken are those of a drained graph") {
  const auto check = [](Model<2> model, bool are_copied) {
    model.output.checkpoint_steps = 7;
    constexpr Index end = 40;
    std::vector<StoredState> drained;
    Simulation reference(model, serial());
    for (Index step = 7; step <= end; step += 7) {
      reference.advance(7);
      drained.emplace_back(reference.state());
    }
    for (ExecutionOptions way : {serial(), random_order(5), flow(3), flow(2)}) {
      CAPTURE(describe(way));
      const bool has_room = way.threads != 2;
      if (!has_room) way.staging_bytes = 0;
      std::vector<StoredState> states;
      Simulation* own = nullptr;
      int copies = 0;
      Observer observer;
      observer.checkpoint = [&](const SimulationState& state) {
        // Where the graph has drained, as for new patches, there is no need for a copy.
        CHECK(state.copied == (own->step() < state.run.step));
        copies += state.copied;
        states.emplace_back(state);
      };
      Simulation simulation(model, way, observer);
      own = &simulation;
      simulation.advance(end);
      CHECK((copies > 0) == (are_copied && has_room));
      REQUIRE(states.size() == drained.size());
      for (std::size_t k = 0; k < states.size(); ++k)
        CHECK(difference(states[k], drained[k]) == "");
    }
  };
  for (const Scheme scheme : schemes)
    for (const bool adaptive : {false, true}) {
      Model<2> discs = two_discs();
      discs.analysis.scheme = scheme;
      discs.output.history_steps = 5;
      if (adaptive) discs.analysis.step = {.adaptive = true, .dt = 1.0, .safety = 0.3};
      CAPTURE(static_cast<int>(scheme));
      CAPTURE(adaptive);
      check(discs, true);
      check(in_contact(discs), true);
      if (!adaptive) check(with_absorbing(discs), true);
      Model<2> filled = jet(scheme == Scheme::usf   ? "usf"
                            : scheme == Scheme::usl ? "usl"
                                                    : "musl",
                            adaptive);
      check(filled, false);  // particles may leave
      filled.analysis.remove_leaving_particles = false;
      check(filled, true);
    }
  Model<2> leaving = two_discs();
  leaving.analysis.remove_leaving_particles = true;
  check(leaving, false);
}

TEST_CASE("states are copied until injected particles have outgrown the memory for that") {
  constexpr std::size_t staging = 10'000;
  Model<2> model = jet("usl", false);
  model.analysis.remove_leaving_particles = false;
  model.analysis.patch_particles = 100'000;  // one patch, so that none are created on the way
  model.output.checkpoint_steps = 2;
  for (ExecutionOptions way : {serial(), flow(2)}) {
    CAPTURE(describe(way));
    way.staging_bytes = staging;
    std::vector<bool> copied;
    Observer observer;
    observer.checkpoint = [&](const SimulationState& state) {
      const auto bytes = static_cast<std::size_t>(
          std::accumulate(state.sizes.begin(), state.sizes.end(), Index{0}));
      // The graph drains when it has outgrown that, and may be some steps late with that.
      if (state.copied) CHECK(bytes < staging + staging / 2);
      copied.push_back(state.copied);
    };
    Simulation(model, way, observer).advance(61);
    REQUIRE(copied.size() == 30);
    CHECK(std::count(copied.begin(), copied.end(), true) > 3);
    CHECK_FALSE(copied.back());
  }
}

TEST_CASE("a patch's state refuses what it is not") {
  Model<2> model = two_discs();
  Simulation simulation(model, serial());
  const SimulationState state = simulation.state();
  const std::vector<std::byte> good = state.bytes(0);
  const auto message = [&](std::vector<std::byte> bytes) {
    StoredState stored(state);
    stored.bytes[0] = std::move(bytes);
    try {
      Simulation other(model, serial(), {}, stored.view());
    } catch (const IoError& error) {
      return std::string(error.what());
    }
    return std::string("no error");
  };
  const auto changed = [&](std::size_t number, Index value) {
    std::vector<std::byte> bytes = good;
    std::memcpy(bytes.data() + number * sizeof(Index), &value, sizeof value);
    return message(bytes);
  };
  CHECK(message(good) == "no error");
  CHECK(message({}).find("0 bytes only") != std::string::npos);
  CHECK(message({good.begin(), good.end() - 1}).find("bytes instead of") != std::string::npos);
  CHECK(changed(0, 1).find("another version") != std::string::npos);
  CHECK(changed(1, 3).find("number of dimensions is 3 there, 2 here") != std::string::npos);
  CHECK(changed(2, 1'000'000).find("the patch is 1000000 there") != std::string::npos);
  CHECK(changed(6, 1).find("run ") != std::string::npos);
  CHECK(changed(7, -5).find("-5 is not a number of anything") != std::string::npos);
  // The cell of the first run, behind the head of 15 numbers and the five of work.
  CHECK(changed(20, 1'000'000).find("run 0 is not one") != std::string::npos);
  CHECK(message(state.bytes(1)).find("the patch is") != std::string::npos);
}

TEST_CASE("an adaptive run ends at the same step wherever the graph drains before") {
  Model<2> model = two_discs();
  model.analysis.step = {.adaptive = true, .dt = 1.0, .safety = 0.3};
  model.analysis.nsteps = 100000;
  model.analysis.end_time = 0.2;
  Simulation undisturbed(model, serial());
  undisturbed.run();
  const Index last = undisturbed.step();
  REQUIRE(last > 5);
  for (const ExecutionOptions& way : {serial(), flow(2)})
    for (const Index before : {1, 2, 3}) {
      model.output.checkpoint_steps = last - before;
      Observer observer;
      observer.checkpoint = [](const SimulationState&) {};
      Simulation simulation(model, way, observer);
      simulation.run();
      CHECK(simulation.step() == last);
      CHECK(same_bits(simulation.frame(), undisturbed.frame()));
    }
}
