/// \file The affine velocity field of particles (Affine), from nodal velocities.
#pragma once

#include "physics/basis/nodal_fields.h"

namespace lahar::general {

/// The affine part of APIC where functions are those of a domain with corners, in place of C, which
/// holds the gradient. D, of at least the domain's own second moments, is singular only where
/// functions of nodes beyond the mesh make it so: the gradient remains there.
template <int Dim, class Real, class Basis>
LAHAR_INLINE void moments_of_domain(const Basis& basis, Local p, const double* v,
                                    const Local* nodes, Real (&C)[Dim][Dim]) {
  constexpr double least = 1e-6;  // [-] of D's eigenvalues over the cell's length squared
  Real N[Basis::nodes], s[Dim], D[Dim][Dim], B[Dim][Dim], inv[Dim][Dim];
  basis.functions(p, N);
  basis.place(p, s);
  for (int a = 0; a < Dim; ++a)
    for (int b = 0; b < Dim; ++b) D[a][b] = B[a][b] = Real(0.0);
  for (int i = 0; i < Basis::nodes; ++i) {
    const double* at = v + static_cast<std::ptrdiff_t>(nodes[i]) * node_width;
    Real away[Dim];
    LAHAR_UNROLL
    for (int d = 0; d < Dim; ++d) away[d] = (Basis::number(i, d) - 1.0) - s[d];
    LAHAR_UNROLL
    for (int d = 0; d < Dim; ++d) {
      const Real moment = N[i] * away[d];
      LAHAR_UNROLL
      for (int a = 0; a < Dim; ++a) {
        D[a][d] += moment * away[a];
        B[a][d] = multiply_add(B[a][d], moment, at + a);
      }
    }
  }
  inverse(D, inv);
  Real det = D[0][0] * D[1][1] - D[0][1] * D[1][0], most = D[0][0] + D[1][1];
  if constexpr (Dim == 3) {
    det = D[0][2] * (D[1][0] * D[2][1] - D[1][1] * D[2][0]) +
          D[1][2] * (D[0][1] * D[2][0] - D[0][0] * D[2][1]) + D[2][2] * det;
    most += D[2][2];
    most *= most;
  }
  const unsigned regular = greater(det, least * most);
  LAHAR_UNROLL
  for (int a = 0; a < Dim; ++a) LAHAR_UNROLL
  for (int b = 0; b < Dim; ++b) {
    Real sum(0.0);
    LAHAR_UNROLL
    for (int d = 0; d < Dim; ++d) sum += B[a][d] * inv[d][b];
    C[a][b] = select(regular, sum * (1.0 / basis.cell_length(b)), C[a][b]);
  }
}

/// C of affine_velocity() where functions are given one by one.
template <int Dim, class Real, class Basis>
LAHAR_INLINE void affine_part(const Basis& basis, Affine affine, Local p, const double* spread,
                              const Local* nodes, Real (&C)[Dim][Dim]) {
  gradient<Dim, Real>(basis, p, spread, nodes, C);
  if constexpr (DomainBasis<Basis>)
    if (affine == Affine::apic) moments_of_domain<Dim>(basis, p, spread, nodes, C);
}

/// Velocity of the nodes at the particles from p on, and the affine part C of the nodal velocities
/// `spread` there: of APIC sum_i N_i v_i (x_i - x_p)^T D^-1 (Jiang et al. 2015), of TPIC, and of
/// APIC with functions of elements, the velocity gradient. For linear functions on boxes and
/// simplices these are the same.
template <int Dim, class Real, TensorBasis Basis>
LAHAR_INLINE void affine_velocity(const Basis& basis, Affine affine, Local p, const double* v,
                                  const double* /*spread*/, const Local* nodes, Real (&value)[Dim],
                                  Real (&C)[Dim][Dim]) {
  AxisWeights<Dim, Real> by;
  Fields<Dim, Real> at;
  basis.weights(p, by.w, by.dw);
  if (affine == Affine::apic) {
    basis.moments(p, by.w, by.dw, by.m);
    LAHAR_UNROLL
    for (int d = 0; d < Dim; ++d) LAHAR_UNROLL
    for (int k = 0; k < axis_nodes; ++k) by.dw[d][k] = by.m[d][k];
  }
  with_weights<Wanted{}>(by, v, nullptr, nodes, at);
  LAHAR_UNROLL
  for (int d = 0; d < Dim; ++d) {
    value[d] = at.v[d];
    LAHAR_UNROLL
    for (int b = 0; b < Dim; ++b) C[d][b] = at.L[d][b];
  }
}
template <int Dim, class Real, class Basis>
LAHAR_INLINE void affine_velocity(const Basis& basis, Affine affine, Local p, const double* v,
                                  const double* spread, const Local* nodes, Real (&value)[Dim],
                                  Real (&C)[Dim][Dim]) {
  const double* const fields[1] = {v};
  Real sum[1][Dim];
  interpolate<Dim, 1>(basis, p, fields, nodes, sum);
  LAHAR_UNROLL
  for (int d = 0; d < Dim; ++d) value[d] = sum[0][d];
  affine_part<Dim>(basis, affine, p, spread, nodes, C);
}

}  // namespace lahar::general
