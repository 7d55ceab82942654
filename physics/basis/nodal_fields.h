/// \file Nodal fields at a pack of particles, with any basis (basis.h).
#pragma once

#include <optional>

#include "physics/basis/basis.h"
#include "physics/model/model.h"

namespace lahar::general {

/// Nodal fields at a pack of particles.
template <int Dim, class Real>
struct Fields {
  Real v[Dim];       ///< sum_i N_i v_i [m/s]
  Real L[Dim][Dim];  ///< its gradient [1/s]
  Real C[Dim][Dim];  ///< its affine part [1/s]
  Real a[Dim];       ///< sum_i N_i a_i [m/s^2]
};

/// What with_weights() is to find besides v and L.
struct Wanted {
  bool C = false, a = false;
};

/// Weights of the nodes of a cell, by axis.
template <int Dim, class Real>
struct AxisWeights {
  Real w[Dim][axis_nodes], dw[Dim][axis_nodes];  ///< functions; their slopes [1/m]
  Real m[Dim][axis_nodes];                       ///< moments, for C [1/m]
};

/// v = sum_i v_i N_i and L[a][b] = sum_i v_ia M_i^b at every lane, where N_i is the product of the
/// weights w of all axes, and M_i^b the same with dw in place of w for axis b; C is what L is with
/// m in place of dw. One axis after the other: first along x, then y.
template <Wanted wanted, int Dim, class Real>
LAHAR_INLINE void with_weights(const AxisWeights<Dim, Real>& by, const double* v, const double* a,
                               const Local* nodes, Fields<Dim, Real>& at) {
  const auto& [w, dw, m] = by;
  LAHAR_UNROLL
  for (int d = 0; d < Dim; ++d) {
    at.v[d] = at.a[d] = Real(0.0);
    LAHAR_UNROLL
    for (int b = 0; b < Dim; ++b) at.L[d][b] = at.C[d][b] = Real(0.0);
  }
  for (int z = 0; z < (Dim == 3 ? axis_nodes : 1); ++z) {
    Real sum[Dim], by_x[Dim], by_y[Dim], of_x[Dim], of_y[Dim], sum_a[Dim];
    LAHAR_UNROLL
    for (int d = 0; d < Dim; ++d)
      sum[d] = by_x[d] = by_y[d] = of_x[d] = of_y[d] = sum_a[d] = Real(0.0);
    for (int y = 0; y < axis_nodes; ++y) {
      const Local* node = nodes + 16 * z + 4 * y;
      Real along[Dim], slope[Dim], moment[Dim], along_a[Dim];
      LAHAR_UNROLL
      for (int x = 0; x < axis_nodes; ++x) {
        const auto place = static_cast<std::ptrdiff_t>(node[x]) * node_width;
        const auto add = [&](Real & to, const Real& weight, const double* value)
            __attribute__((always_inline)) {
          to = x == 0 ? multiply(weight, value) : multiply_add(to, weight, value);
        };
        LAHAR_UNROLL
        for (int d = 0; d < Dim; ++d) {
          add(along[d], w[0][x], v + place + d);
          add(slope[d], dw[0][x], v + place + d);
          if constexpr (wanted.C) add(moment[d], m[0][x], v + place + d);
          if constexpr (wanted.a) add(along_a[d], w[0][x], a + place + d);
        }
      }
      LAHAR_UNROLL
      for (int d = 0; d < Dim; ++d) {
        sum[d] += w[1][y] * along[d];
        by_x[d] += w[1][y] * slope[d];
        by_y[d] += dw[1][y] * along[d];
        if constexpr (wanted.C) of_x[d] += w[1][y] * moment[d];
        if constexpr (wanted.C) of_y[d] += m[1][y] * along[d];
        if constexpr (wanted.a) sum_a[d] += w[1][y] * along_a[d];
      }
    }
    LAHAR_UNROLL
    for (int d = 0; d < Dim; ++d) {
      if constexpr (Dim == 2) {
        at.v[d] = sum[d];
        at.L[d][0] = by_x[d];
        at.L[d][1] = by_y[d];
        at.C[d][0] = of_x[d];
        at.C[d][1] = of_y[d];
        at.a[d] = sum_a[d];
      } else {
        at.v[d] += w[2][z] * sum[d];
        at.L[d][0] += w[2][z] * by_x[d];
        at.L[d][1] += w[2][z] * by_y[d];
        at.L[d][2] += dw[2][z] * sum[d];
        if constexpr (wanted.C) {
          at.C[d][0] += w[2][z] * of_x[d];
          at.C[d][1] += w[2][z] * of_y[d];
          at.C[d][2] += m[2][z] * sum[d];
        }
        if constexpr (wanted.a) at.a[d] += w[2][z] * sum_a[d];
      }
    }
  }
}

/// L[a][b] = sum_i v_a dN_i/dx_b at the particles from p on.
template <int Dim, class Real, TensorBasis Basis>
LAHAR_INLINE void gradient(const Basis& basis, Local p, const double* v, const Local* nodes,
                           Real (&L)[Dim][Dim]) {
  AxisWeights<Dim, Real> by;
  Fields<Dim, Real> at;
  basis.weights(p, by.w, by.dw);
  with_weights<Wanted{}>(by, v, nullptr, nodes, at);
  LAHAR_UNROLL
  for (int a = 0; a < Dim; ++a) LAHAR_UNROLL
  for (int b = 0; b < Dim; ++b) L[a][b] = at.L[a][b];
}

template <int Dim, class Real, NaturalBasis Basis>
LAHAR_INLINE void gradient(const Basis& basis, Local p, const double* v, const Local* nodes,
                           Real (&L)[Dim][Dim]) {
  Real dN[Basis::nodes][Dim], to_natural[Dim][Dim], G[Dim][Dim];
  basis.natural_gradients(p, dN, to_natural);
  LAHAR_UNROLL
  for (int i = 0; i < Basis::nodes; ++i) {
    const double* value = v + static_cast<std::ptrdiff_t>(nodes[i]) * node_width;
    LAHAR_UNROLL
    for (int a = 0; a < Dim; ++a) LAHAR_UNROLL
    for (int k = 0; k < Dim; ++k)
      G[a][k] = i == 0 ? multiply(dN[i][k], value + a) : multiply_add(G[a][k], dN[i][k], value + a);
  }
  LAHAR_UNROLL
  for (int a = 0; a < Dim; ++a) LAHAR_UNROLL
  for (int b = 0; b < Dim; ++b) {
    L[a][b] = G[a][0] * to_natural[0][b];
    LAHAR_UNROLL
    for (int k = 1; k < Dim; ++k) L[a][b] = fma(G[a][k], to_natural[k][b], L[a][b]);
  }
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

/// sum_i N_i q of one component of a nodal field.
template <class Real, class Basis>
LAHAR_INLINE Real interpolate_component(const Basis& basis, Local p, const double* component,
                                        const Local* nodes) {
  Real N[Basis::nodes], sum(0.0);
  basis.functions(p, N);
  LAHAR_UNROLL
  for (int i = 0; i < Basis::nodes; ++i)
    sum = multiply_add(sum, N[i], component + static_cast<std::ptrdiff_t>(nodes[i]) * node_width);
  return sum;
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

template <int Dim, class Real>
LAHAR_INLINE Real trace(const Real (&L)[Dim][Dim]) {
  Real sum = L[0][0] + L[1][1];
  if constexpr (Dim == 3) sum += L[2][2];
  return sum;
}

/// Trace of a velocity gradient at the cell's centre: of linear functions of its corners, those of
/// a domain without size, as in the reference code.
template <int Dim, TensorBasis Basis>
double centre_trace(const Basis& basis, const double* v, const Local* nodes) {
  double trace = 0.0;
  for (int d = 0; d < Dim; ++d) {
    double difference = 0.0;
    for (int c = 0; c < corners<Dim>; ++c) {
      int i = 0;  // the corner's number in the grid of nodes
      for (int e = 0; e < Dim; ++e) i += (1 + (c >> e & 1)) << (2 * e);
      const double value = v[static_cast<std::ptrdiff_t>(nodes[i]) * node_width + d];
      difference += c >> d & 1 ? value : -value;
    }
    trace += difference / (face_corners<Dim> * basis.cell_length(d));
  }
  return trace;
}

template <int Dim, class Basis>
double centre_trace(const Basis& basis, const double* v, const Local* nodes) {
  if constexpr (requires { basis.centre_trace(v, nodes); }) {
    return basis.centre_trace(v, nodes);
  } else {
    double dN[Dim][Basis::nodes], trace = 0.0;
    basis.centre_gradients(dN);
    for (int i = 0; i < Basis::nodes; ++i)
      for (int d = 0; d < Dim; ++d)
        trace += dN[d][i] * v[static_cast<std::ptrdiff_t>(nodes[i]) * node_width + d];
    return trace;
  }
}

/// Volumetric strain rate [1/s] that all particles of a cell have: with Analysis::volume_as_cbgeo
/// that at its centre, where the basis has one; else none.
template <int Dim, class Basis>
LAHAR_INLINE std::optional<double> rate_of_cell(const Basis& basis, const Analysis& analysis,
                                                const double* v, const Local* nodes) {
  if constexpr (Basis::volume_at_centre)
    if (analysis.volume_as_cbgeo) return centre_trace<Dim>(basis, v, nodes);
  return std::nullopt;
}

}  // namespace lahar::general
