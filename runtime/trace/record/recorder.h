/// \file Records what tasks, messages and threads do, for later analysis.
#pragma once

#include <atomic>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "runtime/base/stage_clock.h"
#include "runtime/trace/record/record.h"

namespace lahar {

/// Writes the trace file of one rank. Each thread fills a buffer of its own, which is appended to
/// the file when it is full: what a run records is bounded by the disk, not by memory.
class TraceRecorder {
 public:
  /// `head` and the other texts are JSON (runtime/trace/analyse/log.h says what is in them). Throws
  /// IoError.
  TraceRecorder(std::filesystem::path file, TraceWindow window, const std::string& head);
  ~TraceRecorder();
  TraceRecorder(const TraceRecorder&) = delete;
  TraceRecorder& operator=(const TraceRecorder&) = delete;

  bool has(Step step) const { return window_.has(step); }

  /// Any thread. The record's thread is set here, and returned: the number of a thread that has
  /// ended is given again.
  std::uint16_t add(TraceRecord record);

  /// Patches are others from now on; while no step is taken.
  void add_graph(const std::string& graph);
  /// After the last record; throws IoError where the file could not be written.
  void finish(const std::string& tail);

  std::int64_t records() const { return records_; }  ///< in the file so far

  /// The recorder of this process's run, or null: one atomic load. Whoever has something to record
  /// asks for it.
  static TraceRecorder* active() { return active_.load(std::memory_order_acquire); }
  /// The step that comes after all that are finished, for what belongs to no step; by one thread at
  /// a time.
  void set_present(Step step) { present_.store(step, std::memory_order_relaxed); }
  Step present() const { return present_.load(std::memory_order_relaxed); }

  /// Set while steps are taken and what they gave is written.
  static void activate(TraceRecorder* recorder) { active_ = recorder; }
  /// That of the present step, or null: for what solvers do before it.
  static TraceRecorder* of_present() {
    TraceRecorder* recorder = active();
    return recorder && recorder->has(recorder->present()) ? recorder : nullptr;
  }
  /// That of a step, or null where it is not recorded.
  static TraceRecorder* active(Step step) {
    TraceRecorder* recorder = active();
    return recorder && recorder->has(step) ? recorder : nullptr;
  }

 private:
  struct Buffer;
  Buffer& own_buffer();
  std::shared_ptr<Buffer> free_buffer();  ///< under the lock
  void write(TraceSection::Kind kind, const void* data, std::size_t bytes);
  void flush(Buffer& buffer);

  static inline std::atomic<TraceRecorder*> active_{nullptr};
  std::atomic<Step> present_{0};

  std::filesystem::path path_;
  TraceWindow window_;
  std::uint64_t number_;  ///< of all recorders of the process
  std::FILE* file_ = nullptr;
  bool failed_ = false;
  std::int64_t records_ = 0;
  std::mutex mutex_;  ///< of the file and of buffers_
  std::vector<std::shared_ptr<Buffer>>
      buffers_;  ///< shared with their threads, which may outlive it
};

/// Records what is done during its life.
class TraceSpan {
 public:
  TraceSpan(TraceKind kind, Step step)
      : TraceSpan({.step = step, .kind = kind}, TraceRecorder::active(step)) {}
  /// Work for a step, done beside later ones: recorded where the present step is.
  static TraceSpan beside_steps(TraceKind kind, Step of) {
    return {{.step = of, .kind = kind}, TraceRecorder::of_present()};
  }
  /// Of a solver, before the present step; a loop (-1 = is not recorded) and a round of it.
  static TraceSpan of_solver(TraceKind kind, int loop = 0, Step round = -1) {
    TraceRecorder* const recorder = loop < 0 ? nullptr : TraceRecorder::of_present();
    return {{.step = recorder ? recorder->present() : 0,
             .round = static_cast<std::int32_t>(round),
             .loop = loop,
             .kind = kind},
            recorder};
  }
  ~TraceSpan() {
    if (!recorder_) return;
    record_.end = ticks();
    recorder_->add(record_);
  }
  void set_ready(std::uint64_t tick) { record_.ready = tick; }
  TraceSpan(const TraceSpan&) = delete;
  TraceSpan& operator=(const TraceSpan&) = delete;

 private:
  TraceSpan(const TraceRecord& record, TraceRecorder* recorder)
      : recorder_(recorder), record_(record) {
    if (recorder_) record_.begin = ticks();
  }

  TraceRecorder* recorder_;
  TraceRecord record_;
};

}  // namespace lahar
