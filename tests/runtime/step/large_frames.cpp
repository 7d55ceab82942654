// Frames that are too large to be copied: the same frames, and the same run.
#include <doctest/doctest.h>

#include <set>

#include "physics/base/error.h"
#include "runtime/step/simulation.h"
#include "tests/runtime/step/models.h"

using namespace lahar;
using namespace lahar::test;

namespace {

template <int Dim>
Outcome run_with_large_frames(const Model<Dim>& model, ExecutionOptions options) {
  options.staging_bytes = 0;
  Outcome outcome;
  Observer observer;
  observer.frame = [](FramePieces&&) { FAIL("a large frame was copied"); };
  observer.large_frame = [&](const FrameSource& frame) { outcome.frames.push_back(join(frame)); };
  observer.history = [&](const HistoryRow& row) { outcome.rows.push_back(row); };
  observer.removed = [&](std::span<const RemovedParticle> particles) {
    for (const RemovedParticle& particle : particles)
      outcome.removed_rows += removed_line(particle);
  };
  Simulation simulation(model, options, observer);
  try {
    simulation.run();
  } catch (const SimulationError& error) {
    outcome.error = error.what();
  }
  outcome.frames.push_back(simulation.frame());
  outcome.rows.push_back(simulation.history());
  outcome.removed = simulation.info().removed;
  return outcome;
}

template <int Dim>
void check(Model<Dim> model, Index frame_steps) {
  model.output.frame_steps = frame_steps;
  const Outcome copied = run(model, serial());
  CHECK(copied.frames.size() > 4);
  for (const ExecutionOptions& way : {serial(), flow(1), flow(3), random_order(1)}) {
    CAPTURE(describe(way));
    CHECK(same_bits(run_with_large_frames(model, way), copied));
  }
}

}  // namespace

TEST_CASE("large frames hold the same as copied ones, and waiting for them changes no bit") {
  for (const bool adaptive : {false, true}) {
    Model<2> discs = two_discs();
    discs.analysis.patch_particles = 16;
    discs.analysis.nsteps = 50;
    if (adaptive) discs.analysis.step = {.adaptive = true, .dt = 1.0, .safety = 0.3};
    check(discs, 7);
    check(discs, 1);  // also where patches could be several frames ahead
  }
  check(dam_break_3d(), 12);
}

TEST_CASE("large frames hold the particles that are left, and all of a run that failed") {
  Model<2> model = two_discs();
  model.analysis.patch_particles = 16;
  for (auto& v : model.particles.velocity) v *= 2;
  model.watchdog.action = Watchdog::Action::none;
  model.analysis.nsteps = 1000;
  model.output.frame_steps = 10;
  const Outcome failed = run_with_large_frames(model, flow(3));
  CHECK(failed.error == run(model, serial()).error);
  CHECK(failed.error.find("left the mesh") != std::string::npos);
  const Frame& last = failed.frames.back();
  CHECK(std::set<Index>(last.id.begin(), last.id.end()).size() ==
        static_cast<std::size_t>(model.particles.size()));
  CHECK(last.size() == model.particles.size());

  model.analysis.remove_leaving_particles = true;
  model.analysis.nsteps = 400;
  const Outcome reference = run(model, serial());
  CHECK(reference.removed > 0);
  CHECK(reference.frames.back().size() > 0);
  CHECK(same_bits(run_with_large_frames(model, flow(3)), reference));
}
