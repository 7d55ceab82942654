/// \file Parts of an analysis that need no more than the log.
#pragma once

#include "runtime/trace/analyse/analysis.h"
#include "runtime/trace/analyse/idle_time.h"

namespace lahar {

inline double duration(const TraceTask& task) {
  return task.end - task.begin;
}
/// "integrate of patch 3, step 7", "solve: advance of patch 3, round 120 of step 7".
std::string task_name(const TraceLog& log, const TraceTask& task);
/// In the task's patch, when patches were last made or moved.
std::int64_t particles_of(const TraceLog& log, const TraceTask& task);

std::vector<Wait> longest_waits(const TraceLog& log, const IdleTime& idle);
std::vector<PatchUse> slowest_patches(const TraceLog& log);
ExchangeUse exchange_of(const TraceLog& log, const IdleTime& idle);
StepSpread spread_of(const TraceLog& log);
/// TraceReport::disturbance.
double disturbance_of(const TraceLog& log);

/// What the run's time is made of beside an even share of all work; needs the report's path,
/// ideal_time and patches.
std::vector<Finding> losses_of(const TraceLog& log, const TraceReport& report);

}  // namespace lahar
