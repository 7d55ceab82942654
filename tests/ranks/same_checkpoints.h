/// \file Runs whose steps begin with solves, on all ranks, with threads, and over a restart.
#pragma once

#include <doctest/doctest.h>

#include <string>

#include "runtime/step/restart.h"
#include "tests/ranks/reference_run.h"
#include "tests/runtime/step/models.h"

namespace lahar::test {

/// Checkpoints in the middle and at the end of so many steps have the bytes of those that one rank
/// with one thread writes.
inline void check_same_checkpoints(const Model<2>& model, Index steps) {
  const Communicator ranks = Communicator::world();
  const SharedFolder folder(ranks);
  const Reference<2> reference(model, steps, folder, ranks);
  const CheckpointReader reader(folder.path / "one" / checkpoint_name(steps / 2));
  for (const int threads : {1, 2, 4}) {
    CAPTURE(threads);
    const auto own = folder.path / std::to_string(threads);
    const ExecutionOptions way{.threads = threads, .ranks = ranks};
    Simulation simulation(model, way);
    simulation.advance(steps / 2);
    CHECK(checkpoint_of(simulation, ranks, own) == reference.middle);
    simulation.advance(steps - steps / 2);
    CHECK(checkpoint_of(simulation, ranks, own) == reference.end);
    Simulation resumed(model, way, {}, state_in(reader));
    resumed.advance(steps - steps / 2);
    CHECK(checkpoint_of(resumed, ranks, folder.path / ("on" + std::to_string(threads))) ==
          reference.end);
  }
}

}  // namespace lahar::test
