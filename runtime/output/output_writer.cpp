#include "runtime/output/output_writer.h"

#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "physics/base/error.h"

namespace lahar {

namespace {

/// How long to sleep between two looks at what other ranks say.
constexpr std::chrono::microseconds poll_interval{100};

constexpr const char* ended_before = "the run ended before its files were written";

}  // namespace

OutputWriter::OutputWriter(const Communicator& ranks, Options options)
    : options_(options),
      writer_pid_(ranks.max(ranks.rank() == 0 ? Index{::getpid()} : Index{0})),
      agreement_(ranks),
      relay_(agreement_.ranks(), options.writers),
      thread_([this] { loop(); }) {}

OutputWriter::~OutputWriter() {
  bool idle = false;
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
    idle = queue_.empty();
  }
  changed_.notify_all();
  thread_.join();
  // A rank that ends by an error ends alone, and MPI may still work on what it gave.
  if (idle && std::uncaught_exceptions() == 0) agreement_.release();
}

// --- for the computation ------------------------------------------------------------------------

void OutputWriter::write(std::unique_ptr<OutputJob> job) {
  const OutputJob::About about = job->about();
  std::unique_lock lock(mutex_);
  wait_until(lock, [this] { return queue_.size() < options_.slots || failure_; });
  throw_failure();
  Entry own;
  own.job = std::move(job);
  if (about.prepare_now) {
    lock.unlock();
    attempt(own, [&] { own.told = own.job->prepare(); });
    lock.lock();
    throw_failure();
  }
  queue_.push_back(std::move(own));
  ++handed_;
  changed_.notify_all();
  if (!about.write_now) return;
  wait_until(lock, [this] { return for_caller_ != nullptr || failure_; });
  throw_failure();
  Entry& entry = *for_caller_;
  lock.unlock();
  write_part(entry, [this] { poll(); });
  lock.lock();
  for_caller_ = nullptr;
  changed_.notify_all();
}

bool OutputWriter::progress() {
  const std::lock_guard lock(mutex_);
  relay_.progress();
  if (agreement_.progress()) changed_.notify_all();
  return queue_.empty();
}

void OutputWriter::finish() {
  std::unique_lock lock(mutex_);
  wait_until(lock, [this] { return queue_.empty(); });
  throw_failure();
}

void OutputWriter::wait_for_named() {
  std::unique_lock lock(mutex_);
  const Index all = handed_;
  const bool several = agreement_.ranks().several();
  changed_.wait(lock, [&] { return ended_ >= all || (given_up_ && several); });
  throw_failure();
  if (ended_ < all) throw IoError(ended_before);
}

void OutputWriter::give_up() {
  {
    const std::lock_guard lock(mutex_);
    given_up_ = true;
  }
  changed_.notify_all();
}

std::exception_ptr OutputWriter::failure() {
  const std::lock_guard lock(mutex_);
  return failure_;
}

void OutputWriter::throw_failure() {
  if (!failure_) return;
  const std::exception_ptr failure = failure_;
  if (options_.forgets_failures) failure_ = nullptr;
  std::rethrow_exception(failure);
}

void OutputWriter::wait_until(std::unique_lock<std::mutex>& lock,
                              const std::function<bool()>& condition) {
  while (!condition()) {
    if (!agreement_.ranks().several()) {
      changed_.wait(lock);
      continue;
    }
    lock.unlock();
    poll();
    lock.lock();
    if (!condition()) changed_.wait_for(lock, poll_interval);
  }
}

void OutputWriter::poll() {
  if (poll_)
    poll_();
  else
    progress();
}

// --- the thread ---------------------------------------------------------------------------------

void OutputWriter::loop() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return !queue_.empty() || stopping_; });
    if (queue_.empty() || (stopping_ && agreement_.ranks().several())) return;
    Entry& entry = queue_.front();  // deque: stays in place while others are added
    lock.unlock();
    std::exception_ptr failure;
    try {
      write_file(entry);
    } catch (...) {
      failure = std::current_exception();
    }
    lock.lock();
    if (failure) {  // on all ranks, of the same file
      failure_ = failure;
      queue_.clear();
      ended_ = handed_;
    } else {
      queue_.pop_front();
      ++ended_;
    }
    changed_.notify_all();
  }
}

