#include "runtime/output/frame_output.h"

#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <optional>
#include <utility>

#include "io/run/run_folder.h"
#include "physics/base/error.h"
#include "runtime/base/parallel.h"
#include "runtime/trace/record/recorder.h"

namespace lahar {

namespace {

/// Particles that a thread copies at a time where a frame is written from where they are: the copy
/// stays in a second-level cache (four times as many, and a frame takes twice as long), and each
/// column is still enough for a system call.
constexpr Index particles_per_write = 1 << 13;
/// And where they are sent to a rank that writes: fewer messages count for more.
constexpr Index particles_per_relay = 1 << 15;

/// How long to sleep between two looks at what other ranks say.
constexpr std::chrono::microseconds poll_interval{100};

}  // namespace

FrameOutput::FrameOutput(std::filesystem::path folder, const Communicator& ranks,
                         std::vector<TimedFile> earlier, int writers)
    : folder_(std::move(folder)),
      writer_pid_(ranks.max(ranks.rank() == 0 ? Index{::getpid()} : Index{0})),
      agreement_(ranks),
      relay_(ranks, writers),
      index_(std::move(earlier)),
      thread_([this] { loop(); }) {}

FrameOutput::~FrameOutput() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

std::filesystem::path FrameOutput::target(Index step) const {
  return folder_ / frame_name(step, ".hdf");
}

std::filesystem::path FrameOutput::temporary(Index step) const {
  return part_file(target(step), writer_pid_);
}

// --- for the computation ----------------------------------------------------------------------

void FrameOutput::add(FramePieces frame) {
  std::unique_lock lock(mutex_);
  wait_until(lock, [this] { return queue_.size() < slots || failure_; });
  if (failure_) std::rethrow_exception(failure_);
  Job job;
  job.size = frame.size();
  job.frame = std::move(frame);
  push(std::move(job));
}

void FrameOutput::write(const FrameSource& frame) {
  std::unique_lock lock(mutex_);
  if (failure_) std::rethrow_exception(failure_);
  Job own;
  own.source = &frame;
  own.size = frame.size();
  own.frame.header = frame.header;
  push(std::move(own));
  const auto is_ready = [&] {
    return !queue_.empty() && queue_.front().source == &frame &&
           queue_.front().stage == Stage::writing;
  };
  wait_until(lock, [&] { return failure_ || is_ready(); });
  if (failure_) std::rethrow_exception(failure_);
  Job& job = queue_.front();
  lock.unlock();
  try {
    if (job.layout.total == job.total) write_pieces(job);
  } catch (...) {
    job.failure = std::current_exception();
  }
  lock.lock();
  job.source = nullptr;
  changed_.notify_all();
}

void FrameOutput::write_pieces(const Job& job) {
  const FrameSource& frame = *job.source;
  struct Part {
    std::size_t begin, end;
    Index first;
  };
  std::vector<Part> parts;
  const Index most = relay_.writes() ? particles_per_write : particles_per_relay;
  Index first = job.first;
  for (std::size_t begin = 0, end = 0; begin < frame.sizes.size(); begin = end) {
    Index n = 0;
    while (end < frame.sizes.size() && (end == begin || n + frame.sizes[end] <= most))
      n += frame.sizes[end++];
    parts.push_back({begin, end, first});
    first += n;
  }
  const auto pieces_of = [&](const Part& part) {
    std::vector<Frame> pieces;
    for (std::size_t k = part.begin; k < part.end; ++k) pieces.push_back(frame.piece(k));
    return pieces;
  };
  const auto polls = [this] { poll(); };
  if (!relay_.writes()) {
    for (const Part& part : parts)
      write_slab(job.layout, part.first, pieces_of(part),
                 [&](Index place, auto bytes) { relay_.give(place, bytes, polls); });
    return relay_.end(polls);
  }
  write_and_take(frame.header.step, false, polls, [&](const SlabFile& file) {
    parallel_for(frame.threads, static_cast<int>(parts.size()), [&](int i) {
      const TraceSpan trace = TraceSpan::beside_steps(TraceKind::frame, frame.header.step);
      const Part& part = parts[static_cast<std::size_t>(i)];
      file.write(job.layout, part.first, pieces_of(part));
    });
  });
}

void FrameOutput::write_and_take(Index step, bool sync, const FrameRelay::Wait& wait,
                                 const std::function<void(const SlabFile&)>& write) {
  std::optional<SlabFile> file;
  std::exception_ptr failure;
  try {
    file.emplace(temporary(step), target(step));
    write(*file);
  } catch (...) {  // others cannot go on before what they have is taken from them
    failure = std::current_exception();
  }
  relay_.take_all(
      [&](Index place, std::span<const std::byte> bytes) {
        if (!failure) file->write(place, bytes);
      },
      wait);
  if (failure) std::rethrow_exception(failure);
  if (sync) file->sync();
}

void FrameOutput::progress() {
  const std::lock_guard lock(mutex_);
  if (released_) return;
  relay_.progress();
  advance();
}

void FrameOutput::finish() {
  std::unique_lock lock(mutex_);
  if (!failure_ && !released_) {
    Job job;
    job.last = true;
    push(std::move(job));
    wait_until(lock, [this] { return queue_.empty() || failure_; });
  }
  if (!std::exchange(released_, true)) {
    agreement_.release();
    relay_.release();
  }
  if (failure_) std::rethrow_exception(failure_);
}

void FrameOutput::wait_for_named() {
  std::unique_lock lock(mutex_);
  const Index all = handed_;
  changed_.wait(lock, [&] { return ended_ >= all || (given_up_ && agreement_.several()); });
  if (failure_) std::rethrow_exception(failure_);
  if (late_failure_) std::rethrow_exception(late_failure_);
  if (ended_ < all) throw IoError("the run ended before its frames were written");
}

void FrameOutput::give_up() {
  {
    const std::lock_guard lock(mutex_);
    given_up_ = true;
  }
  changed_.notify_all();
}

void FrameOutput::push(Job job) {
  if (!job.last) ++handed_;
  queue_.push_back(std::move(job));
  if (!agreement_.several()) advance();
  changed_.notify_all();
}

void FrameOutput::wait_until(std::unique_lock<std::mutex>& lock,
                             const std::function<bool()>& condition) {
  while (!condition()) {
    if (!agreement_.several()) {
      changed_.wait(lock);
      continue;
    }
    lock.unlock();
    poll();
    lock.lock();
    if (!condition()) changed_.wait_for(lock, poll_interval);
  }
}

void FrameOutput::poll() {
  if (poll_)
    poll_();
  else
    progress();
}

// --- what ranks tell each other ---------------------------------------------------------------

void FrameOutput::advance() {
  bool moved = false;
  while (!queue_.empty() && advance_front()) moved = true;
  if (moved) changed_.notify_all();  // not at every look: the thread would wake for nothing
}

/// True if the frame reached its next stage.
bool FrameOutput::advance_front() {
  Job& job = queue_.front();
  switch (job.stage) {
    case Stage::waiting:
      agreement_.start_counting(job.size, late_failure_ != nullptr);
      job.stage = Stage::counting;
      return true;
    case Stage::counting:
      if (!agreement_.done()) return false;
      end_counting(job);
      return true;
    case Stage::laying_out:
      if (agreement_.rank() == 0 && !job.worked) return false;
      agreement_.start_telling(job.layout);
      job.stage = Stage::telling;
      return true;
    case Stage::telling:
      if (!agreement_.done()) return false;
      job.layout = agreement_.layout();
      job.worked = false;
      job.stage = Stage::writing;
      return true;
    case Stage::writing:
      if (!job.worked) return false;
      agreement_.start_reporting(job.failure != nullptr);
      job.stage = Stage::reporting;
      return true;
    case Stage::reporting:
      if (!agreement_.done()) return false;
      end_reporting(job);
      return true;
    case Stage::naming:
      if (agreement_.rank() == 0 && !job.worked) return false;
      late_failure_ = job.failure;
      named_step_ = job.frame.header.step;
      ++ended_;
      queue_.pop_front();
      return true;
  }
  return false;
}

void FrameOutput::end_counting(Job& job) {
  if (const auto rank = agreement_.failed_rank()) return fail(*rank, named_step_, late_failure_);
  if (job.last) return queue_.pop_front();
  job.first = agreement_.before();
  job.total = agreement_.total();
  job.stage = Stage::laying_out;
}

void FrameOutput::end_reporting(Job& job) {
  if (const auto rank = agreement_.failed_rank())
    return fail(*rank, job.frame.header.step, job.failure);
  job.worked = false;
  job.stage = Stage::naming;
}

/// All ranks come here with the same frame.
void FrameOutput::fail(int rank, Index step, std::exception_ptr own) {
  failure_ = own ? std::move(own)
                 : std::make_exception_ptr(IoError(
                       fmt::format("cannot write {}: rank {} failed, whose message says why",
                                   target(step).string(), rank)));
  queue_.clear();
  ended_ = handed_;
}

// --- file work ----------------------------------------------------------------------------------

bool FrameOutput::has_work() const {
  if (queue_.empty() || queue_.front().worked) return false;
  const Stage stage = queue_.front().stage;
  return (stage == Stage::writing && queue_.front().source == nullptr) ||
         (agreement_.rank() == 0 && (stage == Stage::laying_out || stage == Stage::naming));
}

void FrameOutput::loop() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return has_work() || stopping_; });
    if (!has_work() || (stopping_ && agreement_.several())) return;
    Job& job = queue_.front();  // deque: stays in place while others are added
    lock.unlock();
    work(job);
    lock.lock();
    job.worked = true;
    if (!agreement_.several()) advance();
    changed_.notify_all();
  }
}

