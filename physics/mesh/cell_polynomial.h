/// \file The map of a Q4 or H8 cell as a polynomial in its natural coordinates, for packs of
/// particles: position, Jacobian and inverse map.
///
/// x(xi) = X + sum over m of c[m] prod (xi_d whose bit d is set in m), with X the cell's corner 0:
/// differences to a corner keep full precision far from the origin. All that follows from it is
/// kept in units of 1 / corners: nothing need be scaled then. Sums of products are written with
/// fma(), so that a particle's result is the same, to the last bit, in a pack of any width.
#pragma once

#include "physics/base/simd.h"
#include "physics/base/types.h"

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

/// Values at the corners, in tensor order, become the coefficients of the polynomial, times the
/// number of corners: sums and differences along one axis after the other.
template <int Dim, class Values>
LAHAR_INLINE void corners_to_coefficients(Values& at) {
  using Value = std::decay_t<decltype(at[0])>;
  LAHAR_UNROLL
  for (int bit = 1; bit < corners<Dim>; bit *= 2) LAHAR_UNROLL
  for (int a = 0; a < corners<Dim>; ++a) {
    if (a & bit) continue;
    const Value low = at[a], high = at[a | bit];
    at[a] = low + high;
    at[a | bit] = high - low;
  }
}

template <int Dim>
struct CellPolynomial {
  double origin[4];                       ///< X [m]
  alignas(32) double c[corners<Dim>][4];  ///< corners times c [m]
  /// 2D only: corners^2 times det J = det[0] + det[1] xi_0 + det[2] xi_1 [m^2]
  double det[3];

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

