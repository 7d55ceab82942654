/// \file The page that `lahar report` writes: one file for browsers, with everything in it.
#pragma once

#include <string>
#include <vector>

#include "runtime/report/run_results.h"
#include "runtime/report/samples.h"

namespace lahar {

struct ReportOptions {
  std::vector<std::string> fields;  ///< empty: usual_fields()
  std::size_t times = 4;            ///< of pictures
  std::vector<double> at;           ///< [s] of pictures, in their place; empty: `times` of them
  SampleBudget budget;
};

/// Of one run, or of several beside each other.
std::string report_page(const std::vector<RunResults>& runs, const ReportOptions& options);

}  // namespace lahar
