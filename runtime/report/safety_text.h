/// \file What a report says of a search for a factor of safety: the factor, its bracket, the
/// trials.
#pragma once

#include <string>
#include <vector>

#include "runtime/report/run_results.h"

namespace lahar {

/// The part of the page about those runs that are searches; "" if none is.
std::string safety_text(const std::vector<RunResults>& runs);

}  // namespace lahar
