/// \file Traces for Vampir, Cube and the other programs around Score-P.
#pragma once

#include <filesystem>

#include "runtime/trace/analyse/log.h"

namespace lahar {

/// An OTF2 archive in a folder that does not exist yet: a process per rank, a location per thread,
/// a region per phase, messages, counters as metrics. Throws IoError, and InputError where this
/// build has no OTF2 (LAHAR_OTF2 of CMake).
void write_otf2(const TraceLog& log, const std::filesystem::path& folder);

}  // namespace lahar
