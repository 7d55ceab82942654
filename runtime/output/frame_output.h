/// \file Frames written behind the computation, by all ranks together.
///
///     counting -> laying out -> telling -> writing -> reporting -> naming
///
/// is what happens to a frame, one frame after the other. In `counting` ranks learn which particles
/// of the file are theirs; rank 0 lays the file out and tells where its data lie; every rank writes
/// its particles, and reports; rank 0 gives the file its name and adds it to the index. File work
/// (laying out, writing, naming) is done by a thread of each rank that never calls MPI; what ranks
/// tell each other goes on in progress(), and nobody waits for it. Where fewer ranks write than
/// there are, the others send them what they have (runtime/output/frame_relay.h).
#pragma once

#include <condition_variable>
#include <deque>
#include <exception>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "io/base/atomic_file.h"
#include "io/base/series.h"
#include "io/frames/frame.h"
#include "io/frames/frame_slabs.h"
#include "runtime/comm/communicator.h"
#include "runtime/output/frame_agreement.h"
#include "runtime/output/frame_relay.h"

namespace lahar {

/// Writes frames to FOLDER/particles_STEP.hdf and lists them, with their times, in
/// FOLDER/particles.hdf.series, which ParaView opens. A frame appears when it is complete. All
/// ranks give the same frames in the same order, each with its own particles, and each holds its
/// own object; in a file, ranks follow each other.
///
/// What goes wrong on one rank is an IoError on all of them, at the next add(), write() or finish()
/// after they have heard of it; frames after the failing one are not written.
class FrameOutput {
 public:
  /// Frames that may wait or be written at a time (memory is bounded).
  static constexpr std::size_t slots = 2;

  /// Collective. The folder exists.
  /// `earlier`: frames that are in the folder and belong in the index. `writers`: so many ranks
  /// write; 0 = all.
  explicit FrameOutput(std::filesystem::path folder, const Communicator& ranks = {},
                       std::vector<TimedFile> earlier = {}, int writers = 0);
  /// One rank: writes what waits; errors are lost, so call finish() first. Several: what is not
  /// written by then is not, because other ranks may be gone.
  ~FrameOutput();

  /// Hand a frame over and return. Blocks while all slots are taken.
  void add(FramePieces frame);
  /// Write a frame from where its particles are, on all threads that it allows, when those before
  /// are written; only bringing it to the disk is left for later. Collective, for times at which no
  /// step is taken.
  void write(const FrameSource& frame);
  /// Go on with what ranks tell each other; returns at once. To be called often while steps are
  /// taken, in turn with all other calls of MPI. One rank: needs not be called.
  void progress();
  /// Wait until the frames that were handed over by now have their names; IoError if one never
  /// will. From a thread of its own, while others call progress().
  void wait_for_named();
  /// Nobody will call progress() any more: wait_for_named() throws IoError.
  void give_up();
  /// Wait until everything is written, and all ranks know. Collective, and the last call.
  void finish();
  /// Where add(), write() and finish() have to wait for other ranks, they call progress() again and
  /// again, or else this, which has to do so.
  void while_waiting(std::function<void()> poll) { poll_ = std::move(poll); }
  /// Called by a thread of rank 0 before a frame gets its name, which it does not where this
  /// throws.
  void before_naming(std::function<void()> check) { check_ = std::move(check); }

 private:
  enum class Stage { waiting, counting, laying_out, telling, writing, reporting, naming };
  struct Job {
    Stage stage = Stage::waiting;
    bool worked = false;  ///< the thread did its part of the stage
    bool last = false;    ///< no frame, but the agreement at the end
    FramePieces frame;
    const FrameSource* source = nullptr;  ///< of write(), until it has written the particles
    Index size = 0, first = 0, total = 0;
    FrameLayout layout{.total = -1};   ///< -1 where laying out failed
    std::unique_ptr<AtomicFile> file;  ///< rank 0
    std::exception_ptr failure;        ///< of this rank
  };

  // Under the lock.
  void wait_until(std::unique_lock<std::mutex>& lock, const std::function<bool()>& condition);
  void push(Job job);
  void advance();
  bool advance_front();
  void end_counting(Job& job);
  void end_reporting(Job& job);
  void fail(int rank, Index step, std::exception_ptr own);
  bool has_work() const;

  // By the thread, without the lock.
  void loop();
  void work(Job& job);
  void lay_out(Job& job) const;
  void write_own(Job& job);
  void name(Job& job);
  /// What this rank has, written by `write`, and what others give to it.
  void write_and_take(Index step, bool sync, const FrameRelay::Wait& wait,
                      const std::function<void(const SlabFile&)>& write);
  /// Sleeps; throws when nobody will call progress() any more.
  void rest();
  // By write(), without the lock.
  void write_pieces(const Job& job);
  void poll();

  std::filesystem::path target(Index step) const;
  std::filesystem::path temporary(Index step) const;

  std::filesystem::path folder_;
  Index writer_pid_;  ///< of rank 0, part of temporary names
  FrameAgreement agreement_;
  FrameRelay relay_;
  std::function<void()> poll_, check_;
  std::vector<TimedFile> index_;  // of the thread

  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Job> queue_;            // the front one is being written
  std::exception_ptr late_failure_;  ///< of this rank, after all have reported
  Index handed_ = 0, ended_ = 0;     ///< frames
  Index named_step_ = 0;             ///< of the frame that this may be about
  std::exception_ptr failure_;       ///< known to all ranks
  bool stopping_ = false, released_ = false, given_up_ = false;
  std::thread thread_;
};

}  // namespace lahar
