#include "runtime/output/checkpoint_writer.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <limits>
#include <numeric>
#include <string>
#include <system_error>
#include <utility>

#include "physics/base/error.h"
#include "runtime/base/parallel.h"
#include "runtime/trace/record/recorder.h"

namespace lahar {

CheckpointWriter::CheckpointWriter(CheckpointOptions options, const Communicator& ranks)
    : options_(std::move(options)),
      ranks_(ranks.duplicate()),
      writer_pid_(ranks.max(ranks.rank() == 0 ? Index{::getpid()} : Index{0})),
      memory_(std::make_unique<Memory>()) {}

CheckpointWriter::~CheckpointWriter() {
  if (thread_.joinable()) thread_.join();
  // A rank that ends by an error ends alone, and MPI may still work on what it gave.
  if (phase_ == Phase::idle && std::uncaught_exceptions() == 0)
    ranks_.release();
  else if (request_ != MPI_REQUEST_NULL)
    static_cast<void>(memory_.release());
}

void CheckpointWriter::write(const CheckpointHeader& header, SimulationState state) {
  wait_until([this] { return is_in(Phase::idle); });
  if (const auto failure = take_failure()) std::rethrow_exception(failure);
  last_step_ = header.run.step;
  target_ = options_.folder / checkpoint_name(last_step_);
  header_ = header;
  slabs_ = std::vector<Slab>(state.patches.size());
  const Index size = std::accumulate(state.sizes.begin(), state.sizes.end(), Index{0});
  const bool is_copy = state.copied;
  copied_ = is_copy || static_cast<std::size_t>(size) <= options_.staging_bytes;
  if (!is_copy) attempt([&] { pack(state); });
  {
    const std::lock_guard lock(mutex_);
    if (!ranks_.several()) return write_alone(std::move(state));
    if (is_copy)
      start(Phase::packing, [this, state = std::move(state)] { pack(state); });
    else
      start(Phase::packing, [] {});
  }
  if (copied_) return;
  wait_until([this] { return is_in(Phase::handing) || is_in(Phase::idle); });
  if (is_in(Phase::idle)) return;
  attempt([&] { write_large(state); });
  const std::lock_guard lock(mutex_);
  start(Phase::writing, [this] {
    if (!failure_) slab_file_->sync();
  });
}

/// One rank needs nobody's news.
void CheckpointWriter::write_alone(SimulationState state) {
  const auto begin = [this] {
    place();
    create();
    if (memory_->news.begin < 0) throw IoError(memory_->news.reason);
  };
  if (copied_) {
    start(Phase::completing, [this, begin, state = std::move(state)] {
      if (failure_) return;
      if (state.copied) pack(state);
      begin();
      open_and_write();
      complete();
    });
    return;
  }
  attempt([&] {
    if (failure_) return;
    begin();
    write_large(state);
  });
  start(Phase::completing, [this] {
    if (failure_) return;
    slab_file_->sync();
    complete();
  });
}

// --- by the thread, or while there is none -------------------------------------------------------

/// Checksums of all patches; their bytes too where they are copied.
void CheckpointWriter::pack(const SimulationState& state) {
  const auto pack_one = [&](int k) {
    const auto i = static_cast<std::size_t>(k);
    std::vector<std::byte> bytes = state.bytes(i);
    slabs_[i].patch = {.id = state.patches[i],
                       .offset = 0,
                       .bytes = static_cast<Index>(bytes.size()),
                       .checksum = checksum(bytes)};
    if (copied_) slabs_[i].bytes = std::move(bytes);
  };
  const int n = static_cast<int>(slabs_.size());
  if (!state.copied) return parallel_for(options_.threads, n, pack_one);
  for (int k = 0; k < n; ++k) pack_one(k);  // the other cores compute
}

/// Places of the patches of all ranks, which this rank's get to know.
void CheckpointWriter::place() {
  std::vector<CheckpointPatch>& all = memory_->all;
  if (!ranks_.several()) {
    all.clear();
    for (const Slab& slab : slabs_) all.push_back(slab.patch);
  }
  lay_out(all);
  for (Slab& slab : slabs_)
    slab.patch =
        *std::lower_bound(all.begin(), all.end(), slab.patch.id,
                          [](const CheckpointPatch& patch, Index id) { return patch.id < id; });
}

/// Rank 0 makes the file. What goes wrong there is news for all.
void CheckpointWriter::create() {
  News& news = memory_->news;
  news = {.begin = -1, .reason = {}};
  try {
    make_folder_in_place(options_.folder);
    file_.emplace(target_);
    news.begin = create_checkpoint(file_->temporary(), target_, header_, memory_->all);
  } catch (const std::exception& error) {  // whatever it is, others wait for the news
    file_.reset();
    std::strncpy(news.reason, error.what(), sizeof news.reason - 1);
  }
}

void CheckpointWriter::open_and_write() {
  slab_file_ = std::make_unique<SharedFile>(part_file(target_, writer_pid_), target_);
  for (const Slab& slab : slabs_)
    slab_file_->write(memory_->news.begin + slab.patch.offset, slab.bytes);
  slab_file_->sync();
}

/// Hand a state to the system for which there is no copy: it is packed once more.
void CheckpointWriter::write_large(const SimulationState& state) {
  slab_file_ = std::make_unique<SharedFile>(part_file(target_, writer_pid_), target_);
  for (std::size_t i = 0; i < slabs_.size(); ++i)
    slab_file_->write(memory_->news.begin + slabs_[i].patch.offset, state.bytes(i));
}

void CheckpointWriter::complete() {
  if (options_.before_complete) options_.before_complete();
  file_->commit(options_.before_naming);
  prune_checkpoints(options_.folder, options_.kept);
}

/// What fails is told when all are asked.
void CheckpointWriter::attempt(const std::function<void()>& work) {
  try {
    work();
  } catch (...) {
    failure_ = std::current_exception();
  }
}

// --- one thing after the other -------------------------------------------------------------------

bool CheckpointWriter::progress() {
  const std::lock_guard lock(mutex_);
  const bool had_failed = failed_ != nullptr;
  advance();
  if (failed_ && !had_failed) std::rethrow_exception(failed_);
  return phase_ == Phase::idle;
}

void CheckpointWriter::advance() {
  for (;;) {
    switch (phase_) {
      case Phase::idle:
      case Phase::handing:
        return;
      case Phase::packing:
      case Phase::creating:
      case Phase::writing:
      case Phase::completing:
        if (!thread_done_) return;
        if (thread_.joinable()) thread_.join();
        break;
      case Phase::counting:
      case Phase::placing:
      case Phase::telling:
      case Phase::reporting:
        if (!operation_is_done()) return;
    }
    switch (phase_) {
      case Phase::packing:
        start_counting();
        break;
      case Phase::counting:
        start_placing();
        break;
      case Phase::placing:
        place();
        memory_->news = {.begin = -1, .reason = "nothing was begun"};
        if (ranks_.rank() == 0)
          start(Phase::creating, [this] { create(); });
        else
          start_telling();
        break;
      case Phase::creating:
        start_telling();
        break;
      case Phase::telling:
        follow_news();
        break;
      case Phase::writing:
        start_reporting();
        break;
      case Phase::reporting:
        if (memory_->failed != 0) return fail("another rank could not write its part");
        if (ranks_.rank() != 0) return forget();
        start(Phase::completing, [this] { complete(); });
        break;
      default:
        return forget();
    }
  }
}

void CheckpointWriter::start(Phase phase, std::function<void()> work) {
  phase_ = phase;
  thread_done_ = false;
  try {
    thread_ = std::thread([this, work = std::move(work)] {
      const TraceSpan trace = TraceSpan::beside_steps(TraceKind::checkpoint, last_step_);
      attempt(work);
      thread_done_ = true;
      thread_done_.notify_all();
    });
  } catch (
      const std::system_error& error) {  // no more threads: others hear of it as of any failure
    failure_ = std::make_exception_ptr(IoError(
        fmt::format("cannot write {}: no thread for it: {}", target_.string(), error.what())));
    thread_done_ = true;
  }
}

bool CheckpointWriter::operation_is_done() {
  int done = 0;
  MPI_Test(&request_, &done, MPI_STATUS_IGNORE);
  return done != 0;
}

void CheckpointWriter::start_counting() {
  memory_->own = {static_cast<Index>(slabs_.size()), failure_ ? 1 : 0};
  memory_->counts.resize(static_cast<std::size_t>(ranks_.size()));
  constexpr int words = sizeof(Count) / sizeof(Index);
  MPI_Iallgather(&memory_->own, words, MPI_INT64_T, memory_->counts.data(), words, MPI_INT64_T,
                 ranks_.communicator(), &request_);
  phase_ = Phase::counting;
}

void CheckpointWriter::start_placing() {
  Memory& memory = *memory_;
  if (std::any_of(memory.counts.begin(), memory.counts.end(),
                  [](const Count& count) { return count.failed != 0; }))
    return fail("another rank could not pack its part");
  memory.own_patches.clear();
  for (const Slab& slab : slabs_) memory.own_patches.push_back(slab.patch);
  memory.bytes.clear();
  memory.first.clear();
  constexpr Index size = sizeof(CheckpointPatch);
  Index all = 0;
  for (const Count& count : memory.counts) {
    memory.first.push_back(static_cast<int>(all * size));
    memory.bytes.push_back(static_cast<int>(count.patches * size));
    all += count.patches;
  }
  if (all * size > std::numeric_limits<int>::max()) return fail("there are too many patches");
  memory.all.resize(static_cast<std::size_t>(all));
  MPI_Iallgatherv(memory.own_patches.data(), memory.bytes[static_cast<std::size_t>(ranks_.rank())],
                  MPI_BYTE, memory.all.data(), memory.bytes.data(), memory.first.data(), MPI_BYTE,
                  ranks_.communicator(), &request_);
  phase_ = Phase::placing;
}

void CheckpointWriter::start_telling() {
  MPI_Ibcast(&memory_->news, sizeof(News), MPI_BYTE, 0, ranks_.communicator(), &request_);
  phase_ = Phase::telling;
}

void CheckpointWriter::follow_news() {
  if (memory_->news.begin < 0) {
    if (!failure_) failure_ = std::make_exception_ptr(IoError(memory_->news.reason));
    return forget();
  }
  if (copied_)
    start(Phase::writing, [this] { open_and_write(); });
  else
    phase_ = Phase::handing;
}

void CheckpointWriter::start_reporting() {
  memory_->failed = failure_ ? 1 : 0;
  MPI_Iallreduce(MPI_IN_PLACE, &memory_->failed, 1, MPI_INT, MPI_MAX, ranks_.communicator(),
                 &request_);
  phase_ = Phase::reporting;
}

/// On all ranks; those that have a reason of their own give that.
void CheckpointWriter::fail(const std::string& reason) {
  if (!failure_)
    failure_ = std::make_exception_ptr(
        IoError(fmt::format("cannot write {}: {}", target_.string(), reason)));
  forget();
}

/// Nothing is under way any more.
void CheckpointWriter::forget() {
  phase_ = Phase::idle;
  slab_file_.reset();
  file_.reset();  // not committed: removed
  slabs_.clear();
  failed_ = std::exchange(failure_, nullptr);
}

std::exception_ptr CheckpointWriter::take_failure() {
  const std::lock_guard lock(mutex_);
  return std::exchange(failed_, nullptr);
}

// --- waiting -------------------------------------------------------------------------------------

bool CheckpointWriter::is_in(Phase phase) {
  const std::lock_guard lock(mutex_);
  return phase_ == phase;
}

void CheckpointWriter::wait_until(const std::function<bool()>& is_done) {
  const auto go_on = [this] {
    const std::lock_guard lock(mutex_);
    advance();
  };
  while (!is_done()) {
    if (!ranks_.several()) {
      thread_done_.wait(false);
      go_on();
      continue;
    }
    if (options_.while_waiting)
      options_.while_waiting();
    else
      go_on();
    if (!is_done()) std::this_thread::sleep_for(std::chrono::microseconds(100));
  }
}

void CheckpointWriter::finish() {
  wait_until([this] { return is_in(Phase::idle); });
  const std::exception_ptr failure = take_failure();
  if (!ranks_.several()) {
    if (failure) std::rethrow_exception(failure);
    return;
  }
  // Rank 0 may still need others for what comes before a checkpoint, and it alone completes it.
  int any = failure != nullptr;
  MPI_Request request = MPI_REQUEST_NULL;
  MPI_Iallreduce(MPI_IN_PLACE, &any, 1, MPI_INT, MPI_MAX, ranks_.communicator(), &request);
  wait_until([&] {
    int done = 0;
    MPI_Test(&request, &done, MPI_STATUS_IGNORE);
    return done != 0;
  });
  if (failure) std::rethrow_exception(failure);
  if (any) throw IoError("another rank could not complete " + target_.string());
}

}  // namespace lahar
