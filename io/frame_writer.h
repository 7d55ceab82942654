/// \file A thread that writes frames behind the computation.
#pragma once

#include <condition_variable>
#include <deque>
#include <exception>
#include <filesystem>
#include <mutex>
#include <thread>
#include <vector>

#include "io/frame.h"
#include "io/series.h"
#include "io/vtkhdf.h"

namespace lahar {

/// Writes frames to FOLDER/particles_STEP.hdf and lists them, with their times, in
/// FOLDER/particles.hdf.series, which ParaView opens. A frame appears when it is complete.
class FrameWriter {
 public:
  /// Frames that may wait or be written at a time; the next write() blocks (memory is bounded).
  static constexpr std::size_t slots = 2;

  /// `earlier` frames of the folder stay listed.
  explicit FrameWriter(std::filesystem::path folder, FrameFileOptions options = {},
                       std::vector<TimedFile> earlier = {});
  ~FrameWriter();  ///< writes what is queued; errors are lost, so call finish() first

  /// Hand a frame over and return. Blocks while all slots are taken. Throws the IoError of an
  /// earlier frame; all later frames are dropped then.
  void write(Frame&& frame);
  /// Write at once, in this thread, after those that wait. Throws as write() of a frame does, and
  /// the IoError of this one.
  void write(const FrameStream& frame);
  /// Wait until everything that was handed over is written. Throws as write() does.
  void finish();

 private:
  void work();
  void write_now(const FrameStream& frame);

  std::filesystem::path folder_;
  FrameFileOptions options_;
  std::vector<TimedFile> index_;  // of who writes: the thread, or its user while it has no frames
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Frame> queue_;               // the front one is being written
  std::size_t handed_ = 0, written_ = 0;  // frames, so far
  std::exception_ptr failure_;
  bool ending_ = false;
  std::thread thread_;
};

}  // namespace lahar
