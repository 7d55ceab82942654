/// \file A trace and its analysis as one HTML page.
#pragma once

#include <cstddef>
#include <string>

#include "runtime/trace/analyse/analysis.h"

namespace lahar {

/// Whole in itself: opens from a file, without network. Of longer traces the timeline shows
/// `most_tasks` tasks from the middle of the run and says so; all else is of the whole run.
std::string page_of(const TraceLog& log, const TraceReport& report,
                    std::size_t most_tasks = 1'000'000);

}  // namespace lahar
