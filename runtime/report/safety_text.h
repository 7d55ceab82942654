/// \file What a report says of a search for a factor of safety: the factor, its bracket, the
/// trials.
#pragma once

#include <string>
#include <vector>

#include "runtime/report/run_results.h"

namespace lahar {

/// Of the runs that are searches; "" where there is none.
std::string safety_text(const std::vector<RunResults>& runs);

}  // namespace lahar
