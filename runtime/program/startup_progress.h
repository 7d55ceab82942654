/// \file What a start that takes long is doing.
#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <string>
#include <thread>

namespace lahar {

/// While it exists, standard error shows what is being done and for how long, where that takes more
/// than a second: on a terminal in a line that is rewritten and goes away at the end, elsewhere in
/// a plain line for each part that takes long, and again for one that takes minutes. Another thread
/// does it; nothing else may write to standard error meanwhile.
class StartupProgress {
 public:
  explicit StartupProgress(bool shown);
  ~StartupProgress();
  StartupProgress(const StartupProgress&) = delete;
  StartupProgress& operator=(const StartupProgress&) = delete;

  /// What is done from now on: "cells of 1,000,000 particles".
  void phase(const std::string& text);

 private:
  using Clock = std::chrono::steady_clock;
  void show();
  void show_line(Clock::time_point now);

  std::mutex mutex_;
  std::condition_variable changed_;
  std::string text_ = "scenario";
  Clock::time_point begin_ = Clock::now(), phase_begin_ = begin_, last_said_{};
  bool terminal_, line_shown_ = false, done_ = false;
  std::thread thread_;
};

}  // namespace lahar
