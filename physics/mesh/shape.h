/// \file Linear shape functions on [-1, 1]^Dim in tensor order (bit d of a corner's number = + side
/// of axis d), for a pack of particles of one cell.
#pragma once

#include <array>

#include "physics/base/simd.h"
#include "physics/base/types.h"

namespace lahar {

/// One-dimensional weights w[d][s] = (1 + (2 s - 1) xi_d) / 2; N_i = prod_d w[d][bit d of i].
template <int Dim, class Real>
struct Weights {
  Real w[Dim][2];

  LAHAR_INLINE explicit Weights(const Real (&xi)[Dim]) {
    LAHAR_UNROLL
    for (int d = 0; d < Dim; ++d) {
      w[d][0] = 0.5 - 0.5 * xi[d];
      w[d][1] = 0.5 + 0.5 * xi[d];
    }
  }

  LAHAR_INLINE Real N(int i) const {
    Real value = w[0][i & 1] * w[1][(i >> 1) & 1];
    if constexpr (Dim == 3) value *= w[2][(i >> 2) & 1];
    return value;
  }

  /// Product of the weights of all axes but `axis`, at corner `c` (bits of the other axes in
  /// ascending order) of a face normal to it: dN/dxi_axis = +- face(axis, c) / 2.
  LAHAR_INLINE Real face(int axis, int c) const {
    if constexpr (Dim == 2) return w[1 - axis][c & 1];
    const int a = axis == 0 ? 1 : 0, b = axis == 2 ? 1 : 2;
    return w[a][c & 1] * w[b % Dim][(c >> 1) & 1];
  }
};

/// Corners of a face normal to an axis.
template <int Dim>
inline constexpr int face_corners = 1 << (Dim - 1);

/// Tensor-order number of the cell corner at face corner c on the - side of `axis`; the + side has
/// bit `axis` set in addition.
constexpr int face_to_corner(int axis, int c) {
  const int low = c & ((1 << axis) - 1), high = c >> axis;
  return low | (high << (axis + 1));
}

/// Differences of a nodal vector field across a cell, from which its gradient follows. With
/// coordinates s = (1 + xi) / 2, which run from 0 to 1 across the cell,
/// dq_a/ds_b = sum_c face(b, c) * d[b][c][a].
template <int Dim>
struct CornerDifferences {
  alignas(64) double d[Dim][face_corners<Dim>][4];

  /// `field` holds four doubles per node, the first Dim are the vector.
  LAHAR_INLINE CornerDifferences(const double* field,
                                 const std::array<Local, corners<Dim>>& corner) {
    using Vector = PackOf<4>;
    LAHAR_UNROLL
    for (int b = 0; b < Dim; ++b) LAHAR_UNROLL
    for (int c = 0; c < face_corners<Dim>; ++c) {
      const int i = face_to_corner(b, c);
      store(load<Vector>(field + 4 * static_cast<std::ptrdiff_t>(corner[i | (1 << b)])) -
                load<Vector>(field + 4 * static_cast<std::ptrdiff_t>(corner[i])),
            d[b][c]);
    }
  }

  /// G[a][b] = dq_a/ds_b at every lane.
  template <class Real>
  LAHAR_INLINE void gradient(const Weights<Dim, Real>& w, Real (&G)[Dim][Dim]) const {
    LAHAR_UNROLL
    for (int b = 0; b < Dim; ++b) {
      Real face[face_corners<Dim>];
      LAHAR_UNROLL
      for (int c = 0; c < face_corners<Dim>; ++c) face[c] = w.face(b, c);
      LAHAR_UNROLL
      for (int a = 0; a < Dim; ++a) {
        G[a][b] = multiply(face[0], &d[b][0][a]);
        LAHAR_UNROLL
        for (int c = 1; c < face_corners<Dim>; ++c)
          G[a][b] = multiply_add(G[a][b], face[c], &d[b][c][a]);
      }
    }
  }

  /// The same at the cell's centre.
  LAHAR_INLINE void centre_gradient(double (&G)[Dim][Dim]) const {
    LAHAR_UNROLL
    for (int b = 0; b < Dim; ++b) {
      auto sum = load<PackOf<4>>(d[b][0]);
      LAHAR_UNROLL
      for (int c = 1; c < face_corners<Dim>; ++c) sum += load<PackOf<4>>(d[b][c]);
      sum *= 1.0 / face_corners<Dim>;
      LAHAR_UNROLL
      for (int a = 0; a < Dim; ++a) G[a][b] = sum[a];
    }
  }
};

/// Inverse of a small matrix whose entries are packs, times a factor.
template <class Real>
LAHAR_INLINE void inverse(const Real (&J)[2][2], Real (&inv)[2][2], double factor = 1.0) {
  const Real det = J[0][0] * J[1][1] - J[0][1] * J[1][0];
  const Real r = factor / det;
  inv[0][0] = J[1][1] * r;
  inv[0][1] = -J[0][1] * r;
  inv[1][0] = -J[1][0] * r;
  inv[1][1] = J[0][0] * r;
}

template <class Real>
LAHAR_INLINE void inverse(const Real (&J)[3][3], Real (&inv)[3][3], double factor = 1.0) {
  const Real c00 = J[1][1] * J[2][2] - J[1][2] * J[2][1];
  const Real c10 = J[1][2] * J[2][0] - J[1][0] * J[2][2];
  const Real c20 = J[1][0] * J[2][1] - J[1][1] * J[2][0];
  const Real det = J[0][0] * c00 + J[0][1] * c10 + J[0][2] * c20;
  const Real r = factor / det;
  inv[0][0] = c00 * r;
  inv[0][1] = (J[0][2] * J[2][1] - J[0][1] * J[2][2]) * r;
  inv[0][2] = (J[0][1] * J[1][2] - J[0][2] * J[1][1]) * r;
  inv[1][0] = c10 * r;
  inv[1][1] = (J[0][0] * J[2][2] - J[0][2] * J[2][0]) * r;
  inv[1][2] = (J[0][2] * J[1][0] - J[0][0] * J[1][2]) * r;
  inv[2][0] = c20 * r;
  inv[2][1] = (J[0][1] * J[2][0] - J[0][0] * J[2][1]) * r;
  inv[2][2] = (J[0][0] * J[1][1] - J[0][1] * J[1][0]) * r;
}

}  // namespace lahar
