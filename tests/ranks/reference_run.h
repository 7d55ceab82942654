/// \file What runs on several ranks are compared with.
#pragma once

#include <doctest/doctest.h>

#include <exception>
#include <string>

#include "tests/ranks/checkpoint_bytes.h"
#include "tests/ranks/shared_folder.h"

namespace lahar::test {

/// Bytes of checkpoints of one rank and one thread, halfway and at the end; in the folder "one".
template <int Dim>
struct Reference {
  Reference(const Model<Dim>& model, Index steps, const SharedFolder& folder,
            const Communicator& ranks) {
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
  }
  std::string middle, end;
};

}  // namespace lahar::test
