/// \file Nodal fields at a pack of particles, with any basis (basis.h).
#pragma once

#include "physics/basis.h"

namespace lahar::supported {

/// value[a] = sum_i v_a N_i and L[a][b] = sum_i v_a M_i^b at every lane, where N_i is the product
/// of the weights w of all axes, and M_i^b the same with m in place of w for axis b: gradients
/// where m are slopes. One axis after the other: first along x, then y.
template <int Dim, class Real>
LAHAR_INLINE void with_weights(const Real (&w)[Dim][axis_nodes], const Real (&m)[Dim][axis_nodes],
                               const double* v, const Local* nodes, Real (&value)[Dim],
                               Real (&L)[Dim][Dim]) {
  LAHAR_UNROLL
  for (int a = 0; a < Dim; ++a) {
    value[a] = Real(0.0);
    LAHAR_UNROLL
    for (int b = 0; b < Dim; ++b) L[a][b] = Real(0.0);
  }
  for (int z = 0; z < (Dim == 3 ? axis_nodes : 1); ++z) {
    Real by_x[Dim], by_y[Dim], sum[Dim];
    LAHAR_UNROLL
    for (int a = 0; a < Dim; ++a) by_x[a] = by_y[a] = sum[a] = Real(0.0);
    for (int y = 0; y < axis_nodes; ++y) {
      const Local* node = nodes + 16 * z + 4 * y;
      Real along[Dim], slope[Dim];
      LAHAR_UNROLL
      for (int x = 0; x < axis_nodes; ++x) {
        const double* at = v + static_cast<std::ptrdiff_t>(node[x]) * node_width;
        LAHAR_UNROLL
        for (int a = 0; a < Dim; ++a) {
          along[a] = x == 0 ? multiply(w[0][x], at + a) : multiply_add(along[a], w[0][x], at + a);
          slope[a] = x == 0 ? multiply(m[0][x], at + a) : multiply_add(slope[a], m[0][x], at + a);
        }
      }
      LAHAR_UNROLL
      for (int a = 0; a < Dim; ++a) {
        by_x[a] += w[1][y] * slope[a];
        by_y[a] += m[1][y] * along[a];
        sum[a] += w[1][y] * along[a];
      }
    }
    LAHAR_UNROLL
    for (int a = 0; a < Dim; ++a) {
      if constexpr (Dim == 2) {
        L[a][0] = by_x[a];
        L[a][1] = by_y[a];
        value[a] = sum[a];
      } else {
        L[a][0] += w[2][z] * by_x[a];
        L[a][1] += w[2][z] * by_y[a];
        L[a][2] += m[2][z] * sum[a];
        value[a] += w[2][z] * sum[a];
      }
    }
  }
}

/// L[a][b] = sum_i v_a dN_i/dx_b at the particles from p on.
template <int Dim, class Real, TensorBasis Basis>
LAHAR_INLINE void gradient(const Basis& basis, Local p, const double* v, const Local* nodes,
                           Real (&L)[Dim][Dim]) {
  Real w[Dim][axis_nodes], dw[Dim][axis_nodes], value[Dim];
  basis.weights(p, w, dw);
  with_weights<Dim>(w, dw, v, nodes, value, L);
}

template <int Dim, class Real, class Basis>
LAHAR_INLINE void gradient(const Basis& basis, Local p, const double* v, const Local* nodes,
                           Real (&L)[Dim][Dim]) {
  Real dN[Dim][Basis::nodes];
  basis.gradients(p, dN);
  LAHAR_UNROLL
  for (int a = 0; a < Dim; ++a) LAHAR_UNROLL
  for (int b = 0; b < Dim; ++b) L[a][b] = Real(0.0);
  LAHAR_UNROLL
  for (int i = 0; i < Basis::nodes; ++i) {
    const double* value = v + static_cast<std::ptrdiff_t>(nodes[i]) * node_width;
    LAHAR_UNROLL
    for (int a = 0; a < Dim; ++a) LAHAR_UNROLL
    for (int b = 0; b < Dim; ++b) L[a][b] = multiply_add(L[a][b], dN[b][i], value + a);
  }
}

/// sum[f][d] = sum_i N_i q_d of `Fields` nodal fields q.
template <int Dim, int Fields, class Real, TensorBasis Basis>
LAHAR_INLINE void interpolate(const Basis& basis, Local p, const double* const (&field)[Fields],
                              const Local* nodes, Real (&sum)[Fields][Dim]) {
  Real w[Dim][axis_nodes];
  basis.weights(p, w);
  LAHAR_UNROLL
  for (int f = 0; f < Fields; ++f) LAHAR_UNROLL
  for (int d = 0; d < Dim; ++d) sum[f][d] = Real(0.0);
  for (int z = 0; z < (Dim == 3 ? axis_nodes : 1); ++z)
    for (int y = 0; y < axis_nodes; ++y) {
      Real plane = w[1][y];
      if constexpr (Dim == 3) plane *= w[2][z];
      LAHAR_UNROLL
      for (int x = 0; x < axis_nodes; ++x) {
        const Real N = plane * w[0][x];
        const auto at = static_cast<std::ptrdiff_t>(nodes[16 * z + 4 * y + x]) * node_width;
        LAHAR_UNROLL
        for (int f = 0; f < Fields; ++f) LAHAR_UNROLL
        for (int d = 0; d < Dim; ++d) sum[f][d] = multiply_add(sum[f][d], N, field[f] + at + d);
      }
    }
}

template <int Dim, int Fields, class Real, class Basis>
LAHAR_INLINE void interpolate(const Basis& basis, Local p, const double* const (&field)[Fields],
                              const Local* nodes, Real (&sum)[Fields][Dim]) {
  Real N[Basis::nodes];
  basis.functions(p, N);
  LAHAR_UNROLL
  for (int f = 0; f < Fields; ++f) LAHAR_UNROLL
  for (int d = 0; d < Dim; ++d) sum[f][d] = Real(0.0);
  LAHAR_UNROLL
  for (int i = 0; i < Basis::nodes; ++i) {
    const auto at = static_cast<std::ptrdiff_t>(nodes[i]) * node_width;
    LAHAR_UNROLL
    for (int f = 0; f < Fields; ++f) LAHAR_UNROLL
    for (int d = 0; d < Dim; ++d) sum[f][d] = multiply_add(sum[f][d], N[i], field[f] + at + d);
  }
}

}  // namespace lahar::supported
