/// \file Stress and tangent of a finite increment in models of two dimensions that deform across
/// their plane: laws see three dimensions without shear across it.
#pragma once

#include "physics/materials/tangent.h"

namespace lahar {

/// stress_change() of the increment H, whose components across the plane are zero but for H[2][2].
/// `free` (plane stress): H[2][2] is found first, so that the stress across the plane is zero;
/// an increment for which this is not possible has failed. `stress` has four components.
Failures stress_change_across(const Law& law, bool free, double (&H)[3][3], double dt,
                              Kinematics kinematics, const double* stress, const double* state,
                              StressChange<3>& to);

}  // namespace lahar
