/// \file Values over time in traces.
#pragma once

#include <string_view>

#include "runtime/trace/analyse/log.h"

namespace lahar {

/// "active particles", "memory", "load".
std::string_view name_of(TraceCounter counter);
/// "particles", "bytes", "share".
std::string_view unit_of(TraceCounter counter);

/// Adds the load of each rank, which follows from the tasks: the share of its workers' time that
/// they were in tasks of own patches, 0 to 1, over equal intervals of about a step or more. A value
/// holds from its time until the next.
void add_load(TraceLog& log);

/// Values of one counter of one rank, ascending in time.
std::vector<TraceValue> values_of(const TraceLog& log, TraceCounter counter, int rank);

}  // namespace lahar
