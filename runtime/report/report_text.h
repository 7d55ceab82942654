/// \file Parts of the page that are words and tables.
#pragma once

#include <string>
#include <vector>

#include "runtime/report/run_results.h"

namespace lahar {

/// How a run ended, with the reason.
std::string verdict(const RunResults& run);

/// Key figures: tiles of one run, a table of several.
std::string key_figures(const std::vector<RunResults>& runs);

std::string warnings_text(const std::vector<RunResults>& runs);

/// Times of stages of the time step.
std::string efficiency(const std::vector<RunResults>& runs);

/// Scenario, inputs with their hashes, program, command.
std::string provenance(const std::vector<RunResults>& runs);

}  // namespace lahar
