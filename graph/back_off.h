/// \file What a thread does that waits for a message and has nothing else to do.
#pragma once

#include <algorithm>
#include <chrono>
#include <thread>

namespace lahar {

/// Let others have the core for a moment, between two looks at what one waits for. A yield costs
/// nothing where nobody else wants the core. Where somebody does, it gives a whole slice of time
/// away (Linux 6.18 counts it as used), which is long after the message has come; a short sleep
/// does not, and so this thread sleeps for a while after a yield that took long, for longer each
/// time.
inline void back_off() {
  using Clock = std::chrono::steady_clock;
  constexpr auto moment = std::chrono::microseconds(20),
                 long_yield = std::chrono::microseconds(100);
  constexpr int fewest = 200, most = 2000;  // sleeps, of some 70 us each
  thread_local int sleeps = 0, next = fewest;
  if (sleeps > 0) {
    --sleeps;
    std::this_thread::sleep_for(moment);
    return;
  }
  const Clock::time_point begin = Clock::now();
  std::this_thread::yield();
  const bool is_shared = Clock::now() - begin > long_yield;
  sleeps = is_shared ? next : 0;
  next = is_shared ? std::min(2 * next, most) : fewest;
}

/// Between looks of a thread for messages while it waits for them. Where others may want the core
/// it yields some times before it backs off: four ranks on two quiet cores take 0.9 of the time,
/// two ranks beside four busy processes 0.65, as most messages come before a slice of time is over.
class Waiting {
 public:
  /// `has_cores`: all who wait have cores of their own, which nobody else wants for the next
  /// milliseconds.
  explicit Waiting(bool has_cores) : has_cores_(has_cores) {}
  /// After a look.
  void looked(bool found) {
    constexpr int own = 5000, shared = 20;  // looks in vain
    if (found) {
      empty_ = 0;
    } else if (++empty_ >= (has_cores_ ? own : shared)) {
      back_off();
    } else if (!has_cores_) {
      std::this_thread::yield();
    }
  }

 private:
  bool has_cores_;
  int empty_ = 0;
};

}  // namespace lahar
