/// \file Traces for other programs.
#pragma once

#include <filesystem>

#include "runtime/trace/analyse/log.h"

namespace lahar {

/// The trace-event format of Chrome, which Perfetto and chrome://tracing open: a process per rank,
/// a row per thread, arrows for messages and for what each task waited for last, counters. With
/// ending .gz compressed. Throws IoError.
void write_chrome(const TraceLog& log, const std::filesystem::path& file);

}  // namespace lahar
