/// \file Checkpoints that are written behind the computation, by all ranks into one file.
#pragma once

#include <atomic>
#include <exception>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "io/base/atomic_file.h"
#include "io/base/shared_file.h"
#include "io/run/checkpoint.h"
#include "runtime/comm/communicator.h"
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
  /// Several ranks: called again and again by whoever waits here, in place of progress(), which it
  /// has to call.
  std::function<void()> while_waiting = {};
};

/// Writes FOLDER/checkpoint_STEP.h5. A checkpoint is complete or absent: it is written under
/// another name, brought to the disk by every rank, and gets its name when all are done. What
/// happens to it, one after the other:
///
///     packing -> placing -> creating -> telling -> writing -> reporting -> completing
///
/// Every rank packs its patches; all learn where each has its place; rank 0 makes the file and
/// tells the others; every rank writes, and reports; rank 0 gives the file its name. File work is
/// done by a thread that never calls MPI; what ranks tell each other goes on in progress().
///
/// What goes wrong on one rank is an IoError on all: of progress(), which makes them hear of it,
/// and of the next call of write() or finish().
class CheckpointWriter {
 public:
  /// Collective.
  explicit CheckpointWriter(CheckpointOptions options, const Communicator& ranks = {});
  ~CheckpointWriter();  ///< waits for the thread; errors are lost, so call finish() first
  CheckpointWriter(const CheckpointWriter&) = delete;
  CheckpointWriter& operator=(const CheckpointWriter&) = delete;

  /// Begin a checkpoint; waits for the one before. By all ranks, in the same order; a state that is
  /// not a copy (SimulationState::copied) is only needed during the call, which all ranks make
  /// while no step is taken. The header counts on rank 0.
  void write(const CheckpointHeader& header, SimulationState state);
  /// Take the next thing that can be done without waiting; to be called again and again, in turn
  /// with all other calls of MPI. True: nothing is under way.
  bool progress();
  /// Wait until nothing is under way. Collective.
  void finish();

  /// Step of the last checkpoint that write() was called for; -1 = none.
  Index last_step() const { return last_step_; }

 private:
  enum class Phase {
    idle,
    packing,
    counting,
    placing,
    creating,
    telling,
    handing,  ///< write() hands a state to the system that is not copied
    writing,
    reporting,
    completing
  };
  struct Slab {
    CheckpointPatch patch;
    std::vector<std::byte> bytes;  ///< empty: packed again when it is written
  };
  struct Count {
    Index patches, failed;
  };
  struct News {
    Index begin;  ///< of the patches' states in the file; -1 = there is none
    char reason[504];
  };
  /// What MPI works on while an operation is under way.
  struct Memory {
    Count own{};
    std::vector<Count> counts;
    std::vector<CheckpointPatch> own_patches, all;
    std::vector<int> bytes, first;  ///< of `all`, by rank
    News news{};
    int failed = 0;
  };

  // Without the lock: by the thread, or by write() while there is none.
  void pack(const SimulationState& state);
  void place();
  void create();
  void open_and_write();
  void write_large(const SimulationState& state);
  void complete();
  void attempt(const std::function<void()>& work);

  // Under the lock.
  void write_alone(SimulationState state);
  void advance();
  void start(Phase phase, std::function<void()> work);
  bool operation_is_done();
  void start_counting();
  void start_placing();
  void start_telling();
  void start_reporting();
  void follow_news();
  void fail(const std::string& reason);
  void forget();
  std::exception_ptr take_failure();

  bool is_in(Phase phase);
  void wait_until(const std::function<bool()>& is_done);

  CheckpointOptions options_;
  Communicator ranks_;
  Index writer_pid_;  ///< of rank 0, part of the temporary name
  Index last_step_ = -1;

  std::mutex mutex_;
  Phase phase_ = Phase::idle;
  CheckpointHeader header_;
  std::filesystem::path target_;
  std::optional<AtomicFile> file_;  ///< rank 0's
  std::unique_ptr<SharedFile> slab_file_;
  std::vector<Slab> slabs_;
  bool copied_ = false;  ///< slabs_ hold all bytes
  std::unique_ptr<Memory> memory_;
  std::exception_ptr failure_;  ///< of this rank, in the checkpoint under way
  std::exception_ptr failed_;   ///< of the last one, not yet told by write() or finish()
  MPI_Request request_ = MPI_REQUEST_NULL;
  std::atomic<bool> thread_done_{false};
  std::thread thread_;
};

}  // namespace lahar
