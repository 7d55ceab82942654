/// \file The whole state of a simulation between two steps.
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "io/checkpoint_header.h"

namespace lahar {

/// What a simulation goes on from, bit by bit: its numbers, and the patches that have a state
/// (runtime/patch_state.h) as bytes. Patches that are not named are as new.
struct SimulationState {
  RunState run;
  std::vector<Index> patches;  ///< ids, ascending; of several ranks, those of this one
  std::size_t size = 0;        ///< [bytes] of all these
  /// The state of patches[i]. Any thread.
  std::function<std::vector<std::byte>(std::size_t i)> bytes;
};

}  // namespace lahar
