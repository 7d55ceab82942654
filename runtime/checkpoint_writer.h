/// \file Checkpoints that are written behind the computation, by all ranks into one file.
#pragma once

#include <atomic>
#include <exception>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <thread>
#include <vector>

#include "io/atomic_file.h"
#include "io/checkpoint.h"
#include "io/shared_file.h"
#include "runtime/ranks.h"
#include "runtime/simulation_state.h"

namespace lahar {

struct CheckpointOptions {
  std::filesystem::path folder;
  Index kept = 2;   ///< older ones are removed when a new one is complete
  int threads = 0;  ///< that pack; 0 = all
  /// States up to this size [bytes], of each rank, are copied and written in the background. For
  /// larger ones there is no memory to spare: they are handed to the system patch by patch while
  /// the computation waits, and only go to the disk in the background.
  std::size_t copied_bytes = std::size_t{64} << 20;
  /// Brings to the disk what an undisturbed run has written before the checkpoint (RunFolder::
  /// sync()); called on rank 0 by the background thread before the checkpoint gets its name.
  std::function<void()> before_complete = {};
  /// Called again and again by finish() while it waits: for what before_complete may need.
  std::function<void()> while_waiting = {};
};

/// Writes FOLDER/checkpoint_STEP.h5. A checkpoint is complete or absent: it is written under
/// another name, brought to the disk by every rank, and gets its name when all are done. The
/// background thread never calls MPI. Members throw IoError of the checkpoint under way, on all
/// ranks where one of them could not write its part.
class CheckpointWriter {
 public:
  /// Collective.
  explicit CheckpointWriter(CheckpointOptions options, const Ranks& ranks = {});
  ~CheckpointWriter();  ///< waits for the thread; errors are lost, so call finish() first
  CheckpointWriter(const CheckpointWriter&) = delete;
  CheckpointWriter& operator=(const CheckpointWriter&) = delete;

  /// Begin a checkpoint; waits for the one before. Collective, between steps. The header counts on
  /// rank 0.
  void write(const CheckpointHeader& header, const SimulationState& state);
  /// Take the next thing that can be done without waiting; to be called again and again, where this
  /// thread may call MPI. True: nothing is under way.
  bool progress();
  /// Wait until nothing is under way. Collective.
  void finish();

  /// Step of the last checkpoint that write() was called for; -1 = none.
  Index last_step() const { return last_step_; }

 private:
  enum class Phase { idle, writing, agreeing, completing };
  struct Slab {
    CheckpointPatch patch;
    std::vector<std::byte> bytes;  ///< empty: packed again when it is written
  };

  std::vector<Slab> pack_all(const SimulationState& state) const;
  std::vector<CheckpointPatch> lay_out_all(std::vector<Slab>& slabs) const;
  Index create(const CheckpointHeader& header, const std::vector<CheckpointPatch>& all);
  void write_large(const SimulationState& state, const std::vector<Slab>& slabs);
  void start(std::function<void()> work);
  void agreed(bool all_written);
  void complete();
  void forget();

  CheckpointOptions options_;
  Ranks ranks_;
  Index last_step_ = -1;
  Phase phase_ = Phase::idle;
  std::filesystem::path target_;
  std::optional<AtomicFile> file_;  ///< rank 0's
  std::unique_ptr<SharedFile> slab_file_;
  Index data_ = 0;  ///< where the patches' states begin in the file
  std::exception_ptr failure_;
  int failed_ = 0;  ///< of any rank, in the making
  MPI_Request request_ = MPI_REQUEST_NULL;
  std::atomic<bool> thread_done_{false};
  std::thread thread_;
};

}  // namespace lahar