void FrameOutput::work(Job& job) {
  if (job.failure) return;
  const TraceSpan trace = TraceSpan::beside_steps(TraceKind::frame, job.frame.header.step);
  try {
    if (job.stage == Stage::laying_out) lay_out(job);
    if (job.stage == Stage::writing) write_own(job);
    if (job.stage == Stage::naming) name(job);
  } catch (...) {
    job.failure = std::current_exception();
  }
}

void FrameOutput::lay_out(Job& job) const {
  const FrameHeader& header = job.frame.header;
  job.file = std::make_unique<AtomicFile>(target(header.step));
  job.layout = lay_out_frame(header, job.total, job.file->temporary(), job.file->target());
}

void FrameOutput::write_own(Job& job) {
  if (job.layout.total != job.total) return;  // rank 0 failed, and says so
  const auto rests = [this] { rest(); };
  const auto give = [&](Index place, auto bytes) { relay_.give(place, bytes, rests); };
  if (!relay_.writes()) {
    write_slab(job.layout, job.first, job.frame.pieces, give);
    job.frame.release();
    return relay_.end(rests);
  }
  write_and_take(job.frame.header.step, true, rests, [&](const SlabFile& file) {
    file.write(job.layout, job.first, job.frame.pieces);
    job.frame.release();
  });
}

void FrameOutput::rest() {
  {
    const std::lock_guard lock(mutex_);
    if (stopping_) throw IoError("the run ended before its frames were written");
  }
  std::this_thread::sleep_for(poll_interval);
}

void FrameOutput::name(Job& job) {
  job.file->commit(check_);
  const FrameHeader& header = job.frame.header;
  const std::string name = job.file->target().filename().string();
  // A frame of the same step replaces the earlier one, in the index too.
  std::erase_if(index_, [&](const TimedFile& file) { return file.name == name; });
  index_.push_back({header.time, name});
  write_series(index_, folder_ / "particles.hdf.series");
}

}  // namespace lahar