  /// J[i][k] = corners times dx_i/dxi_k [m].
  template <class Real>
  LAHAR_INLINE void scaled_jacobian(const Real (&xi)[Dim], Real (&J)[Dim][Dim]) const {
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

  /// corners^2 times det J [m^2], a linear function in 2D: the products of the two coordinates
  /// cancel.
  template <class Real>
  LAHAR_INLINE Real determinant(const Real (&xi)[2]) const {
    return fma(xi[1], Real(det[2]), fma(xi[0], Real(det[1]), Real(det[0])));
  }

  /// corners times d2x_i/dxi_0 dxi_1, dxi_0 dxi_2, dxi_1 dxi_2 [m].
  template <class Real>
  LAHAR_INLINE void second_derivatives(const Real (&xi)[3], int i, Real (&mixed)[3]) const {
    mixed[0] = fma(xi[2], at<Real>(7, i), at<Real>(3, i));
    mixed[1] = fma(xi[1], at<Real>(7, i), at<Real>(5, i));
    mixed[2] = fma(xi[0], at<Real>(7, i), at<Real>(6, i));
  }

  /// corners times (x(0) - x) [m].
  template <class Real>
  LAHAR_INLINE void offset_from(const Real (&x)[Dim], Real (&offset)[Dim]) const {
    LAHAR_UNROLL
    for (int d = 0; d < Dim; ++d)
      offset[d] = fma(x[d] - broadcast<Real>(&origin[d]), Real(-corners<Dim>), at<Real>(0, d));
  }

  template <class Real>
  LAHAR_INLINE Real at(int m, int i) const {
    return broadcast<Real>(&c[m][i]);
  }
};

/// One step of the inverse map, to xi - y. With Newton's step s, exactly
///   x(xi - y) - x = J (s - y) + g(y),
/// g being the polynomial's terms of second and (3D) third order. So y = s + J^-1 g(y), which is
/// iterated at the cost of one reciprocal: each correction gains as many digits as the first. A
/// lane is corrected as often as its own s demands. Lanes that hardly moved need no correction, nor
/// the last digits of s: `refine(s)` is to add them before the first. `bend(y, s, to)` finds
/// s + J^-1 g(y).
/// y comes as s; `open` keeps the bits of lanes that need another step.
template <int Dim, class Real, class Refine, class Bend>
LAHAR_INLINE void correct_step(Real (&y)[Dim], unsigned& open, Refine refine, Bend bend) {
  constexpr double tolerance2 = pack_error_tolerance * pack_error_tolerance;
  // |s| up to which 0, 1, 2 corrections leave an error below the tolerance: |s|^(k + 2) is.
  constexpr double enough[pack_corrections] = {1e-8, 4.6e-6, 1e-4};
  const Real s2 = norm2(y);
  open &= outside(s2, enough[0] * enough[0], lanes<Real>);
  if (open == 0) return;
  Real s[Dim], change[Dim];
  LAHAR_UNROLL
  for (int d = 0; d < Dim; ++d) s[d] = y[d];
  refine(s);
  LAHAR_UNROLL
  for (int d = 0; d < Dim; ++d) y[d] = select(open, s[d], y[d]);
  unsigned correcting = open;
  LAHAR_UNROLL
  for (int k = 0; k < pack_corrections; ++k) {
    if (k > 0) correcting = open & outside(s2, enough[k] * enough[k], lanes<Real>);
    if (correcting == 0) return void(open = 0);
    Real corrected[Dim];
    bend(y, s, corrected);
    LAHAR_UNROLL
    for (int d = 0; d < Dim; ++d) {
      change[d] = corrected[d] - y[d];
      y[d] = select(correcting, corrected[d], y[d]);
    }
  }
  open = correcting & outside(Real(s2 * norm2(change)), tolerance2, lanes<Real>);
}

/// r ~ 1 / x to the last digits, from eight, and with it multiples of r.
template <int Dim, class Real>
LAHAR_INLINE void refine_reciprocal(const Real& x, Real& r, Real (&multiples)[Dim]) {
  const Real error = fma(-x, r, Real(1.0));
  r = fma(r, error, r);
  LAHAR_UNROLL
  for (int d = 0; d < Dim; ++d) multiples[d] = fma(multiples[d], error, multiples[d]);
}

/// 2D: g = c[3] y_0 y_1, and J^-1 c[3] has the factors of det J for numerators.
template <class Real>
LAHAR_INLINE void inverse_step(const CellPolynomial<2>& cell, const Real (&offset)[2],
                               const Real (&xi)[2], Real (&y)[2], unsigned& open) {
  Real J[2][2], f[2];
  cell.scaled_jacobian(xi, J);
  LAHAR_UNROLL
  for (int i = 0; i < 2; ++i)
    f[i] = fma(xi[1], J[i][1], fma(xi[0], cell.at<Real>(1, i), offset[i]));
  const Real det = cell.determinant(xi);
  Real r = reciprocal_estimate(det);
  y[0] = difference_of_products(J[1][1], f[0], J[0][1], f[1]) * r;
  y[1] = difference_of_products(J[0][0], f[1], J[1][0], f[0]) * r;
  correct_step(
      y, open, [&](Real(&s)[2]) { refine_reciprocal(det, r, s); },
      [&](const Real(&at)[2], const Real(&s)[2], Real(&to)[2]) {
        const Real product = at[0] * at[1] * r;
        to[0] = fma(product, Real(cell.det[2]), s[0]);
        to[1] = fma(product, Real(cell.det[1]), s[1]);
      });
}

template <class Real>
LAHAR_INLINE void inverse_step(const CellPolynomial<3>& cell, const Real (&offset)[3],
                               const Real (&xi)[3], Real (&y)[3], unsigned& open) {
  Real J[3][3], f[3], mixed[3][3];
  LAHAR_UNROLL
  for (int i = 0; i < 3; ++i) {
    const auto c = [&](int m) __attribute__((always_inline)) {
      return cell.at<Real>(m, i);
    };
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
  const Real det = dot(0, column);
  Real r = reciprocal_estimate(det);
  for (int d = 0; d < 3; ++d) y[d] = dot(d, f) * r;
  correct_step(
      y, open, [&](Real(&s)[3]) { refine_reciprocal(det, r, s); },
      [&](const Real(&at)[3], const Real(&s)[3], Real(&to)[3]) {
        const Real y01 = at[0] * at[1], y02 = at[0] * at[2], y12 = at[1] * at[2],
                   y012 = y01 * at[2];
        Real second[3];
        LAHAR_UNROLL
        for (int i = 0; i < 3; ++i)
          second[i] = fma(mixed[i][0], y01, mixed[i][1] * y02) +
                      fma(mixed[i][2], y12, -(cell.at<Real>(7, i) * y012));
        LAHAR_UNROLL
        for (int k = 0; k < 3; ++k) to[k] = fma(dot(k, second), r, s[k]);
      });
}

/// Natural coordinates of the first n lanes' points x [m], from the start that xi holds; beyond
/// them xi stays as it is. Returns a bit for each of these lanes that did not converge; their xi is
/// of no use. A lane stops by its own criterion, so that its result does not depend on the others,
/// whatever they hold; but it depends, by rounding, on its start.
template <int Dim, class Real>
LAHAR_INLINE unsigned inverse_map_pack(const CellPolynomial<Dim>& cell, const Real (&x)[Dim],
                                       Real (&xi)[Dim], Local n) {
  Real offset[Dim];
  cell.offset_from(x, offset);
  unsigned open = first_bits<Real>(n);
  for (int count = 0; count < pack_max_steps && open != 0; ++count) {
    const unsigned moving = open;
    Real y[Dim];
    inverse_step(cell, offset, xi, y, open);
    LAHAR_UNROLL
    for (int d = 0; d < Dim; ++d)  // y may be a product: see fma()
      xi[d] = select(moving, fma(y[d], Real(-1.0), xi[d]), xi[d]);
  }
  return open;
}

}  // namespace lahar
