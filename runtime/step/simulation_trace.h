/// \file What a simulation does for traces and studies beside its tasks.
#pragma once

#include "runtime/trace/record/recorder.h"

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

/// Keep this thread busy [s], for studies.
void waste_time(double seconds, Step step);

/// [bytes] of memory that this process has at present; 0 = not known.
double resident_memory();

}  // namespace lahar
