/// \file Where the time of a task goes: a clock that is read a few hundred thousand times a second.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <limits>

#include "physics/base/types.h"

namespace lahar {

/// A clock that counts at a constant rate, at about 10 ns per reading; its unit is
/// seconds_per_tick().
inline std::uint64_t ticks() {
#if defined(__x86_64__)
  return __builtin_ia32_rdtsc();
#else
  return static_cast<std::uint64_t>(std::chrono::steady_clock::now().time_since_epoch().count());
#endif
}

/// [s], measured against the system's clock since the first call; at best after some milliseconds.
inline double seconds_per_tick() {
  using Clock = std::chrono::steady_clock;
  struct Reading {
    Clock::time_point time = Clock::now();
    std::uint64_t tick = ticks();
  };
  static const Reading start;
  const Reading now;
  const auto passed = static_cast<double>(now.tick - start.tick);
  return passed > 0 ? std::chrono::duration<double>(now.time - start.time).count() / passed : 0.0;
}

/// Ticks of one stage of one patch, summed over its tasks.
struct StageTicks {
  Index calls = 0;
  std::uint64_t total = 0, longest = 0, shortest = std::numeric_limits<std::uint64_t>::max();
  std::uint64_t current = 0;  ///< in the task that runs now
};

/// Divides the time of one task among its stages. A piece of work begins where the one before
/// ended, so that the clock is read once per piece.
class StageClock {
 public:
  /// `stages` are those of the patch, one after the other.
  explicit StageClock(StageTicks* stages) : stages_(stages), last_(ticks()) {}

  /// What was done since the last call belongs to `stage`.
  void lap(std::size_t stage) {
    const std::uint64_t now = ticks();
    stages_[stage].current += now - last_;
    last_ = now;
  }
  /// Ticks of the stages [first, last) in this task so far.
  void read(std::size_t first, std::size_t last, std::uint32_t* ticks) const {
    for (std::size_t s = first; s < last; ++s)
      ticks[s - first] = static_cast<std::uint32_t>(
          std::min<std::uint64_t>(stages_[s].current, std::numeric_limits<std::uint32_t>::max()));
  }
  /// The task consisted of the stages [first, last).
  void finish(std::size_t first, std::size_t last) {
    for (std::size_t s = first; s < last; ++s) {
      StageTicks& t = stages_[s];
      t.calls += 1;
      t.total += t.current;
      t.shortest = std::min(t.shortest, t.current);
      t.longest = std::max(t.longest, t.current);
      t.current = 0;
    }
  }

 private:
  StageTicks* stages_;
  std::uint64_t last_;
};

}  // namespace lahar
