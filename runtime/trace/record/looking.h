/// \file What executors record beside tasks: when threads look for messages, and a clock.
#pragma once

#include <cstdint>

namespace lahar {

/// TaskBodies::looking: records polls.
void trace_looking(bool over);

/// The task of a message that was found while looking is not part of that: polls are cut around it.
class TraceFound {
 public:
  TraceFound();
  ~TraceFound();
  TraceFound(const TraceFound&) = delete;
  TraceFound& operator=(const TraceFound&) = delete;

 private:
  bool while_looking_;
};

/// TaskBodies::clock: ticks, or 0 while no trace is recorded.
std::uint64_t trace_clock();

}  // namespace lahar
