/// \file The increment that a law gets from a finite change of displacement.
#pragma once

#include "physics/materials/law_input.h"

namespace lahar {

/// Relative change of volume, det(I + H) - 1, without the rounding of the difference.
template <int Dim, class Real>
LAHAR_INLINE Real volume_change(const Real (&H)[Dim][Dim]) {
  if constexpr (Dim == 2) {
    return H[0][0] + H[1][1] + (H[0][0] * H[1][1] - H[0][1] * H[1][0]);
  } else {
    const Real xy = H[0][0] * H[1][1] - H[0][1] * H[1][0];
    const Real yz = H[1][1] * H[2][2] - H[1][2] * H[2][1];
    const Real xz = H[0][0] * H[2][2] - H[0][2] * H[2][0];
    const Real all = H[0][0] * yz - H[0][1] * (H[1][0] * H[2][2] - H[1][2] * H[2][0]) +
                     H[0][2] * (H[1][0] * H[2][1] - H[1][1] * H[2][0]);
    return H[0][0] + H[1][1] + H[2][2] + (xy + yz + xz + all);
  }
}

/// M = H (I + H / 2)^-1, whose symmetric part is the strain of the midpoint rule (Hughes and Winget
/// 1980): a rigid rotation, however large, has none.
template <int Dim, class Real>
LAHAR_INLINE void midpoint_gradient(const Real (&H)[Dim][Dim], Real (&M)[Dim][Dim]) {
  Real A[Dim][Dim], inverse[Dim][Dim], determinant(0.0);
  LAHAR_UNROLL
  for (int a = 0; a < Dim; ++a) LAHAR_UNROLL
  for (int b = 0; b < Dim; ++b) A[a][b] = 0.5 * H[a][b] + (a == b ? 1.0 : 0.0);
  LAHAR_UNROLL
  for (int a = 0; a < Dim; ++a) LAHAR_UNROLL
  for (int b = 0; b < Dim; ++b) {  // cofactors of A_ba; indices are cyclic
    const int i = (b + 1) % Dim, j = (b + Dim - 1) % Dim, k = (a + 1) % Dim,
              l = (a + Dim - 1) % Dim;
    if constexpr (Dim == 2)
      inverse[a][b] = a == b ? A[i][k] : -A[i][k];
    else
      inverse[a][b] = A[i][k] * A[j][l] - A[i][l] * A[j][k];
  }
  LAHAR_UNROLL
  for (int a = 0; a < Dim; ++a) determinant += A[0][a] * inverse[a][0];
  const Real per_determinant = 1.0 / determinant;
  LAHAR_UNROLL
  for (int a = 0; a < Dim; ++a) LAHAR_UNROLL
  for (int b = 0; b < Dim; ++b) {
    Real sum(0.0);
    LAHAR_UNROLL
    for (int k = 0; k < Dim; ++k) sum += H[a][k] * inverse[k][b];
    M[a][b] = sum * per_determinant;
  }
}

/// Terms of the second order in dt of the strain and the change of volume of an explicit step,
/// those of the midpoint rule: with the gradient at the beginning of the motion rate -= dt / 2
/// sym(L^2), with that at its end (`at_end`) the same with the other sign. Without them a rotation
/// by w dt is a strain of (w dt)^2 / 2 along both axes, and bodies that spin grow or shrink.
template <int Dim, class Real>
LAHAR_INLINE void add_second_order(LawInput<Dim, Real>& in, bool at_end) {
  const auto& L = in.gradient;
  const double half = at_end ? -0.5 * in.dt : 0.5 * in.dt;
  const Real xy = L[0][1] * L[1][0];
  Real trace, minors;  // invariants of L
  if constexpr (Dim == 2) {
    trace = L[0][0] + L[1][1];
    minors = L[0][0] * L[1][1] - xy;
    in.rate[0] -= half * (L[0][0] * L[0][0] + xy);
    in.rate[1] -= half * (L[1][1] * L[1][1] + xy);
    in.rate[3] -= half * ((L[0][1] + L[1][0]) * (L[0][0] + L[1][1]));
  } else {
    const Real yz = L[1][2] * L[2][1], xz = L[0][2] * L[2][0];
    trace = L[0][0] + L[1][1] + L[2][2];
    minors = L[0][0] * L[1][1] + L[1][1] * L[2][2] + L[0][0] * L[2][2] - xy - yz - xz;
    in.rate[0] -= half * (L[0][0] * L[0][0] + xy + xz);
    in.rate[1] -= half * (L[1][1] * L[1][1] + xy + yz);
    in.rate[2] -= half * (L[2][2] * L[2][2] + xz + yz);
    in.rate[3] -=
        half * ((L[0][1] + L[1][0]) * (L[0][0] + L[1][1]) + L[0][2] * L[2][1] + L[1][2] * L[2][0]);
    in.rate[4] -=
        half * ((L[1][2] + L[2][1]) * (L[1][1] + L[2][2]) + L[1][0] * L[0][2] + L[2][0] * L[0][1]);
    in.rate[5] -=
        half * ((L[0][2] + L[2][0]) * (L[0][0] + L[2][2]) + L[0][1] * L[1][2] + L[2][1] * L[1][0]);
  }
  in.volumetric += (in.dt * in.dt) * (at_end ? Real(trace * trace - minors) : minors);
}

/// How increments follow from finite changes of displacement.
struct Kinematics {
  bool linear_strain = false;  ///< strains are linear in H, as in CB-Geo MPM
  bool turns_stress = false;   ///< LawInput::turns
};

/// The increment of a time step dt [s] with H = d(delta u)/dx at its beginning. The gradient is H /
/// dt, so that F = I + H in laws for large strains. Strains and spin are linear in H, or those of
/// midpoint_gradient(). Plane strain in 2D.
template <int Dim, class Real>
LAHAR_INLINE LawInput<Dim, Real> increment_of(const Real (&H)[Dim][Dim], double dt,
                                              Kinematics kinematics) {
  LawInput<Dim, Real> in;
  Real M[Dim][Dim];
  const double per_dt = 1.0 / dt;
  in.dt = dt;
  in.large = !kinematics.linear_strain;
  in.turns = kinematics.turns_stress;
  LAHAR_UNROLL
  for (int a = 0; a < Dim; ++a) LAHAR_UNROLL
  for (int b = 0; b < Dim; ++b) {
    in.gradient[a][b] = H[a][b] * per_dt;
    M[a][b] = H[a][b];
  }
  in.volumetric = Real(0.0);
  LAHAR_UNROLL
  for (int a = 0; a < Dim; ++a) in.volumetric += H[a][a];
  if (!kinematics.linear_strain) {
    midpoint_gradient(H, M);
    in.volumetric = volume_change(H);
  }
  LAHAR_UNROLL
  for (int k = 0; k < 3; ++k) in.rate[k] = k < Dim ? Real(M[k % Dim][k % Dim] * per_dt) : Real(0.0);
  LAHAR_UNROLL
  for (int k = 3; k < in.rows; ++k) {  // xy, yz, xz
    const int a = k == 4 ? 1 : 0, b = k == 3 ? 1 : Dim - 1;
    in.rate[k] = (M[a][b] + M[b][a]) * per_dt;
  }
  spin_of<Dim>(M, in.spin);
  LAHAR_UNROLL
  for (Real& w : in.spin) w *= per_dt;
  return in;
}

}  // namespace lahar
