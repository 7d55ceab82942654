/// \file The whole state of a simulation between two steps.
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "io/run/checkpoint_header.h"

namespace lahar {

/// [bytes] for copies of frames and states, unless the user says otherwise.
inline constexpr std::size_t default_staging_bytes = std::size_t{64} << 20;

/// How a simulation begins with a state.
enum class StateUse {
  go_on,      ///< with the next step of the same run
  alike,      ///< with step 0 of another run, which does the same to the particles
  other_run,  ///< with step 0 of another run, whose columns, loads and scheme may be others
};

/// What a simulation goes on from, bit by bit: its numbers, and the patches that have a state
/// (runtime/patches/patch_state.h) as bytes. Patches that are not named are as new.
struct SimulationState {
  RunState run;
  /// Ids, ascending. A simulation of several ranks gives those of each rank, and goes on from those
  /// of all.
  std::vector<Index> patches;
  std::vector<Index> sizes;  ///< [bytes] of each
  /// The state of patches[i]. Any thread.
  std::function<std::vector<std::byte>(std::size_t i)> bytes;
  /// The states lie in memory of their own: good for as long as `bytes` is, which gives each once.
  bool copied = false;
  StateUse use = StateUse::go_on;
};

}  // namespace lahar
