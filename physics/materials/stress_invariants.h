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

/// A stress with Rows components (4: no yz and xz), its deviator s, t = dJ3/dsigma = s s - 2/3 J2
/// I, and invariants; theta is the Lode angle of Haigh and Westergaard, cos(3 theta) = 3 sqrt(3)/2
/// J3 / J2^1.5, from 0 (one principal stress above two equal ones) to 60 degrees.
template <int Rows, class Real>
struct StressPoint {
  Real s[Rows], t[Rows];
  Real p;            ///< mean stress [Pa], positive in tension
  Real J2, J3, rho;  ///< rho = sqrt(2 J2) [Pa]
  Real r;            ///< cos(3 theta)
  Real cos, sin;     ///< of theta
};

/// cos and sin of acos(r)/3. With |r|: the root c near 1 of 4 c^3 - 3 c = |r| by Newton's method,
/// from a straight line that is within 0.005 of it: three steps leave rounding.
template <class Real>
LAHAR_INLINE void third_of_angle(const Real& r, Real& cos, Real& sin) {
  const Real a = max(r, -r);
  Real c = 0.5 * root3 + (1.0 - 0.5 * root3) * a;
  LAHAR_UNROLL
  for (int step = 0; step < 3; ++step) c -= (c * (4.0 * c * c - 3.0) - a) / (12.0 * c * c - 3.0);
  const Real s = lahar::sqrt((1.0 - a) * (1.0 + a)) / (4.0 * c * c - 1.0);  // sin(3x) / sin(x)
  const unsigned below = greater(Real(0.0), r);  // theta = 60 degrees - that of |r|
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

/// The rest, after deviator_of(). Where J2 is below the reference code's limit [Pa^2] the angle is
/// 30 degrees, as there.
template <int Rows, class Real>
LAHAR_INLINE void lode_of(StressPoint<Rows, Real>& at) {
  const Real* s = at.s;
  const Real xy2 = s[3] * s[3], twice = (2.0 / 3.0) * at.J2;
  at.J3 = s[0] * s[1] * s[2] - s[2] * xy2;
  at.t[0] = s[0] * s[0] + xy2 - twice;
  at.t[1] = s[1] * s[1] + xy2 - twice;
  at.t[2] = s[2] * s[2] - twice;
  at.t[3] = s[3] * (s[0] + s[1]);
  if constexpr (Rows == 6) {
    const Real yz2 = s[4] * s[4], xz2 = s[5] * s[5];
    at.J3 += 2.0 * s[3] * s[4] * s[5] - s[0] * yz2 - s[1] * xz2;
    at.t[0] += xz2;
    at.t[1] += yz2;
    at.t[2] += yz2 + xz2;
    at.t[3] += s[4] * s[5];
    at.t[4] = s[3] * s[5] + s[4] * (s[1] + s[2]);
    at.t[5] = s[3] * s[4] + s[5] * (s[0] + s[2]);
  }
  constexpr double least = std::numeric_limits<double>::epsilon();
  const unsigned some = greater(at.J2, Real(least));
  const Real safe = select(some, at.J2, Real(1.0));
  const Real r = clamp((1.5 * root3) * at.J3 / (safe * lahar::sqrt(safe)), 1.0);
  at.r = select(some, r, Real(0.0));
  third_of_angle(at.r, at.cos, at.sin);
}

template <int Rows, class Real>
LAHAR_INLINE void point_of(const Real* stress, StressPoint<Rows, Real>& at) {
  deviator_of(stress, at);
  lode_of(at);
}

/// d theta / d sigma = on_s s + on_t t. At an edge, where two principal stresses are equal and the
/// angle has no derivative, it is bounded as in the reference code: 1 - r^2 is at least rounding.
template <class Real>
struct LodeGradient {
  Real on_s, on_t;
  template <int Rows>
  LAHAR_INLINE explicit LodeGradient(const StressPoint<Rows, Real>& at) {
    constexpr double least = std::numeric_limits<double>::epsilon();
    const unsigned some = greater(at.J2, Real(least));
    const Real J2 = select(some, at.J2, Real(1.0));
    const Real sin3 = lahar::sqrt(max((1.0 - at.r) * (1.0 + at.r), Real(least)));
    const Real per_r = -1.0 / (3.0 * sin3);
    on_s = select(some, per_r * (-1.5) * at.r / J2, Real(0.0));
    on_t = select(some, per_r * (1.5 * root3) / (J2 * lahar::sqrt(J2)), Real(0.0));
  }
};

/// Gradient of an isotropic function of stress: a I + b s + c t.
template <class Real>
struct IsotropicGradient {
  Real a, b, c;
};

/// f : D : g for isotropic elasticity with K and G [Pa].
template <int Rows, class Real>
LAHAR_INLINE Real stiffness_between(const IsotropicGradient<Real>& f,
                                    const IsotropicGradient<Real>& g,
                                    const StressPoint<Rows, Real>& at, double K, double G) {
  return (9.0 * K) * f.a * g.a +
         (2.0 * G) * (2.0 * f.b * g.b * at.J2 + 3.0 * (f.b * g.c + f.c * g.b) * at.J3 +
                      (2.0 / 3.0) * f.c * g.c * at.J2 * at.J2);
}

/// f : (an increment of stress).
template <int Rows, class Real>
LAHAR_INLINE Real along(const IsotropicGradient<Real>& f, const StressPoint<Rows, Real>& at,
                        const Real* increment) {
  Real sum = f.a * (increment[0] + increment[1] + increment[2]);
  LAHAR_UNROLL
  for (int k = 0; k < Rows; ++k)
    sum += (k < 3 ? 1.0 : 2.0) * (f.b * at.s[k] + f.c * at.t[k]) * increment[k];
  return sum;
}

/// Component k of D : g.
template <int Rows, class Real>
LAHAR_INLINE Real stress_of(const IsotropicGradient<Real>& g, const StressPoint<Rows, Real>& at,
                            double K, double G, int k) {
  const Real deviator = (2.0 * G) * (g.b * at.s[k] + g.c * at.t[k]);
  return k < 3 ? (3.0 * K) * g.a + deviator : deviator;
}

}  // namespace lahar
