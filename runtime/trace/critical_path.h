/// \file The path of tasks, messages and waits that decided when a run ended.
#pragma once

#include "runtime/trace/analysis.h"
#include "runtime/trace/idle_time.h"

namespace lahar {

CriticalPath critical_path(const TraceLog& log, const Workers& workers);

}  // namespace lahar
