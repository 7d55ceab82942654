/// \file Quadratic Bernstein polynomials on cells of T6, Q9 and H27: functions of second order that
/// are nowhere negative.
///
/// They span the same space as Lagrange's functions, sum to one, and reproduce linear fields from
/// values at the cell's control points (Farin 2002, Curves and Surfaces for CAGD, chap. 5 and 17).
/// Corners are their own control points; those of other nodes are the nodes where edges are
/// straight and nodes lie in their middles. Nodal masses are sums of positive numbers, so that a
/// node moves with the material around it however few particles there are. Lagrange's functions are
/// negative in parts: masses of nodes come near zero, or below, when particles move, and velocities
/// without bound with them (Andersen & Andersen 2010).
#pragma once

#include "physics/mesh/element.h"

namespace lahar {

/// Elements whose functions have positive ones in their place.
constexpr bool has_bernstein(Element e) {
  return e == Element::T6 || e == Element::Q9 || e == Element::H27;
}

/// The interface of Shape<E>.
template <Element E>
struct Bernstein {
  static_assert(has_bernstein(E));
  static constexpr int dim = info(E).dim, nodes = info(E).nodes;

  template <class Real>
  LAHAR_INLINE static void values(const Real (&xi)[dim], Real (&N)[nodes]) {
    if constexpr (info(E).simplex) {
      Real b[dim + 1];
      barycentric(xi, b);
      LAHAR_UNROLL
      for (int a = 0; a < nodes; ++a) {
        const auto [i, j] = ends(a);
        N[a] = i == j ? b[i] * b[i] : 2.0 * b[i] * b[j];
      }
    } else {
      Real l[dim][3], g[dim][3];
      axes(xi, l, g);
      LAHAR_UNROLL
      for (int a = 0; a < nodes; ++a) {
        N[a] = l[0][place(a, 0)];
        LAHAR_UNROLL
        for (int d = 1; d < dim; ++d) N[a] *= l[d][place(a, d)];
      }
    }
  }

  template <class Real>
  LAHAR_INLINE static void gradients(const Real (&xi)[dim], Real (&dN)[nodes][dim]) {
    if constexpr (info(E).simplex) {
      Real b[dim + 1];
      barycentric(xi, b);
      LAHAR_UNROLL
      for (int a = 0; a < nodes; ++a) LAHAR_UNROLL
      for (int d = 0; d < dim; ++d) {
        const auto [i, j] = ends(a);
        dN[a][d] =
            i == j ? (2.0 * slope(i, d)) * b[i] : 2.0 * (slope(i, d) * b[j] + slope(j, d) * b[i]);
      }
    } else {
      Real l[dim][3], g[dim][3];
      axes(xi, l, g);
      LAHAR_UNROLL
      for (int a = 0; a < nodes; ++a) LAHAR_UNROLL
      for (int d = 0; d < dim; ++d) {
        dN[a][d] = d == 0 ? g[0][place(a, 0)] : l[0][place(a, 0)];
        LAHAR_UNROLL
        for (int e = 1; e < dim; ++e) dN[a][d] *= e == d ? g[e][place(a, e)] : l[e][place(a, e)];
      }
    }
  }

  /// Control points with which these functions map natural coordinates to the same places as
  /// Lagrange's do with the nodes x (`Width` doubles each), in their place.
  template <int Width>
  static void to_control_points(double (&x)[nodes][Width]) {
    if constexpr (info(E).simplex) {
      for (int a = dim + 1; a < nodes; ++a)
        for (int k = 0; k < Width; ++k)
          x[a][k] = 2.0 * x[a][k] - 0.5 * (x[ends(a)[0]][k] + x[ends(a)[1]][k]);
    } else {
      for (int d = 0; d < dim; ++d)
        for (int a = 0; a < nodes; ++a) {
          if (place(a, d) != 1) continue;
          const int first = beside(a, d, 0), last = beside(a, d, 2);
          for (int k = 0; k < Width; ++k)
            x[a][k] = 2.0 * x[a][k] - 0.5 * (x[first][k] + x[last][k]);
        }
    }
  }

 private:
  /// Side of axis d on which node a lies: 0 minus, 1 middle, 2 plus.
  static constexpr int place(int a, int d) {
    return detail::node_place(E, a)[static_cast<std::size_t>(d)] + 1;
  }
  /// The node at the same places as a but on `side` of axis d.
  static constexpr int beside(int a, int d, int side) {
    for (int b = 0; b < nodes; ++b) {
      bool same = true;
      for (int e = 0; e < dim; ++e) same &= place(b, e) == (e == d ? side : place(a, e));
      if (same) return b;
    }
    return -1;
  }
  template <class Real>
  LAHAR_INLINE static void axes(const Real (&xi)[dim], Real (&l)[dim][3], Real (&g)[dim][3]) {
    LAHAR_UNROLL
    for (int d = 0; d < dim; ++d) {
      const Real plus = 0.5 + 0.5 * xi[d], minus = 0.5 - 0.5 * xi[d];
      l[d][0] = minus * minus;
      l[d][1] = 2.0 * minus * plus;
      l[d][2] = plus * plus;
      g[d][0] = -1.0 * minus;
      g[d][1] = -1.0 * xi[d];
      g[d][2] = plus;
    }
  }
  template <class Real>
  LAHAR_INLINE static void barycentric(const Real (&xi)[dim], Real (&b)[dim + 1]) {
    b[0] = 1.0 - xi[0];
    b[1] = xi[0];
    LAHAR_UNROLL
    for (int d = 1; d < dim; ++d) b[0] -= xi[d], b[d + 1] = xi[d];
  }
  static constexpr double slope(int k, int d) { return k == 0 ? -1.0 : k == d + 1 ? 1.0 : 0.0; }
  /// The corners between which node a of a triangle lies; twice the node if it is one.
  static constexpr std::array<int, 2> ends(int a) {
    if (a <= dim) return {a, a};
    return {a - 3, (a - 2) % 3};
  }
};

}  // namespace lahar
