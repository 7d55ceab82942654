/// \file The path of tasks, messages and waits that decided when a run ended.
#pragma once

#include "runtime/trace/analyse/analysis.h"
#include "runtime/trace/analyse/idle_time.h"

namespace lahar {

CriticalPath critical_path(const TraceLog& log, const Workers& workers);

}  // namespace lahar