/// Throws on all ranks where one fails.
void OutputWriter::write_file(Entry& entry) {
  OutputJob& job = *entry.job;
  const int rank = agreement_.ranks().rank();
  std::optional<AtomicFile> file;  // of rank 0

  if (!job.about().prepare_now) work(entry, [&] { entry.told = job.prepare(); });
  agree(entry);
  job.hear_parts(agreement_.all(), rank);

  if (rank == 0)
    work(entry, [&] {
      file.emplace(job.about().target);
      entry.told = job.create(*file);
    });
  agree(entry);
  job.hear_layout(agreement_.of(0));

  if (job.about().write_now) let_caller_write(entry);
  work(entry, [&] {
    if (!job.about().write_now) write_part(entry, [this] { pause(); });
    if (entry.part && !entry.failure) entry.part->sync();
  });
  agree(entry);

  if (rank == 0) work(entry, [&] { job.name(*file); });
  agree(entry);
}

void OutputWriter::work(Entry& entry, const std::function<void()>& task) {
  const TraceSpan trace = TraceSpan::beside_steps(entry.job->about().kind, entry.job->about().step);
  if (!entry.failure) attempt(entry, task);
}

/// What a task throws is told when all ranks are asked.
void OutputWriter::attempt(Entry& entry, const std::function<void()>& task) {
  try {
    task();
  } catch (const std::exception& error) {
    entry.failure = std::current_exception();
    entry.told = bytes_of(std::span<const char>(std::string_view(error.what())));
  }
}

/// Wait until all ranks have done a task.
void OutputWriter::agree(Entry& entry) {
  {
    std::unique_lock lock(mutex_);
    agreement_.start(std::exchange(entry.told, {}), entry.failure != nullptr);
    changed_.wait(lock, [this] { return agreement_.done() || stopping_; });
    if (!agreement_.done()) throw IoError(ended_before);
  }
  if (entry.failure && !agreement_.ranks().several()) std::rethrow_exception(entry.failure);
  if (const auto rank = agreement_.failed_rank()) {
    const std::vector<char> told = values_of<char>(agreement_.of(*rank));
    const std::string reason(told.begin(), told.end()), file = entry.job->about().target.string();
    throw IoError(reason.find(file) != reason.npos
                      ? fmt::format("rank {}: {}", *rank, reason)
                      : fmt::format("rank {}: cannot write {}: {}", *rank, file, reason));
  }
}

void OutputWriter::let_caller_write(Entry& entry) {
  std::unique_lock lock(mutex_);
  for_caller_ = &entry;
  changed_.notify_all();
  changed_.wait(lock, [this] { return for_caller_ == nullptr || stopping_; });
  if (for_caller_ != nullptr) throw IoError(ended_before);
}

/// The part of this rank, and of those that it writes for.
void OutputWriter::write_part(Entry& entry, const OutputRelay::Wait& wait) {
  const std::filesystem::path& target = entry.job->about().target;
  const bool writes = relay_.writes();
  attempt(entry, [&] {
    if (writes) entry.part = std::make_unique<SharedFile>(part_file(target, writer_pid_), target);
    const auto put = [&](Index place, std::span<const std::byte> bytes) {
      if (writes)
        entry.part->write(place, bytes);
      else
        relay_.give(place, bytes, wait);
    };
    entry.job->write(put, writes);
  });
  // Others cannot go on before what they have is taken from them.
  const auto take = [&](Index place, std::span<const std::byte> bytes) {
    if (!entry.failure) attempt(entry, [&] { entry.part->write(place, bytes); });
  };
  attempt(entry, [&] { relay_.end(take, wait); });
}

/// Sleep between two looks. Throws when the calls of progress() have ended.
void OutputWriter::pause() {
  {
    const std::lock_guard lock(mutex_);
    if (stopping_) throw IoError(ended_before);
  }
  std::this_thread::sleep_for(poll_interval);
}

}  // namespace lahar
