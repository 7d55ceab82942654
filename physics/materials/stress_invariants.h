/// \file Invariants of stresses and directions that isotropic laws return along.
#pragma once

#include <limits>
#include <numbers>

#include "physics/materials/law_input.h"

namespace lahar {

inline constexpr double root3 = std::numbers::sqrt3;
inline constexpr double root2_3 = 0.81649658092772603;  ///< sqrt(2/3)
inline constexpr double root3_2 = 1.2247448713915890;   ///< sqrt(3/2)

/// Stress after an elastic increment with bulk and shear modulus K and G [Pa].
template <int Dim, class Real>
LAHAR_INLINE void elastic_trial(const LawInput<Dim, Real>& in, double K, double G, Real* stress) {
  Real volumetric = in.rate[0] + in.rate[1];
  if constexpr (Dim == 3) volumetric += in.rate[2];
  volumetric *= (K - 2.0 / 3.0 * G) * in.dt;
  LAHAR_UNROLL
  for (int k = 0; k < in.rows; ++k)
    stress[k] += k < 3 ? volumetric + (2.0 * G * in.dt) * in.rate[k] : (G * in.dt) * in.rate[k];
}

/// A stress with Rows components (4: no yz and xz), its deviator s and invariants. theta is the
/// Lode angle of Haigh and Westergaard, cos(3 theta) = 3 sqrt(3)/2 J3 / J2^1.5, from 0 (one
/// principal stress above two equal ones) to 60 degrees. v is the direction in which theta alone
/// changes: t = s s - 2/3 J2 I without its part along s.
template <int Rows, class Real>
struct StressPoint {
  Real s[Rows], v[Rows];
  Real p;         ///< mean stress [Pa], positive in tension
  Real J2, rho;   ///< rho = sqrt(2 J2) [Pa]
  Real v2;        ///< v:v = 2/3 (J2 sin(3 theta))^2
  Real sin3;      ///< sin(3 theta)
  Real cos, sin;  ///< of theta
};

/// cos and sin of theta from those of 3 theta. With |cos(3 theta)|: the root c near 1 of 4 c^3 - 3
/// c by Newton's method, from a straight line that is within 0.005 of it: three steps leave
/// rounding.
template <class Real>
LAHAR_INLINE void third_of_angle(const Real& cos3, const Real& sin3, Real& cos, Real& sin) {
  const Real a = max(cos3, -cos3);
  Real c = 0.5 * root3 + (1.0 - 0.5 * root3) * a;
  LAHAR_UNROLL
  for (int step = 0; step < 3; ++step) c -= (c * (4.0 * c * c - 3.0) - a) / (12.0 * c * c - 3.0);
  const Real s = sin3 / (4.0 * c * c - 1.0);
  const unsigned below = greater(Real(0.0), cos3);  // theta = 60 degrees - that of |cos3|
  cos = select(below, 0.5 * c + (0.5 * root3) * s, c);
  sin = select(below, (0.5 * root3) * c - 0.5 * s, s);
}

/// p, s, J2 and rho alone: enough where the Lode angle does not matter.
template <int Rows, class Real>
LAHAR_INLINE void deviator_of(const Real* stress, StressPoint<Rows, Real>& at) {
  at.p = (1.0 / 3.0) * (stress[0] + stress[1] + stress[2]);
  Real shear2 = stress[3] * stress[3];
  if constexpr (Rows == 6) shear2 += stress[4] * stress[4] + stress[5] * stress[5];
  LAHAR_UNROLL
  for (int k = 0; k < Rows; ++k) at.s[k] = k < 3 ? stress[k] - at.p : stress[k];
  at.J2 = 0.5 * (at.s[0] * at.s[0] + at.s[1] * at.s[1] + at.s[2] * at.s[2]) + shear2;
  at.rho = lahar::sqrt(2.0 * at.J2);
}

/// The rest, after deviator_of(). sin(3 theta) is that of v, because from 1 - cos^2 half of the
/// digits would be lost where two principal stresses are equal. Where J2 is below the reference
/// code's limit [Pa^2] the angle is 30 degrees, as there.
template <int Rows, class Real>
LAHAR_INLINE void lode_of(StressPoint<Rows, Real>& at) {
  const Real* s = at.s;
  const Real xy2 = s[3] * s[3], twice = (2.0 / 3.0) * at.J2;
  Real J3 = s[0] * s[1] * s[2] - s[2] * xy2;
  Real* v = at.v;
  v[0] = s[0] * s[0] + xy2 - twice;
  v[1] = s[1] * s[1] + xy2 - twice;
  v[2] = s[2] * s[2] - twice;
  v[3] = s[3] * (s[0] + s[1]);
  if constexpr (Rows == 6) {
    const Real yz2 = s[4] * s[4], xz2 = s[5] * s[5];
    J3 += 2.0 * s[3] * s[4] * s[5] - s[0] * yz2 - s[1] * xz2;
    v[0] += xz2;
    v[1] += yz2;
    v[2] += yz2 + xz2;
    v[3] += s[4] * s[5];
    v[4] = s[3] * s[5] + s[4] * (s[1] + s[2]);
    v[5] = s[3] * s[4] + s[5] * (s[0] + s[2]);
  }
  constexpr double least = std::numeric_limits<double>::epsilon();
  const unsigned some = greater(at.J2, Real(least));
  const Real J2 = select(some, at.J2, Real(1.0));
  const Real along_s = 1.5 * J3 / J2;
  at.v2 = Real(0.0);
  LAHAR_UNROLL
  for (int k = 0; k < Rows; ++k) {
    v[k] = select(some, v[k] - along_s * s[k], Real(0.0));
    at.v2 += (k < 3 ? 1.0 : 2.0) * v[k] * v[k];
  }
  const Real cos3 = clamp(root3 * along_s / lahar::sqrt(J2), 1.0);
  at.sin3 = select(some, lahar::sqrt(1.5 * at.v2) / J2, Real(1.0));
  third_of_angle(select(some, cos3, Real(0.0)), at.sin3, at.cos, at.sin);
}

template <int Rows, class Real>
LAHAR_INLINE void point_of(const Real* stress, StressPoint<Rows, Real>& at) {
  deviator_of(stress, at);
  lode_of(at);
}

/// d theta / d sigma = this times v. At an edge, where two principal stresses are equal, theta has
/// no derivative and v is rounding; there it goes to zero.
template <int Rows, class Real>
LAHAR_INLINE Real lode_gradient(const StressPoint<Rows, Real>& at) {
  constexpr double least = std::numeric_limits<double>::epsilon(), at_edge = 1.5e-8;
  const Real J2 = max(at.J2, Real(least));
  return -(0.5 * root3) / (J2 * lahar::sqrt(J2) * max(at.sin3, Real(at_edge)));
}

/// Gradient of an isotropic function of stress: a I + b s + c v.
template <class Real>
struct IsotropicGradient {
  Real a, b, c;
};

/// f : D : g for isotropic elasticity with K and G [Pa]; s and v are orthogonal.
template <int Rows, class Real>
LAHAR_INLINE Real stiffness_between(const IsotropicGradient<Real>& f,
                                    const IsotropicGradient<Real>& g,
                                    const StressPoint<Rows, Real>& at, double K, double G) {
  return (9.0 * K) * f.a * g.a + (2.0 * G) * (2.0 * f.b * g.b * at.J2 + f.c * g.c * at.v2);
}

/// f : (an increment of stress).
template <int Rows, class Real>
LAHAR_INLINE Real along(const IsotropicGradient<Real>& f, const StressPoint<Rows, Real>& at,
                        const Real* increment) {
  Real sum = f.a * (increment[0] + increment[1] + increment[2]);
  LAHAR_UNROLL
  for (int k = 0; k < Rows; ++k)
    sum += (k < 3 ? 1.0 : 2.0) * (f.b * at.s[k] + f.c * at.v[k]) * increment[k];
  return sum;
}

/// Component k of D : g.
template <int Rows, class Real>
LAHAR_INLINE Real stress_of(const IsotropicGradient<Real>& g, const StressPoint<Rows, Real>& at,
                            double K, double G, int k) {
  const Real deviator = (2.0 * G) * (g.b * at.s[k] + g.c * at.v[k]);
  return k < 3 ? (3.0 * K) * g.a + deviator : deviator;
}

}  // namespace lahar
