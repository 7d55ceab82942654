/// \file Particle to grid for tensor bases (basis.h). Lanes are nodes: four along the first axis
/// times two along the second, so that a particle costs the same whatever else is in its cell.
#pragma once

#include <algorithm>

#include "physics/basis/basis.h"
#include "physics/kernels/particle_rows.h"
#include "physics/kernels/particle_sums.h"

namespace lahar::general {

/// Lanes of node values: nodes (k, l) of the first two axes, k = 0..3 and l = 2 h, 2 h + 1.
using EightNodes = PackOf<8>;
inline constexpr int halves = 2;
/// Nodes along the third axis.
template <int Dim>
inline constexpr int layers = Dim == 3 ? axis_nodes : 1;

/// Weights of one axis of the particles of a pack, each a row.
template <class Real>
struct AxisRows : RowsOfFour<Real> {
  /// Values of particle j along the first axis, at the lanes.
  LAHAR_INLINE EightNodes first(Local j) const {
    const auto v = load<PackOf<4>>(this->row[j]).v;
    return EightNodes::of(__builtin_shufflevector(v, v, 0, 1, 2, 3, 0, 1, 2, 3));
  }
  /// Values of particle j along the second axis, at the lanes of a half.
  LAHAR_INLINE EightNodes second(Local j, int half) const {
    const auto v = load<PackOf<4>>(this->row[j]).v;
    return EightNodes::of(half == 0 ? __builtin_shufflevector(v, v, 0, 0, 0, 0, 1, 1, 1, 1)
                                    : __builtin_shufflevector(v, v, 2, 2, 2, 2, 3, 3, 3, 3));
  }
};

/// Sums of `Width` components at the nodes of a cell.
template <int Dim, int Width>
struct TensorSums {
  EightNodes at[halves][layers<Dim>][Width];

