/// \file The checkpoints of a run.
#pragma once

#include <exception>
#include <filesystem>
#include <functional>

#include "io/run/checkpoint.h"
#include "runtime/output/output_writer.h"
#include "runtime/patches/simulation_state.h"

namespace lahar {

struct CheckpointOptions {
  std::filesystem::path folder;
  Index kept = 2;   ///< older ones are removed when a new one is complete
  int threads = 0;  ///< that pack; 0 = all
  /// States at rest up to this size [bytes], of each rank, are copied and written in the
  /// background. For larger ones there is no memory to spare: they are handed to the system patch
  /// by patch while the computation waits, and only go to the disk in the background.
  std::size_t staging_bytes = default_staging_bytes;
  /// Brings to the disk what an undisturbed run has written before the checkpoint (RunFolder::
  /// sync()); called on rank 0 by the background thread before the checkpoint gets its name.
  std::function<void()> before_complete = {};
  /// Called there when all is on the disk, immediately before that: where it throws, the checkpoint
  /// gets no name.
  std::function<void()> before_naming = {};
  /// OutputWriter::while_waiting().
  std::function<void()> while_waiting = {};
};

/// Writes FOLDER/checkpoint_STEP.h5, one at a time, as OutputWriter does. After one that failed
/// the next may succeed.
class CheckpointWriter {
 public:
  /// Collective.
  explicit CheckpointWriter(CheckpointOptions options, const Communicator& ranks = {});

  /// Begin a checkpoint; waits for the one before. By all ranks, in the same order; a state that is
  /// not a copy (SimulationState::copied) is only needed during the call, which all ranks make
  /// while no step is taken. The header counts on rank 0.
  void write(const CheckpointHeader& header, SimulationState state);
  /// OutputWriter::progress(); throws what went wrong as soon as this rank hears of it, once.
  bool progress();
  /// Wait until nothing is under way. Collective.
  void finish() { writer_.finish(); }

  /// Step of the last checkpoint that write() was called for; -1 = none.
  Index last_step() const { return last_step_; }

 private:
  CheckpointOptions options_;
  Index last_step_ = -1;
  std::exception_ptr thrown_;  ///< by progress()
  OutputWriter writer_;        // the last member: its thread uses the others
};

}  // namespace lahar
