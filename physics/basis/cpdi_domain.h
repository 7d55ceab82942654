/// \file The domains of CPDI: which corners a particle's domain has, and what they weigh in its
/// functions and gradients. Lengths may be scaled by any factor along each axis.
///
/// Functions interpolate linearly (2D: bilinearly, 3D: trilinearly) what is at the corners, so that
/// the mean of any field over the domain is sum_c w_c q(x_c), and that of its gradient is
/// sum_c slope_c q(x_c). Corner c lies on the plus side of the domain's axis k if bit k is set.
#pragma once

#include "physics/base/simd.h"
#include "physics/mesh/cell_polynomial.h"
#include "physics/mesh/inverse_mapping.h"
#include "physics/mesh/shape.h"

namespace lahar {

/// A parallelogram or parallelepiped: r are halves of its edges (Sadeghirad, Brannon & Burghardt
/// 2011). All corners weigh the same in its functions.
template <int Dim, class Real>
struct Parallelepiped {
  static constexpr int vectors = Dim;
  Real r[vectors][Dim];

  LAHAR_INLINE Real corner(int c, int d) const {
    Real x = corner_sign(c, 0) * r[0][d];
    LAHAR_UNROLL
    for (int k = 1; k < Dim; ++k) x += corner_sign(c, k) * r[k][d];
    return x;
  }
  /// How far corners lie from the middle along axis d.
  LAHAR_INLINE Real extent(int d) const {
    Real sum(0.0);
    LAHAR_UNROLL
    for (int k = 0; k < Dim; ++k) sum += max(r[k][d], -r[k][d]);
    return sum;
  }
  LAHAR_INLINE void weights(Real (&w)[corners<Dim>]) const {
    LAHAR_UNROLL
    for (Real& weight : w) weight = Real(1.0 / corners<Dim>);
  }
  /// Times the unit of length along each axis.
  LAHAR_INLINE void slopes(Real (&slope)[corners<Dim>][Dim]) const {
    Real J[Dim][Dim], inv[Dim][Dim];
    LAHAR_UNROLL
    for (int k = 0; k < Dim; ++k) LAHAR_UNROLL
    for (int d = 0; d < Dim; ++d) J[d][k] = r[k][d];
    inverse(J, inv, 1.0 / corners<Dim>);
    LAHAR_UNROLL
    for (int c = 0; c < corners<Dim>; ++c) LAHAR_UNROLL
    for (int d = 0; d < Dim; ++d) {
      slope[c][d] = corner_sign(c, 0) * inv[0][d];
      LAHAR_UNROLL
      for (int k = 1; k < Dim; ++k) slope[c][d] += corner_sign(c, k) * inv[k][d];
    }
  }
};

/// A general quadrilateral or hexahedron (CPDI2: Sadeghirad, Brannon & Guilkey 2013): r are the
/// corners from a point inside. Weights are integrals over the domain's (bi- or trilinear) map from
/// the square or cube xi in [-1, 1]^Dim, with det J of the map:
///     V = int det J dxi,  w_c = 1/V int S_c det J dxi,  slope_c = 1/V int cof(J) grad_xi S_c dxi,
/// which are exact here.
template <int Dim, class Real>
struct Hexahedron;

/// With x = c_0 + c_1 xi + c_2 eta + c_12 xi eta, det J is linear:
///     V = 4 J,  w = 1/4 (1 +- (c_1 x c_12) / (3 J) +- (c_12 x c_2) / (3 J)),  J = c_1 x c_2,
/// and slopes are those of the parallelogram with halves c_1 and c_2 of edges.
template <class Real>
struct Hexahedron<2, Real> {
  static constexpr int vectors = corners<2>;
  Real r[vectors][2];

  LAHAR_INLINE Real corner(int c, int d) const { return r[c][d]; }
  LAHAR_INLINE Real extent(int d) const {
    Real most(0.0);
    LAHAR_UNROLL
    for (int c = 0; c < vectors; ++c) most = max(most, max(r[c][d], -r[c][d]));
    return most;
  }
  /// Returns the volume.
  LAHAR_INLINE Real weights(Real (&w)[corners<2>]) const {
    const auto [c1, c2] = edges();
    Real c12[2];
    LAHAR_UNROLL
    for (int d = 0; d < 2; ++d) c12[d] = 0.25 * ((r[0][d] + r[3][d]) - (r[1][d] + r[2][d]));
    const auto cross = [](const auto& a, const auto& b) __attribute__((always_inline)) {
      return difference_of_products(a[0], b[1], a[1], b[0]);
    };
    const Real J = cross(c1, c2), third = (1.0 / 3.0) / J;
    const Real along[2] = {cross(c1, c12) * third, cross(c12, c2) * third};
    LAHAR_UNROLL
    for (int c = 0; c < vectors; ++c)
      w[c] = 0.25 * (1.0 + (corner_sign(c, 0) * along[0] + corner_sign(c, 1) * along[1]));
    return 4.0 * J;
  }
  LAHAR_INLINE void weights_and_slopes(Real (&w)[corners<2>], Real (&slope)[corners<2>][2]) const {
    weights(w);
    slopes(slope);
  }
  LAHAR_INLINE void slopes(Real (&slope)[corners<2>][2]) const {
    const auto [c1, c2] = edges();
    Parallelepiped<2, Real>{{{c1[0], c1[1]}, {c2[0], c2[1]}}}.slopes(slope);
  }

