/// \file Files that all ranks write together, behind the computation.
///
///     prepare -> create -> write -> name
///
/// is what happens to a file (OutputJob), one file after the other. Every rank prepares its part;
/// all learn what the others have; rank 0 makes the file and tells where its parts lie; every rank
/// writes its part; rank 0 gives the complete file its name. After each task all ranks agree
/// (OutputAgreement) that it was done. File work is done by a thread of each rank that never calls
/// MPI; agreements go on in progress(), and nobody waits for them. Where fewer ranks write than
/// there are, the others send them what they have (OutputRelay).
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

/// All ranks give the same jobs in the same order, and each holds its own object. A file is
/// complete or absent: it is written under another name and brought to the disk by every rank.
///
/// What goes wrong on one rank is an error on all of them, at the next write() or finish() after
/// they have heard of it. The file is then removed, and those that wait are not written.
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
  /// at once (OutputJob::About), for which all ranks must be in this call, on all threads that the
  /// job takes. Bringing it to the disk is left for later.
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
  /// That of all ranks, if it was not thrown or is not forgotten.
  std::exception_ptr failure();

 private:
  using Task = OutputJob::Task;
  /// A job and how far it is.
  struct Entry {
    std::unique_ptr<OutputJob> job;
    Task task = Task::prepare;
    bool worked = false;               ///< this rank did its part of the task
    bool agreeing = false;             ///< ranks tell each other about the task
    bool written_now = false;          ///< the caller of write() has written the part
    std::unique_ptr<AtomicFile> file;  ///< rank 0
    std::unique_ptr<SharedFile> part;
    OutputJob::Bytes told;       ///< what the task gave; where it failed, why
    std::exception_ptr failure;  ///< of this rank
  };

  // Under the lock.
  void wait_until(std::unique_lock<std::mutex>& lock, const std::function<bool()>& condition);
  void write_now(std::unique_lock<std::mutex>& lock, const OutputJob* job);
  void advance();
  bool advance_front();
  void begin_next_task(Entry& entry);
  void fail(const Entry& entry, int rank);
  void throw_failure();
  bool is_own(Task task) const;
  bool has_work() const;

  // Without the lock.
  void loop();
  static void attempt(Entry& entry, const std::function<void()>& part);
  void work(Entry& entry);
  void write_part(Entry& entry, const OutputRelay::Wait& wait);
  void rest();
  void poll();

  Options options_;
  Index writer_pid_;  ///< of rank 0, part of temporary names
  OutputAgreement agreement_;
  OutputRelay relay_;
  std::function<void()> poll_;

  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Entry> queue_;       // the front one is being written
  Index handed_ = 0, ended_ = 0;  ///< files
  std::exception_ptr failure_;    ///< known to all ranks
  bool stopping_ = false, given_up_ = false;
  std::thread thread_;
};

}  // namespace lahar