  TensorSums() {
    for (auto& half : at)
      for (auto& layer : half)
        for (EightNodes& sum : layer) sum = EightNodes(0.0);
  }
  /// Add them to nodes; component k goes to lane `lane(k)`.
  template <class Lane>
  LAHAR_INLINE void add_to(double* sums, const Local* nodes, Lane lane) const {
    for (int h = 0; h < halves; ++h)
      for (int z = 0; z < layers<Dim>; ++z) {
        EightNodes value[node_width];
        LAHAR_UNROLL
        for (EightNodes& v : value) v = EightNodes(0.0);
        LAHAR_UNROLL
        for (int k = 0; k < Width; ++k) value[lane(k)] = at[h][z][k];
        NodeVector rows[8];
        transpose(value, rows);
        const Local* node = nodes + 16 * z + 8 * h;
        LAHAR_UNROLL
        for (int i = 0; i < 8; ++i) add_to_node(sums, node[i], rows[i]);
      }
  }
};

/// Add sum_p N_i q_p over a bin to components `lane(k)`, k < Width, of its cell's nodes.
/// `values(p, n, q)` fills q for the particles from p on.
template <int Dim, int Width, class Real, TensorBasis Basis, class Values, class Lane>
LAHAR_INLINE void scatter(const Basis& basis, const ParticleBin& bin, const Local* nodes,
                          double* sums, Values values, Lane lane) {
  TensorSums<Dim, Width> sum;
  for (Local p = bin.begin; p < bin.end; p += lanes<Real>) {
    const Local n = std::min<Local>(bin.end - p, lanes<Real>);
    Real w[Dim][axis_nodes], q[Width];
    basis.weights(p, w);
    values(p, n, q);
    AxisRows<Real> rows[Dim];
    LAHAR_UNROLL
    for (int d = 0; d < Dim; ++d) rows[d].set(w[d]);
    alignas(64) double value[Width][lanes<Real>];
    LAHAR_UNROLL
    for (int k = 0; k < Width; ++k) store(q[k], value[k]);
    for (int h = 0; h < halves; ++h) {
      EightNodes s[layers<Dim>][Width];
      LAHAR_UNROLL
      for (int z = 0; z < layers<Dim>; ++z) LAHAR_UNROLL
      for (int k = 0; k < Width; ++k) s[z][k] = sum.at[h][z][k];
      for (Local j = 0; j < n; ++j) {
        const EightNodes N = rows[0].first(j) * rows[1].second(j, h);
        LAHAR_UNROLL
        for (int k = 0; k < Width; ++k) {
          const EightNodes Nq = multiply(N, &value[k][j]);
          LAHAR_UNROLL
          for (int z = 0; z < layers<Dim>; ++z) {
            if constexpr (Dim == 3)
              s[z][k] = multiply_add(s[z][k], Nq, &rows[2].row[j][z]);
            else
              s[z][k] += Nq;
          }
        }
      }
      LAHAR_UNROLL
      for (int z = 0; z < layers<Dim>; ++z) LAHAR_UNROLL
      for (int k = 0; k < Width; ++k) sum.at[h][z][k] = s[z][k];
    }
  }
  sum.add_to(sums, nodes, lane);
}

/// Numbers of the nodes of a half along the first and second axis, at the lanes.
alignas(64) inline constexpr double along_first[8] = {0, 1, 2, 3, 0, 1, 2, 3};
alignas(64) inline constexpr double along_second[halves][8] = {{0, 0, 0, 0, 1, 1, 1, 1},
                                                               {2, 2, 2, 2, 3, 3, 3, 3}};

/// {m v, m}_i += sum_p N_i m_p {v_p + C_p (x_i - x_p), 1}: of each component, what does not vary
/// along the third axis goes with its weight and the rest with its weight times the node's number.
template <int Dim, class Real, TensorBasis Basis>
LAHAR_INLINE void affine_momentum(const Basis& basis, const ParticleMomentum<Dim>& particle,
                                  const Patch<Dim>&, const ParticleBin& bin, const Local* nodes,
                                  double* sums) {
  TensorSums<Dim, Dim + 1> sum;
  for (Local p = bin.begin; p < bin.end; p += lanes<Real>) {
    const Local n = std::min<Local>(bin.end - p, lanes<Real>);
    Real w[Dim][axis_nodes], s[Dim], m, v[Dim], C[Dim][Dim];
    basis.weights(p, w);
    basis.place(p, s);
    particle.at(p, n, m, v, C);
    AxisRows<Real> rows[Dim], numbered;
    alignas(64) double mass[lanes<Real>], first[Dim][lanes<Real>], change[Dim][Dim][lanes<Real>];
    store(m, mass);
    LAHAR_UNROLL
    for (int a = 0; a < Dim; ++a) {  // momentum at the node of number 0 along all axes
      LAHAR_UNROLL
      for (int d = 0; d < Dim; ++d) {
        C[a][d] *= basis.cell_length(d);
        store(C[a][d], change[a][d]);
        v[a] -= C[a][d] * (1.0 + s[d]);
      }
      store(v[a], first[a]);
      rows[a].set(w[a]);
    }
    LAHAR_UNROLL
    for (int k = 0; k < axis_nodes; ++k) w[Dim - 1][k] *= static_cast<double>(k);
    numbered.set(w[Dim - 1]);
    for (int h = 0; h < halves; ++h) {
      EightNodes t[layers<Dim>][Dim + 1];
      LAHAR_UNROLL
      for (int z = 0; z < layers<Dim>; ++z) LAHAR_UNROLL
      for (int k = 0; k <= Dim; ++k) t[z][k] = sum.at[h][z][k];
      const auto X = load<EightNodes>(along_first), Y = load<EightNodes>(along_second[h]);
      for (Local j = 0; j < n; ++j) {
        const EightNodes N = rows[0].first(j) * rows[1].second(j, h), Nm = multiply(N, &mass[j]);
        LAHAR_UNROLL
        for (int z = 0; z < layers<Dim>; ++z)
          t[z][Dim] =
              Dim == 3 ? multiply_add(t[z][Dim], Nm, &rows[Dim - 1].row[j][z]) : t[z][Dim] + Nm;
        LAHAR_UNROLL
        for (int a = 0; a < Dim; ++a) {
          const EightNodes plane =
              N *
              multiply_add(multiply_add(broadcast<EightNodes>(&first[a][j]), X, &change[a][0][j]),
                           Y, &change[a][1][j]);
          if constexpr (Dim == 2) {
            t[0][a] += plane;
          } else {
            const EightNodes along = multiply(N, &change[a][2][j]);
            LAHAR_UNROLL
            for (int z = 0; z < layers<Dim>; ++z)
              t[z][a] = multiply_add(multiply_add(t[z][a], plane, &rows[2].row[j][z]), along,
                                     &numbered.row[j][z]);
          }
        }
      }
      LAHAR_UNROLL
      for (int z = 0; z < layers<Dim>; ++z) LAHAR_UNROLL
      for (int k = 0; k <= Dim; ++k) sum.at[h][z][k] = t[z][k];
    }
  }
  sum.add_to(sums, nodes, [](int k) { return k == Dim ? mass_lane : k; });
}

/// Internal force of a bin: -sum_p S_p grad N_i. Of each component, S_ax dN/dx + S_ay dN/dy goes
/// with the weight of the third axis and S_az N with its slope.
template <int Dim, class Real, TensorBasis Basis, class Stress>
LAHAR_INLINE void internal_force(const Basis& basis, const Stress& stress, const ParticleBin& bin,
                                 const Local* nodes, double* sums) {
  TensorSums<Dim, Dim> sum;
  for (Local p = bin.begin; p < bin.end; p += lanes<Real>) {
    const Local n = std::min<Local>(bin.end - p, lanes<Real>);
    Real w[Dim][axis_nodes], dw[Dim][axis_nodes], S[Dim][Dim];
    basis.weights(p, w, dw);
    stress.at(p, n, S);
    AxisRows<Real> rows[Dim], slopes[Dim];
    alignas(64) double value[Dim][Dim][lanes<Real>];
    LAHAR_UNROLL
    for (int d = 0; d < Dim; ++d) {
      rows[d].set(w[d]);
      slopes[d].set(dw[d]);
      LAHAR_UNROLL
      for (int b = 0; b < Dim; ++b) store(S[d][b], value[d][b]);
    }
    for (int h = 0; h < halves; ++h) {
      EightNodes s[layers<Dim>][Dim];
      LAHAR_UNROLL
      for (int z = 0; z < layers<Dim>; ++z) LAHAR_UNROLL
      for (int a = 0; a < Dim; ++a) s[z][a] = sum.at[h][z][a];
      for (Local j = 0; j < n; ++j) {
        const EightNodes wx = rows[0].first(j), wy = rows[1].second(j, h),
                         gx = slopes[0].first(j) * wy, gy = wx * slopes[1].second(j, h);
        [[maybe_unused]] const EightNodes N = wx * wy;
        LAHAR_UNROLL
        for (int a = 0; a < Dim; ++a) {
          const EightNodes plane = multiply_add(multiply(gx, &value[a][0][j]), gy, &value[a][1][j]);
          if constexpr (Dim == 2) {
            s[0][a] -= plane;
          } else {
            const EightNodes along = multiply(N, &value[a][2][j]);
            LAHAR_UNROLL
            for (int z = 0; z < layers<Dim>; ++z)
              s[z][a] = multiply_add(multiply_add(s[z][a], plane, &rows[2].row[j][z]), along,
                                     &slopes[2].row[j][z]);
          }
        }
      }
      LAHAR_UNROLL
      for (int z = 0; z < layers<Dim>; ++z) LAHAR_UNROLL
      for (int a = 0; a < Dim; ++a) sum.at[h][z][a] = s[z][a];
    }
  }
  if constexpr (Dim == 3)
    for (auto& half : sum.at)
      for (auto& layer : half)
        for (EightNodes& f : layer) f = -f;
  sum.add_to(sums, nodes, [](int a) { return a; });
}

}  // namespace lahar::general