 private:
  struct Edges {
    Real first[2], second[2];
  };
  LAHAR_INLINE Edges edges() const {
    Edges e;
    LAHAR_UNROLL
    for (int d = 0; d < 2; ++d) {
      e.first[d] = 0.25 * ((r[1][d] - r[0][d]) + (r[3][d] - r[2][d]));
      e.second[d] = 0.25 * ((r[2][d] - r[0][d]) + (r[3][d] - r[1][d]));
    }
    return e;
  }
};

/// By Gauss's rule of two points per axis: the integrands are of degree three at most in each
/// coordinate.
template <class Real>
struct Hexahedron<3, Real> {
  static constexpr int vectors = corners<3>;
  Real r[vectors][3];

  LAHAR_INLINE Real corner(int c, int d) const { return r[c][d]; }
  LAHAR_INLINE Real extent(int d) const {
    Real most(0.0);
    LAHAR_UNROLL
    for (int c = 0; c < vectors; ++c) most = max(most, max(r[c][d], -r[c][d]));
    return most;
  }
  /// Returns the volume. (Called, not inlined: sums are long, and in memory anyway.)
  [[gnu::noinline]] Real weights(Real (&w)[corners<3>]) const {
    Real cofactor[3][3][vectors];
    cofactors(cofactor, w);
    return to_weights(w);
  }
  [[gnu::noinline]] void slopes(Real (&slope)[corners<3>][3]) const {
    Real cofactor[3][3][vectors], J[vectors];
    cofactors(cofactor, J);
    to_slopes(cofactor, sum(J), slope);
  }
  [[gnu::noinline]] void weights_and_slopes(Real (&w)[corners<3>],
                                            Real (&slope)[corners<3>][3]) const {
    Real cofactor[3][3][vectors];
    cofactors(cofactor, w);
    const Real volume = to_weights(w);
    to_slopes(cofactor, volume, slope);
  }

 private:
  /// S of the nearer and of the further of two corners at a Gauss point, (1 +- 1/sqrt(3)) / 2.
  static constexpr double near = 0.78867513459481288225, far = 0.21132486540518711775;

  /// Takes values from corners to Gauss points along an axis, or integrals from Gauss points to
  /// corners. Where `at` does not depend on the axis `without`, its plus side is left as it is.
  LAHAR_INLINE static void sweep(Real (&at)[vectors], int k, int without = 3) {
    LAHAR_UNROLL
    for (int c = 0; c < vectors; ++c) {
      if (c >> k & 1 || c >> without & 1) continue;
      const Real low = at[c], high = at[c | 1 << k];
      at[c] = near * low + far * high;
      at[c | 1 << k] = far * low + near * high;
    }
  }
  LAHAR_INLINE static Real sum(const Real (&at)[vectors]) {
    return ((at[0] + at[1]) + (at[2] + at[3])) + ((at[4] + at[5]) + (at[6] + at[7]));
  }
  /// From determinants at Gauss points. Returns the volume.
  LAHAR_INLINE static Real to_weights(Real (&w)[vectors]) {
    const Real volume = sum(w), factor = 1.0 / volume;
    LAHAR_UNROLL
    for (int k = 0; k < 3; ++k) sweep(w, k);
    for (Real& weight : w) weight *= factor;
    return volume;
  }
  LAHAR_INLINE static void to_slopes(Real (&cofactor)[3][3][vectors], const Real& volume,
                                     Real (&slope)[vectors][3]) {
    const Real factor = 0.5 / volume;
    LAHAR_UNROLL
    for (int k = 0; k < 3; ++k) LAHAR_UNROLL
    for (int d = 0; d < 3; ++d) {
      // dS_c/dxi_k does not depend on xi_k.
      Real(&at)[vectors] = cofactor[k][d];
      LAHAR_UNROLL
      for (int c = 0; c < vectors; ++c)
        if (!(c >> k & 1)) at[c] = factor * (at[c] + at[c | 1 << k]);
      sweep(at, (k + 1) % 3, k);
      sweep(at, (k + 2) % 3, k);
      LAHAR_UNROLL
      for (int c = 0; c < vectors; ++c) {
        const Real part = at[c & ~(1 << k)];
        const Real signed_part = c >> k & 1 ? part : -part;
        slope[c][d] = k == 0 ? signed_part : slope[c][d] + signed_part;
      }
    }
  }
  /// [k][d][g]: derivatives of the determinant for dx_d/dxi_k at Gauss point g, and determinants.
  LAHAR_INLINE void cofactors(Real (&cofactor)[3][3][vectors], Real (&J)[vectors]) const {
    Real tangent[3][3][vectors];  // dx_d/dxi_k, which does not depend on xi_k
    LAHAR_UNROLL
    for (int k = 0; k < 3; ++k) LAHAR_UNROLL
    for (int d = 0; d < 3; ++d) {
      LAHAR_UNROLL
      for (int c = 0; c < vectors; ++c)
        if (!(c >> k & 1)) tangent[k][d][c] = 0.5 * (r[c | 1 << k][d] - r[c][d]);
      sweep(tangent[k][d], (k + 1) % 3, k);
      sweep(tangent[k][d], (k + 2) % 3, k);
    }
    LAHAR_UNROLL
    for (int g = 0; g < vectors; ++g) {
      const auto at = [&](int k, int d) __attribute__((always_inline)) {
        return tangent[k][d][g & ~(1 << k)];
      };
      LAHAR_UNROLL
      for (int k = 0; k < 3; ++k) {
        const int a = (k + 1) % 3, b = (k + 2) % 3;
        LAHAR_UNROLL
        for (int d = 0; d < 3; ++d)
          cofactor[k][d][g] = difference_of_products(at(a, (d + 1) % 3), at(b, (d + 2) % 3),
                                                     at(a, (d + 2) % 3), at(b, (d + 1) % 3));
      }
      J[g] = fma(at(0, 2), cofactor[0][2][g],
                 fma(at(0, 1), cofactor[0][1][g], at(0, 0) * cofactor[0][0][g]));
    }
  }
};

}  // namespace lahar
