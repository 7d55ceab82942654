#include "runtime/frame_assembler.h"

#include "runtime/snapshot.h"

namespace lahar {

FrameAssembler::FrameAssembler(std::function<void(Frame&&)> consumer)
    : consumer_(std::move(consumer)), thread_([this] { loop(); }) {}

FrameAssembler::~FrameAssembler() {
  {
    const std::scoped_lock lock(mutex_);
    stop_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void FrameAssembler::rethrow() {
  if (failure_) std::rethrow_exception(failure_);
}

void FrameAssembler::add(std::vector<Frame> pieces) {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return queue_.size() < max_queued || failure_; });
  rethrow();
  queue_.push_back(std::move(pieces));
  changed_.notify_all();
}

void FrameAssembler::drain() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return (queue_.empty() && !busy_) || failure_; });
  rethrow();
}

void FrameAssembler::loop() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [&] { return !queue_.empty() || stop_; });
    if (queue_.empty()) return;
    std::vector<Frame> pieces = std::move(queue_.front());
    queue_.pop_front();
    busy_ = true;
    lock.unlock();
    try {
      if (!failure_) consumer_(merge(std::move(pieces)));
    } catch (...) {
      lock.lock();
      failure_ = std::current_exception();
      lock.unlock();
    }
    lock.lock();
    busy_ = false;
    changed_.notify_all();
  }
}

}  // namespace lahar
