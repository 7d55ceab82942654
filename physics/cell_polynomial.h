/// \file The map of a Q4 or H8 cell as a polynomial in its natural coordinates, for packs of
/// particles: position, Jacobian and inverse map.
///
/// x(xi) = X + sum over m of c[m] prod (xi_d whose bit d is set in m), with X the cell's corner 0:
/// differences to a corner keep full precision far from the origin. Sums of products are written
/// with fma(), so that a particle's result is the same, to the last bit, in a pack of any width.
#pragma once

#include "physics/patch.h"
#include "physics/simd.h"

namespace lahar {

/// A lane has converged when |Newton step| |last correction of it| is below this [natural
/// coordinates, squared]. It is the error left, but for a factor of about twice the cell's
/// distortion (0 in a parallelogram, 1 where a cell is about to fold).
inline constexpr double pack_error_tolerance = 1e-16;
/// Corrections of a step: three suffice for one step where a particle moved 1e-3 of its cell.
inline constexpr int pack_corrections = 3;
/// Steps after which a lane counts as not converged; two to four are needed from anywhere in a
/// cell.
inline constexpr int pack_max_steps = 8;
/// Only within this [natural coordinates] is a pack's result final: nearer to a face the mesh's own
/// map decides, whose rounding is other, so that both agree on who owns a particle on a face.
inline constexpr double pack_clear_of_faces = 1.0 - 1e-10;

/// a b - c d.
template <int W>
LAHAR_INLINE PackOf<W> difference_of_products(PackOf<W> a, PackOf<W> b, PackOf<W> c, PackOf<W> d) {
  return fma(a, b, -(c * d));
}

/// |v|^2.
template <int Dim, class Real>
LAHAR_INLINE Real norm2(const Real (&v)[Dim]) {
  Real sum = v[0] * v[0];
  for (int d = 1; d < Dim; ++d) sum = fma(v[d], v[d], sum);
  return sum;
}

/// Values at the corners, in tensor order, become coefficients of the polynomial: half the sums and
/// differences along one axis after the other.
template <int Dim, class Values>
LAHAR_INLINE void corners_to_coefficients(Values& at) {
  using Value = std::decay_t<decltype(at[0])>;
  LAHAR_UNROLL
  for (int bit = 1; bit < corners<Dim>; bit *= 2) LAHAR_UNROLL
  for (int a = 0; a < corners<Dim>; ++a) {
    if (a & bit) continue;
    const Value low = 0.5 * at[a], high = 0.5 * at[a | bit];
    at[a] = low + high;
    at[a | bit] = high - low;
  }
}

template <int Dim>
struct CellPolynomial {
  double origin[4];                       ///< X [m]
  alignas(32) double c[corners<Dim>][4];  ///< [m]
  double det[3];  ///< 2D only: det J = det[0] + det[1] xi_0 + det[2] xi_1 [m^2]

  /// `node_position`: four doubles by local node; `corner` in tensor order.
  LAHAR_INLINE CellPolynomial(const double* node_position,
                              const std::array<Local, corners<Dim>>& corner) {
    using Vector = PackOf<4>;
    const auto position = [&](std::size_t a) {
      return load<Vector>(node_position + 4 * static_cast<std::ptrdiff_t>(corner[a]));
    };
    Vector at[corners<Dim>];
    at[0] = Vector(0.0);
    LAHAR_UNROLL
    for (std::size_t a = 1; a < corners<Dim>; ++a) at[a] = position(a) - position(0);
    corners_to_coefficients<Dim>(at);
    store(position(0), origin);
    LAHAR_UNROLL
    for (int m = 0; m < corners<Dim>; ++m) store(at[m], c[m]);
    if constexpr (Dim == 2) {
      const auto cross = [this](int i, int j) {
        return difference_of_products(Scalar(c[i][0]), Scalar(c[j][1]), Scalar(c[i][1]),
                                      Scalar(c[j][0]))[0];
      };
      det[0] = cross(1, 2);
      det[1] = cross(1, 3);
      det[2] = cross(3, 2);
    }
  }

