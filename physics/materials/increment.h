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

/// What a rotation by w = spin dt leaves in the strain and the change of volume of an explicit
/// step, of the second order, is taken out: with the gradient at the beginning of the motion L =
/// (Q - 1) / dt, and sym(L) = sym(W^2) / 2 dt; with that at its end the same with the other sign.
/// `half` is dt / 2 or -dt / 2. Bodies that spin would grow or shrink against it.
template <int Dim, class Real>
LAHAR_INLINE void take_rotation_out(LawInput<Dim, Real>& in, double half) {
  const auto& w = in.spin;
  if constexpr (Dim == 2) {
    const Real square = half * (w[0] * w[0]);
    in.rate[0] += square;
    in.rate[1] += square;
    in.volumetric += (2.0 * in.dt) * square;
  } else {
    const Real xx = half * (w[0] * w[0]), yy = half * (w[1] * w[1]), zz = half * (w[2] * w[2]);
    in.rate[0] += yy + zz;
    in.rate[1] += xx + zz;
    in.rate[2] += xx + yy;
    in.rate[3] -= (2.0 * half) * (w[0] * w[1]);
    in.rate[4] -= (2.0 * half) * (w[1] * w[2]);
    in.rate[5] -= (2.0 * half) * (w[0] * w[2]);
    in.volumetric += (2.0 * in.dt) * (xx + yy + zz);
  }
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
