/// \file Where CB-Geo MPM computes something else than its documentation or the physics say.
#pragma once

#include <span>
#include <string_view>

namespace lahar {

/// What `--as-cbgeo` (analysis.as_cbgeo) reproduces. The reference page lists all of them.
struct CbgeoDeviation {
  std::string_view what;
  std::string_view there;  ///< with --as-cbgeo, and in CB-Geo MPM
  std::string_view here;   ///< without
};

std::span<const CbgeoDeviation> cbgeo_deviations();

}  // namespace lahar
