/// \file The table of stages at the end of a run.
#pragma once

#include <string>
#include <vector>

#include "runtime/step/simulation.h"

namespace lahar {

/// End-of-run table: time per stage, its share of all thread time, shortest and longest task, idle.
std::string timing_table(const std::vector<StageTiming>& timings, double wall_seconds, int threads);

}  // namespace lahar
