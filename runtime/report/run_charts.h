/// \file Charts of what a run measured: history, rigid bodies, gauges.
#pragma once

#include <vector>

#include "runtime/picture/chart.h"
#include "runtime/report/run_results.h"

namespace lahar {

/// One run: one chart with all energies. Several runs: one chart for each quantity, one line for
/// each run.
std::vector<Chart> history_charts(const std::vector<RunResults>& runs);

/// Charts of the bodies that move, or that particles touch.
std::vector<Chart> body_charts(const std::vector<RunResults>& runs);

std::vector<Chart> gauge_charts(const std::vector<RunResults>& runs);

/// Largest |balance| as a share of the largest energy.
double balance_share(const RunResults& run);

}  // namespace lahar
