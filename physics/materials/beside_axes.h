/// \file Where laws have no derivative, or arithmetic does not find it: a stress beside.
#pragma once

#include "physics/materials/stress_invariants.h"

namespace lahar {

/// A stress whose principal stresses are equal is moved by this share of it. A tangent there
/// differs as much from the one at the stress.
inline constexpr double beside = 1e-6;
/// The least stress that counts here, as a share of the bulk modulus.
inline constexpr double least_strain = 1e-6;

/// The size of a stress with the mean p. leave_axes() moves the stress by a share of it.
template <class Real>
LAHAR_INLINE Real size_for_axes(const Real& p, double K) {
  return max(max(p, -p), Real(least_strain * K));
}
/// By how much leave_axes() changes yield functions, about.
template <class Real>
LAHAR_INLINE Real most_move(const Real& p, double K) {
  return 4.0 * beside * size_for_axes(p, K);
}

/// Derivatives of directions and of the Lode angle are not defined, though those of a returned
/// stress may be, where a stress has no deviator or, if `angle` matters, two equal principal
/// stresses. There derivatives are those at a stress beside it: one of the derivatives in the sense
/// of Clarke where the law has a kink. `stress` without derivatives is left as it is. K [Pa].
template <int Rows, class Real>
LAHAR_INLINE void leave_axes([[maybe_unused]] Real* stress, [[maybe_unused]] double K,
                             [[maybe_unused]] bool angle) {
  if constexpr (is_dual<Real>) {
    Scalar values[Rows];
    for (int k = 0; k < Rows; ++k) values[k] = Scalar(stress[k].v);
    StressPoint<Rows, Scalar> at;
    point_of(values, at);
    const double size = size_for_axes(at.p, K)[0];
    double move = 0;
    if (!(at.rho[0] > beside * beside * size))
      move = beside * size;
    else if (angle && !(at.sin3[0] > beside))
      move = 2 * beside * at.rho[0];
    // Its deviator differs from that of stresses with an axis in the plane or along zz.
    constexpr double aside[6] = {0.7, -0.2, -0.5, 0.4, 0.3, -0.6};
    for (int k = 0; k < Rows; ++k) stress[k].v += move * aside[k];
  }
}

}  // namespace lahar