  /// J[i][k] = dx_i/dxi_k [m].
  template <class Real>
  LAHAR_INLINE void jacobian(const Real (&xi)[Dim], Real (&J)[Dim][Dim]) const {
    LAHAR_UNROLL
    for (int i = 0; i < Dim; ++i) {
      if constexpr (Dim == 2) {
        J[i][0] = fma(xi[1], at<Real>(3, i), at<Real>(1, i));
        J[i][1] = fma(xi[0], at<Real>(3, i), at<Real>(2, i));
      } else {
        Real mixed[3];
        second_derivatives(xi, i, mixed);
        J[i][0] = fma(xi[2], mixed[1], fma(xi[1], at<Real>(3, i), at<Real>(1, i)));
        J[i][1] = fma(xi[2], mixed[2], fma(xi[0], at<Real>(3, i), at<Real>(2, i)));
        J[i][2] = fma(xi[1], mixed[2], fma(xi[0], at<Real>(5, i), at<Real>(4, i)));
      }
    }
  }

  /// det J [m^2], a linear function in 2D: the products of the two coordinates cancel.
  template <class Real>
  LAHAR_INLINE Real determinant(const Real (&xi)[2]) const {
    return fma(xi[1], Real(det[2]), fma(xi[0], Real(det[1]), Real(det[0])));
  }

  /// d2x_i/dxi_0 dxi_1, dxi_0 dxi_2, dxi_1 dxi_2 [m].
  template <class Real>
  LAHAR_INLINE void second_derivatives(const Real (&xi)[3], int i, Real (&mixed)[3]) const {
    mixed[0] = fma(xi[2], at<Real>(7, i), at<Real>(3, i));
    mixed[1] = fma(xi[1], at<Real>(7, i), at<Real>(5, i));
    mixed[2] = fma(xi[0], at<Real>(7, i), at<Real>(6, i));
  }

