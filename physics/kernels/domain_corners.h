/// \file Corners of particles' domains (CPDI), for kernels that go through particles one by one and
/// whose lanes are components of nodes: of the nodes around a cell, corners need few.
#pragma once

#include <cstdint>

#include "physics/basis/basis.h"

namespace lahar::general {

/// The corners of the domains of a pack of particles. At a corner functions are products: that of
/// the first axis is `along` for the second node of the cell that the corner is in, and 1 - along
/// for the first.
template <int Dim, class Real>
struct DomainCorners {
  static constexpr int n = corners<Dim>, n_across = face_corners<Dim>;

  alignas(64) double along[n][lanes<Real>];
  alignas(64) double across[n][n_across][lanes<Real>];  ///< products of those of the other axes
  std::int32_t cell[n][lanes<Real>];                    ///< number of the cell

  /// Functions at corner c are multiplied by `weight(c)`. Cells are numbered with `stride` along
  /// the axes, from that before the particle's along all of them.
  template <class Basis, class Domain, class Weight>
  LAHAR_INLINE void set(const Basis& basis, const Real (&s)[Dim], const Domain& domain,
                        const int (&stride)[Dim], Weight weight) {
    Real x[n][Dim];
    places(s, domain, x);
    int middle = 0;
    for (const int along_axis : stride) middle += along_axis;
    LAHAR_UNROLL
    for (int c = 0; c < n; ++c) {
      Real number(middle);
      LAHAR_UNROLL
      for (int d = 0; d < Dim; ++d) {
        const Real away = basis.cells_away(x[c][d], d);
        x[c][d] -= away;
        number += stride[d] * away;
      }
      store(x[c][0], along[c]);
      Real product[n_across] = {};
      product[0] = weight(c);
      LAHAR_UNROLL
      for (int d = 1; d < Dim; ++d) LAHAR_UNROLL
      for (int k = 0; k < 1 << (d - 1); ++k) {
        product[k | 1 << (d - 1)] = product[k] * x[c][d];
        product[k] = product[k] * (1.0 - x[c][d]);
      }
      LAHAR_UNROLL
      for (int k = 0; k < n_across; ++k) store(product[k], across[c][k]);
      alignas(64) double numbers[lanes<Real>];
      store(number, numbers);
      for (int j = 0; j < lanes<Real>; ++j) cell[c][j] = static_cast<std::int32_t>(numbers[j]);
    }
  }

 private:
  template <class Domain>
  LAHAR_INLINE static void places(const Real (&s)[Dim], const Domain& domain, Real (&x)[n][Dim]) {
    LAHAR_UNROLL
    for (int c = 0; c < n; ++c) LAHAR_UNROLL
    for (int d = 0; d < Dim; ++d) x[c][d] = s[d] + domain.corner(c, d);
  }
  /// From partial sums.
  LAHAR_INLINE static void places(const Real (&s)[Dim], const Parallelepiped<Dim, Real>& domain,
                                  Real (&x)[n][Dim]) {
    LAHAR_UNROLL
    for (int d = 0; d < Dim; ++d) x[0][d] = s[d];
    LAHAR_UNROLL
    for (int k = Dim - 1; k >= 0; --k) LAHAR_UNROLL
    for (int c = 0; c < n; c += 2 << k) LAHAR_UNROLL
    for (int d = 0; d < Dim; ++d) {
      x[c | 1 << k][d] = x[c][d] + domain.r[k][d];
      x[c][d] -= domain.r[k][d];
    }
  }
};

/// Slopes of a domain's functions are sums over its edges, with the corner's sign along each: those
/// of opposite faces of a parallelepiped are the same but for it. Dim vectors for all corners.
template <int Dim, class Real>
struct EdgeSlopes {
  Real of_edge[Dim][Dim];  ///< [k][d]: of edge k, along axis d

  template <class Basis>
  LAHAR_INLINE EdgeSlopes(const Basis& basis, const Parallelepiped<Dim, Real>& domain) {
    Real J[Dim][Dim];
    LAHAR_UNROLL
    for (int k = 0; k < Dim; ++k) LAHAR_UNROLL
    for (int d = 0; d < Dim; ++d) J[d][k] = domain.r[k][d];
    inverse(J, of_edge, 1.0 / corners<Dim>);
    LAHAR_UNROLL
    for (int k = 0; k < Dim; ++k) LAHAR_UNROLL
    for (int d = 0; d < Dim; ++d) of_edge[k][d] *= basis.map.per_length[d];
  }
};

template <class Domain>
inline constexpr bool is_parallelepiped = false;
template <int Dim, class Real>
inline constexpr bool is_parallelepiped<Parallelepiped<Dim, Real>> = true;

/// sum + a, or sum - a where corner c has the minus side of edge k.
template <class Real>
LAHAR_INLINE Real add_signed(const Real& sum, const Real& a, int c, int k) {
  return c >> k & 1 ? sum + a : sum - a;
}

/// Call body(cells) with what makes the bases of a patch whose particles have domains with corners.
template <int Dim, class Body>
LAHAR_INLINE void with_domains(const Patch<Dim>& patch, Body body) {
  if (patch.basis == BasisKind::cpdi)
    body(CpdiCells<Dim, Parallelepiped, Column::vectors>(patch));
  else
    body(CpdiCells<Dim, Hexahedron, Column::corners>(patch));
}

}  // namespace lahar::general
