#include "runtime/output/output_writer.h"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <string_view>
#include <vector>

#include "physics/base/error.h"

namespace lahar {

namespace {

/// How long to sleep between two looks at what other ranks say.
constexpr std::chrono::microseconds poll_interval{100};

}  // namespace

OutputWriter::OutputWriter(const Communicator& ranks, Options options)
    : options_(options),
      writer_pid_(ranks.max(ranks.rank() == 0 ? Index{::getpid()} : Index{0})),
      agreement_(ranks),
      relay_(agreement_.ranks(), options.writers),
      thread_([this] { loop(); }) {}

OutputWriter::~OutputWriter() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  thread_.join();
  // A rank that ends by an error ends alone, and MPI may still work on what it gave.
  if (queue_.empty() && std::uncaught_exceptions() == 0) agreement_.release();
}

// --- for the computation ------------------------------------------------------------------------

void OutputWriter::write(std::unique_ptr<OutputJob> job) {
  std::unique_lock lock(mutex_);
  wait_until(lock, [this] { return queue_.size() < options_.slots || failure_; });
  throw_failure();
  const OutputJob* own = job.get();
  const OutputJob::About about = job->about();
  Entry entry;
  entry.job = std::move(job);
  if (about.prepare_now) {
    lock.unlock();
    attempt(entry, [&] { entry.told = entry.job->prepare(); });
    lock.lock();
    throw_failure();
    entry.worked = true;
  }
  queue_.push_back(std::move(entry));
  ++handed_;
  if (!agreement_.ranks().several()) advance();
  changed_.notify_all();
  if (about.write_now) write_now(lock, own);
}

void OutputWriter::write_now(std::unique_lock<std::mutex>& lock, const OutputJob* job) {
  const auto is_ready = [&] {
    return !queue_.empty() && queue_.front().job.get() == job &&
           queue_.front().task == Task::write && !queue_.front().agreeing;
  };
  wait_until(lock, [&] { return failure_ || is_ready(); });
  throw_failure();
  Entry& entry = queue_.front();
  lock.unlock();
  attempt(entry, [&] { write_part(entry, [this] { poll(); }); });
  lock.lock();
  entry.written_now = true;
  changed_.notify_all();
}

bool OutputWriter::progress() {
  const std::lock_guard lock(mutex_);
  relay_.progress();
  advance();
  return queue_.empty();
}

void OutputWriter::finish() {
  std::unique_lock lock(mutex_);
  wait_until(lock, [this] { return queue_.empty() || failure_; });
  throw_failure();
}

void OutputWriter::wait_for_named() {
  std::unique_lock lock(mutex_);
  const Index all = handed_;
  const bool several = agreement_.ranks().several();
  changed_.wait(lock, [&] { return ended_ >= all || (given_up_ && several); });
  throw_failure();
  if (ended_ < all) throw IoError("the run ended before its files were written");
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

// --- one task after the other -------------------------------------------------------------------

void OutputWriter::advance() {
  bool moved = false;
  while (!queue_.empty() && advance_front()) moved = true;
  if (moved) changed_.notify_all();  // not at every look: the thread would wake for nothing
}

/// True if something happened.
bool OutputWriter::advance_front() {
  Entry& entry = queue_.front();
  if (!entry.agreeing) {
    if (is_own(entry.task) && !entry.worked) return false;
    agreement_.start(std::move(entry.told), entry.failure != nullptr);
    return entry.agreeing = true;
  }
  if (!agreement_.done()) return false;
  if (const auto rank = agreement_.failed_rank())
    fail(entry, *rank);
  else
    begin_next_task(entry);
  return true;
}

void OutputWriter::begin_next_task(Entry& entry) {
  switch (entry.task) {
    case Task::prepare:
      entry.job->hear_parts(agreement_.all(), agreement_.ranks().rank());
      entry.task = Task::create;
      break;
    case Task::create:
      entry.job->hear_layout(agreement_.of(0));
      entry.task = Task::write;
      break;
    case Task::write:
      entry.task = Task::name;
      break;
    case Task::name:
      ++ended_;
      return queue_.pop_front();
  }
  entry.told.clear();
  entry.worked = entry.agreeing = false;
}

/// All ranks come here with the same file.
void OutputWriter::fail(const Entry& entry, int rank) {
  failure_ = entry.failure;
  if (!failure_) {
    const std::vector<char> reason = values_of<char>(agreement_.of(rank));
    failure_ = std::make_exception_ptr(
        IoError(entry.job->blame(entry.task, rank, {reason.begin(), reason.end()})));
  }
  queue_.clear();
  ended_ = handed_;
}

// --- file work ----------------------------------------------------------------------------------

bool OutputWriter::is_own(Task task) const {
  return task == Task::prepare || task == Task::write || agreement_.ranks().rank() == 0;
}

bool OutputWriter::has_work() const {
  if (queue_.empty()) return false;
  const Entry& entry = queue_.front();
  if (entry.worked || entry.agreeing || !is_own(entry.task)) return false;
  return entry.task != Task::write || entry.written_now == entry.job->about().write_now;
}

void OutputWriter::loop() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return has_work() || stopping_; });
    const bool several = agreement_.ranks().several();
    if (!has_work() || (stopping_ && several)) return;
    Entry& entry = queue_.front();  // deque: stays in place while others are added
    lock.unlock();
    if (!entry.failure) attempt(entry, [&] { work(entry); });
    lock.lock();
    entry.worked = true;
    if (!several) advance();
    changed_.notify_all();
  }
}

/// What a part throws is told when all ranks are asked.
void OutputWriter::attempt(Entry& entry, const std::function<void()>& part) {
  try {
    part();
  } catch (const std::exception& error) {
    entry.failure = std::current_exception();
    entry.told = bytes_of(std::span<const char>(std::string_view(error.what())));
  }
}

void OutputWriter::work(Entry& entry) {
  OutputJob& job = *entry.job;
  const TraceSpan trace = TraceSpan::beside_steps(job.about().kind, job.about().step);
  switch (entry.task) {
    case Task::prepare:
      entry.told = job.prepare();
      return;
    case Task::create:
      entry.file = std::make_unique<AtomicFile>(job.about().target);
      entry.told = job.create(*entry.file);
      return;
    case Task::write:
      if (!entry.written_now) write_part(entry, [this] { rest(); });
      if (entry.part) entry.part->sync();
      return;
    case Task::name:
      return job.name(*entry.file);
  }
}

void OutputWriter::write_part(Entry& entry, const OutputRelay::Wait& wait) {
  const std::filesystem::path& target = entry.job->about().target;
  const bool writes = relay_.writes();
  std::exception_ptr failure;
  const ByteSink sink = [&](Index place, std::span<const std::byte> bytes) {
    if (writes)
      entry.part->write(place, bytes);
    else
      relay_.give(place, bytes, wait);
  };
  try {
    if (writes) entry.part = std::make_unique<SharedFile>(part_file(target, writer_pid_), target);
    entry.job->write(sink, writes);
  } catch (...) {  // others cannot go on before what they have is taken from them
    failure = std::current_exception();
  }
  const ByteSink take = [&](Index place, std::span<const std::byte> bytes) {
    if (!failure) entry.part->write(place, bytes);
  };
  relay_.end(take, wait);
  if (failure) std::rethrow_exception(failure);
}

/// Sleeps; throws when nobody will call progress() any more.
void OutputWriter::rest() {
  {
    const std::lock_guard lock(mutex_);
    if (stopping_) throw IoError("the run ended before its files were written");
  }
  std::this_thread::sleep_for(poll_interval);
}

}  // namespace lahar