  template <class Real>
  LAHAR_INLINE Real at(int m, int i) const {
    return Real(c[m][i]);
  }
};

/// One step of the inverse map: xi - y. With Newton's step s, exactly
///   x(xi - y) - x = J (s - y) + g(y),
/// g being the polynomial's terms of second and (3D) third order. So y = s + J^-1 g(y), which is
/// iterated a fixed number of times at the cost of one reciprocal: each correction gains as many
/// digits as the first. `offset` = c[0] + X - x.
template <int Dim, class Real>
struct InverseStep {
  Real s[Dim], y[Dim];
  Real last[Dim];  ///< last correction of y
};

/// 2D: g = c[3] y_0 y_1, and J^-1 c[3] has the factors of det J for numerators.
template <class Real>
LAHAR_INLINE InverseStep<2, Real> inverse_step(const CellPolynomial<2>& cell,
                                               const Real (&offset)[2], const Real (&xi)[2]) {
  Real J[2][2], f[2];
  cell.jacobian(xi, J);
  LAHAR_UNROLL
  for (int i = 0; i < 2; ++i) f[i] = fma(xi[1], J[i][1], fma(xi[0], Real(cell.c[1][i]), offset[i]));
  const Real r = reciprocal(cell.determinant(xi));
  InverseStep<2, Real> step;
  auto& y = step.y;
  y[0] = step.s[0] = difference_of_products(J[1][1], f[0], J[0][1], f[1]) * r;
  y[1] = step.s[1] = difference_of_products(J[0][0], f[1], J[1][0], f[0]) * r;
  const Real bend[2] = {cell.det[2] * r, cell.det[1] * r};
  LAHAR_UNROLL
  for (int k = 0; k < pack_corrections; ++k) {
    const Real product = y[0] * y[1];
    LAHAR_UNROLL
    for (int d = 0; d < 2; ++d) {
      const Real before = y[d];
      y[d] = fma(bend[d], product, step.s[d]);
      step.last[d] = y[d] - before;
    }
  }
  return step;
}

template <class Real>
LAHAR_INLINE InverseStep<3, Real> inverse_step(const CellPolynomial<3>& cell,
                                               const Real (&offset)[3], const Real (&xi)[3]) {
  Real J[3][3], f[3], mixed[3][3];
  LAHAR_UNROLL
  for (int i = 0; i < 3; ++i) {
    const auto c = [&](int m) { return Real(cell.c[m][i]); };
    cell.second_derivatives(xi, i, mixed[i]);
    const Real edge = fma(xi[0], c(3), c(2));
    J[i][0] = fma(xi[2], mixed[i][1], fma(xi[1], c(3), c(1)));
    J[i][1] = fma(xi[2], mixed[i][2], edge);
    J[i][2] = fma(xi[1], mixed[i][2], fma(xi[0], c(5), c(4)));
    f[i] = fma(xi[2], J[i][2], fma(xi[1], edge, fma(xi[0], c(1), offset[i])));
  }
  // Row k: the cross product of the Jacobian's other two columns, det J times a row of its inverse.
  Real adjugate[3][3];
  LAHAR_UNROLL
  for (int k = 0; k < 3; ++k) {
    const int a = (k + 1) % 3, b = (k + 2) % 3;
    LAHAR_UNROLL
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, l = (i + 2) % 3;
      adjugate[k][i] = difference_of_products(J[j][a], J[l][b], J[l][a], J[j][b]);
    }
  }
  const auto dot = [&](int k, const Real(&v)[3]) {
    return fma(adjugate[k][2], v[2], fma(adjugate[k][1], v[1], adjugate[k][0] * v[0]));
  };
  const Real column[3] = {J[0][0], J[1][0], J[2][0]};
  const Real r = reciprocal(dot(0, column));
  InverseStep<3, Real> step;
  auto& y = step.y;
  for (int d = 0; d < 3; ++d) y[d] = step.s[d] = dot(d, f) * r;
  LAHAR_UNROLL
  for (int k = 0; k < pack_corrections; ++k) {
    const Real y01 = y[0] * y[1], y02 = y[0] * y[2], y12 = y[1] * y[2], y012 = y01 * y[2];
    Real g[3];
    LAHAR_UNROLL
    for (int i = 0; i < 3; ++i)
      g[i] = fma(mixed[i][0], y01, mixed[i][1] * y02) +
             fma(mixed[i][2], y12, -(Real(cell.c[7][i]) * y012));
    LAHAR_UNROLL
    for (int d = 0; d < 3; ++d) {
      const Real before = y[d];
      y[d] = fma(dot(d, g), r, step.s[d]);
      step.last[d] = y[d] - before;
    }
  }
  return step;
}

/// Natural coordinates of the first n lanes' points x [m], from the start that xi holds. Returns a
/// bit for each of these lanes that did not converge; their xi is the start. A lane stops by its
/// own criterion, so that its result does not depend on the others, whatever they hold; but it
/// depends, by rounding, on its start.
template <int Dim, class Real>
LAHAR_INLINE unsigned inverse_map_pack(const CellPolynomial<Dim>& cell, const Real (&x)[Dim],
                                       Real (&xi)[Dim], Local n) {
  constexpr double tolerance2 = pack_error_tolerance * pack_error_tolerance;
  Real offset[Dim], start[Dim];
  for (int d = 0; d < Dim; ++d) {
    offset[d] = cell.c[0][d] - (x[d] - cell.origin[d]);
    start[d] = xi[d];
  }
  unsigned open = n >= lanes<Real> ? (1u << lanes<Real>)-1 : (1u << n) - 1;
  for (int count = 0; count < pack_max_steps && open != 0; ++count) {
    const auto step = inverse_step(cell, offset, xi);
    for (int d = 0; d < Dim; ++d) xi[d] = select(open, xi[d] - step.y[d], xi[d]);
    open &= outside(norm2(step.s) * norm2(step.last), tolerance2, n);
  }
  if (open != 0)
    for (int d = 0; d < Dim; ++d) xi[d] = select(open, start[d], xi[d]);
  return open;
}

}  // namespace lahar
