/// \file What the timeline of the page shows, as compact text.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "runtime/trace/analyse/analysis.h"

namespace lahar {

/// Integers as text: differences, their sign in the lowest bit, byte by byte (first all lowest
/// bytes), deflated, in base64. page/data.js reads it.
std::string packed(const std::vector<std::int32_t>& values);

/// JSON: the run, and tables of tasks, messages, intervals, counters and pieces of the critical
/// path, whose columns are packed(). Times are multiples of `unit` after `origin`; tasks are
/// numbered from `first_task` on.
std::string timeline_of(const TraceLog& log, const TraceReport& report, std::size_t most_tasks);

}  // namespace lahar
