/// \file Files that all ranks write together, behind the computation.
#pragma once

#include <condition_variable>
#include <deque>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>
#include <utility>

#include "runtime/output/output_agreement.h"
#include "runtime/output/output_job.h"
#include "runtime/output/output_relay.h"

namespace lahar {

/// Writes one file (OutputJob) after the other. What happens to a file is in write_file(): every
/// rank prepares its part; rank 0 makes the file and tells where parts lie; every rank writes its
/// part; rank 0 gives the file its name. After each task all ranks agree that it was done. This is
/// the work of a thread of each rank, which never calls MPI; what ranks tell each other goes on in
/// progress(). Where fewer ranks write than there are, the others send them what they have.
///
/// All ranks give the same jobs in the same order, and each holds its own object. A file is
/// complete or absent: it has another name until it is on the disk. What goes wrong on one rank is
/// an error on all of them, at the next write() or finish() after they have heard of it. The file
/// is then removed, and those that wait are not written.
class OutputWriter {
 public:
  struct Options {
    std::size_t slots = 1;  ///< files that may wait or be written at a time (memory is bounded)
    int writers = 0;        ///< so many ranks write; 0 = all
    /// A failure is over when it was thrown; else nothing is written any more.
    bool forgets_failures = false;
  };

  OutputWriter(const Communicator& ranks, Options options);  ///< collective
  /// One rank: writes what waits; errors are lost, so call finish() first. Several: what is not
  /// written by then is not, because other ranks may be gone.
  ~OutputWriter();
  OutputWriter(const OutputWriter&) = delete;
  OutputWriter& operator=(const OutputWriter&) = delete;

  /// Hand a file over. Blocks while all slots are taken; then does what the job wants to have done
  /// at once (OutputJob::About). For that all ranks are in this call, and no step is taken.
  void write(std::unique_ptr<OutputJob> job);
  /// Go on with what ranks tell each other; returns at once. To be called often while steps are
  /// taken, in turn with all other calls of MPI. One rank: needs not be called. True: nothing is
  /// under way.
  bool progress();
  /// Wait until everything is written, and all ranks know. Collective.
  void finish();
  /// Wait until the files that were handed over by now have their names; throws if one never will.
  /// From a thread of its own, while others call progress().
  void wait_for_named();
  /// Nobody will call progress() any more: wait_for_named() throws IoError.
  void give_up();
  /// Where write() and finish() have to wait for other ranks, they call progress() again and again,
  /// or else this, which has to do so.
  void while_waiting(std::function<void()> poll) { poll_ = std::move(poll); }
  /// The same on all ranks; null if there is none, or it is forgotten.
  std::exception_ptr failure();

 private:
  struct Entry {
    std::unique_ptr<OutputJob> job;
    OutputJob::Bytes told;             ///< what the last task returned; where it failed, why
    std::exception_ptr failure;        ///< of this rank
    std::unique_ptr<SharedFile> part;  ///< where this rank writes
  };

  // By the thread.
  void loop();
  void write_file(Entry& entry);
  void work(Entry& entry, const std::function<void()>& task);
  void agree(Entry& entry);
  void let_caller_write(Entry& entry);
  void pause();
  void poll();
  // By the thread or by the caller of write().
  static void attempt(Entry& entry, const std::function<void()>& task);
  void write_part(Entry& entry, const OutputRelay::Wait& wait);
  // Under the lock.
  void wait_until(std::unique_lock<std::mutex>& lock, const std::function<bool()>& condition);
  void throw_failure();

  Options options_;
  Index writer_pid_;  ///< of rank 0, part of temporary names
  OutputAgreement agreement_;
  OutputRelay relay_;
  std::function<void()> poll_;

  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Entry> queue_;       // the front one is being written
  Entry* for_caller_ = nullptr;   ///< the front one while the caller of write() has to write it
  Index handed_ = 0, ended_ = 0;  ///< files
  std::exception_ptr failure_;    ///< known to all ranks
  bool stopping_ = false, given_up_ = false;
  std::thread thread_;
};

}  // namespace lahar
