/// \file A thread that puts the pieces of a frame together and hands it on, behind the computation.
#pragma once

#include <condition_variable>
#include <deque>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

#include "io/frame.h"

namespace lahar {

class FrameAssembler {
 public:
  explicit FrameAssembler(std::function<void(Frame&&)> consumer);
  ~FrameAssembler();

  /// Queue the pieces of one frame; waits while `max_queued` frames are waiting. Throws what the
  /// consumer threw for an earlier frame.
  void add(std::vector<Frame> pieces);
  /// Wait until everything is handed on. Throws what the consumer threw.
  void drain();

 private:
  /// Frames in memory at a time, besides the one being written.
  static constexpr std::size_t max_queued = 2;
  void loop();
  void rethrow();

  std::function<void(Frame&&)> consumer_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::vector<Frame>> queue_;
  bool busy_ = false, stop_ = false;
  std::exception_ptr failure_;
  std::thread thread_;
};

}  // namespace lahar
