/// \file The checkpoints of one run: when they are due, what they say about it, who writes them.
#pragma once

#include <chrono>
#include <optional>

#include "runtime/output/checkpoint_writer.h"

namespace lahar {

class RunCheckpoints {
 public:
  /// `header` says everything but RunState. Collective.
  RunCheckpoints(CheckpointHeader header, double minutes, CheckpointOptions options,
                 const Communicator& ranks);

  /// Whether one is due by wall time, or was asked for by a signal. Stays true until write().
  bool wanted();
  /// Begin one, unless the last one is of this very step.
  void write(const SimulationState& state);
  bool progress() { return writer_.progress(); }
  void finish() { writer_.finish(); }
  /// The last one is that of this step; it need not be written again.
  void is_at(Index step) { last_ = step; }

 private:
  using Clock = std::chrono::steady_clock;
  CheckpointHeader header_;
  Clock::duration interval_;  ///< zero = none
  Clock::time_point due_;
  bool asked_ = false;
  Index last_ = -1;
  CheckpointWriter writer_;
};

}  // namespace lahar
