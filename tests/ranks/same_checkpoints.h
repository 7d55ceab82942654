/// \file Runs whose steps begin with solves, on all ranks, with threads, and over a restart.
#pragma once

#include <doctest/doctest.h>

#include <string>

#include "runtime/step/restart.h"
#include "tests/ranks/checkpoint_bytes.h"
#include "tests/ranks/shared_folder.h"
#include "tests/runtime/step/models.h"

namespace lahar::test {

/// Checkpoints in the middle and at the end of so many steps have the bytes of those that one rank
/// with one thread writes.
inline void check_same_checkpoints(const Model<2>& model, Index steps) {
  const Communicator ranks = Communicator::world();
  const SharedFolder folder(ranks);
  std::string middle, end;
  if (ranks.rank() == 0) try {
      Simulation simulation(model, {.threads = 1});
      simulation.advance(steps / 2);
      middle = checkpoint_of(simulation, {}, folder.path / "one");
      simulation.advance(steps - steps / 2);
      end = checkpoint_of(simulation, {}, folder.path / "one");
    } catch (const std::exception& error) {  // others wait
      FAIL_CHECK(std::string(error.what()));
    }
  ranks.broadcast(middle);
  ranks.broadcast(end);
  const CheckpointReader reader(folder.path / "one" / checkpoint_name(steps / 2));
  for (const int threads : {1, 2, 4}) {
    CAPTURE(threads);
    const auto own = folder.path / std::to_string(threads);
    const ExecutionOptions way{.threads = threads, .ranks = ranks};
    Simulation simulation(model, way);
    simulation.advance(steps / 2);
    CHECK(checkpoint_of(simulation, ranks, own) == middle);
    simulation.advance(steps - steps / 2);
    CHECK(checkpoint_of(simulation, ranks, own) == end);
    Simulation resumed(model, way, {}, state_in(reader));
    resumed.advance(steps - steps / 2);
    CHECK(checkpoint_of(resumed, ranks, folder.path / ("on" + std::to_string(threads))) == end);
  }
}

}  // namespace lahar::test
