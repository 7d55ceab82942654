#include "io/frame_writer.h"

#include <utility>

#include "io/atomic_file.h"
#include "io/run_folder.h"
#include "io/series.h"

namespace lahar {

FrameWriter::FrameWriter(std::filesystem::path folder, FrameFileOptions options,
                         std::vector<TimedFile> earlier)
    : folder_(std::move(folder)),
      options_(options),
      index_(std::move(earlier)),
      thread_([this] { work(); }) {}

FrameWriter::~FrameWriter() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void FrameWriter::write(Frame&& frame) {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return failure_ || queue_.size() < slots; });
  if (failure_) std::rethrow_exception(failure_);
  queue_.push_back(std::move(frame));
  ++handed_;
  changed_.notify_all();
}

void FrameWriter::write(const FrameStream& frame) {
  finish();
  write_now(frame);
}

void FrameWriter::finish() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this, all = handed_] { return failure_ || written_ >= all; });
  if (failure_) std::rethrow_exception(failure_);
}

void FrameWriter::work() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return ending_ || !queue_.empty(); });
    if (queue_.empty()) return;
    const Frame& frame = queue_.front();  // deque: stays in place while others are added
    lock.unlock();
    std::exception_ptr failure;
    try {
      check_consistent(frame);
      write_now(stream_of(frame));
    } catch (...) {
      failure = std::current_exception();
    }
    lock.lock();
    queue_.pop_front();
    ++written_;
    if (failure) {
      failure_ = failure;
      queue_.clear();
    }
    changed_.notify_all();
  }
}

void FrameWriter::write_now(const FrameStream& frame) {
  const std::string name = frame_name(frame.header.step, ".hdf");
  write_frame(frame, folder_ / name, options_);
  // A frame of the same step replaces the earlier one, in the index too.
  std::erase_if(index_, [&](const TimedFile& file) { return file.name == name; });
  index_.push_back({frame.header.time, name});
  write_series(index_, folder_ / "particles.hdf.series");
}

}  // namespace lahar
