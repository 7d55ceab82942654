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
      {"`MohrCoulomb`, return to the yield surface",
       "stresses within 0.1 Pa of the surface, on either side, are taken as lying on it; what has not "
       "come so near in 100 steps is done in parts (there it is accepted)",
       "within rounding of it"},
      {"`Bingham`, shear stress",
       "none unless half the sum of squares of its normal components is at least tau0^2: none in "
       "simple shear",
       "wherever the shear rate is above the critical one"},
      {"`Bingham` in 2D, stress across the plane", "zero", "minus the pressure"},
  };
  return deviations;
}

}  // namespace lahar
