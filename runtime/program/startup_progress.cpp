#include "runtime/program/startup_progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>

#include "io/base/text.h"
#include "runtime/terminal/console.h"

namespace lahar {

namespace {

constexpr std::chrono::milliseconds redraw_every{200};
constexpr std::chrono::seconds patience{1};  ///< shorter starts say nothing
constexpr std::chrono::minutes say_again{1};

}  // namespace

StartupProgress::StartupProgress(bool shown) : terminal_(is_terminal(STDERR_FILENO)) {
  if (shown) thread_ = std::thread([this] { show(); });
}

StartupProgress::~StartupProgress() {
  {
    const std::lock_guard lock(mutex_);
    done_ = true;
  }
  changed_.notify_one();
  if (thread_.joinable()) thread_.join();
  if (line_shown_) std::fputs("\r\033[K", stderr);
}

void StartupProgress::phase(const std::string& text) {
  const std::lock_guard lock(mutex_);
  text_ = printable(text);
  phase_begin_ = Clock::now();
  last_said_ = {};
}

void StartupProgress::show() {
  std::unique_lock lock(mutex_);
  while (!changed_.wait_for(lock, redraw_every, [this] { return done_; })) {
    const auto now = Clock::now();
    if (terminal_ && now - begin_ > patience) show_line(now);
    if (terminal_ || now - phase_begin_ < patience) continue;
    if (last_said_ != Clock::time_point{} && now - last_said_ < say_again) continue;
    show_line(now);
    last_said_ = now;
  }
}

/// On a terminal in place of the line before.
void StartupProgress::show_line(Clock::time_point now) {
  const double seconds = std::chrono::duration<double>(now - begin_).count();
  const std::string line = fmt::format("starting   {}, {}", text_, format_seconds(seconds));
  if (terminal_) {
    std::fputs(("\r\033[K" + line).c_str(), stderr);
    std::fflush(stderr);
    line_shown_ = true;
  } else {
    std::fputs((line + "\n").c_str(), stderr);
  }
}

}  // namespace lahar
