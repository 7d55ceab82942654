#include "io/cbgeo_deviations.h"

namespace lahar {

std::span<const CbgeoDeviation> cbgeo_deviations() {
  static constexpr CbgeoDeviation deviations[] = {
      {"`\"stress_update\"` in `analysis`", "ignored: USF is run",
       "the older spelling of `mpm_scheme`, which is run"},
      {"`\"mpm_scheme\": \"musl\"`", "USF is run", "MUSL is run"},
      {"`friction_constraints` in 3D, of a node at rest that is pulled harder than friction holds",
       "slowed by mu a_n a_t / (a_t - mu a_n), which grows without limit as the pull comes near to "
       "mu a_n",
       "slowed by mu a_n, as in 2D"},
  };
  return deviations;
}

}  // namespace lahar
