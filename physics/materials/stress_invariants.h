/// \file Invariants of stresses and directions that isotropic laws return along.
#pragma once

#include <limits>
#include <numbers>

#include "physics/materials/law_input.h"

namespace lahar {

inline constexpr double root3 = std::numbers::sqrt3;
inline constexpr double root2_3 = 0.81649658092772603;  ///< sqrt(2/3)
inline constexpr double root3_2 = 1.2247448713915890;   ///< sqrt(3/2)

/// Below this J2 [Pa^2] a stress has no deviator: its square would not be a normal number. It is no
/// measure of stresses: without cohesion a law is the same for stresses of any size.
inline constexpr double least_J2 = 1e-140;
inline constexpr double cbgeo_least_J2 = std::numeric_limits<double>::epsilon();

template <class Real>
LAHAR_INLINE Real mean_of(const Real* stress) {
  return (1.0 / 3.0) * (stress[0] + stress[1] + stress[2]);
}

/// Stress after an elastic increment with bulk and shear modulus K and G [Pa].
template <int Dim, class Real>
LAHAR_INLINE void elastic_trial(const LawInput<Dim, Real>& in, double K, double G, Real* stress) {
  const Real volumetric = volumetric_rate(in) * ((K - 2.0 / 3.0 * G) * in.dt);
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
  Real p;          ///< mean stress [Pa], positive in tension
  Real J2, rho;    ///< rho = sqrt(2 J2) [Pa]
  Real per_rho;    ///< 1 / rho; something finite where J2 is zero
  Real v2, per_v;  ///< v:v = 2/3 (J2 sin(3 theta))^2 and its root's reciprocal
  Real sin3;       ///< sin(3 theta)
  Real cos, sin;   ///< of theta
};

/// cos and sin of theta from those of 3 theta. With |cos(3 theta)|: the root c near 1 of 4 c^3 - 3
/// c, from a polynomial (Chebyshev interpolation of cos(acos(a) / 3) on [0, 1], within 2e-9) by one
/// step of Newton's method.
template <class Real>
LAHAR_INLINE void third_of_angle(const Real& cos3, const Real& sin3, Real& cos, Real& sin) {
  constexpr double term[] = {0.8660254056,    0.1666663711,   -0.04810444145,
                             0.02460429679,   -0.01510727515, 0.009383330556,
                             -0.004929691155, 0.001764856863, -0.0003028541988};
  const Real a = max(cos3, -cos3);
  Real c(term[8]);
  LAHAR_UNROLL
  for (int k = 7; k >= 0; --k) c = c * a + term[k];
  const Real per = reciprocal(4.0 * c * c - 1.0);
  c -= (c * (4.0 * c * c - 3.0) - a) * (1.0 / 3.0) * per;
  const Real s = sin3 * per * (2.0 - (4.0 * c * c - 1.0) * per);
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
  constexpr double least = 1e-300;
  at.per_rho = inverse_sqrt(max(2.0 * at.J2, Real(least)));
  at.rho = 2.0 * at.J2 * at.per_rho;
}

/// The rest, after deviator_of(). sin(3 theta) is that of v, because from 1 - cos^2 half of the
/// digits would be lost where two principal stresses are equal. Where J2 is at most `least` [Pa^2]
/// the angle is 30 degrees, as in the reference code, whose limit is cbgeo_least_J2.
template <int Rows, class Real>
LAHAR_INLINE void lode_of(StressPoint<Rows, Real>& at, double least = least_J2) {
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
  const unsigned some = greater(at.J2, Real(least));
  const Real per_J2 = select(some, 2.0 * at.per_rho * at.per_rho, Real(1.0));
  const Real along_s = 1.5 * J3 * per_J2;
  at.v2 = Real(0.0);
  LAHAR_UNROLL
  for (int k = 0; k < Rows; ++k) {
    v[k] = select(some, v[k] - along_s * s[k], Real(0.0));
    at.v2 += (k < 3 ? 1.0 : 2.0) * v[k] * v[k];
  }
  at.per_v = inverse_sqrt(max(at.v2, Real(1e-300)));
  const Real cos3 = clamp(Real((root3 * std::numbers::sqrt2) * along_s * at.per_rho), 1.0);
  at.sin3 = select(some, root3_2 * at.v2 * at.per_v * per_J2, Real(1.0));
  third_of_angle(select(some, cos3, Real(0.0)), at.sin3, at.cos, at.sin);
}

template <int Rows, class Real>
LAHAR_INLINE void point_of(const Real* stress, StressPoint<Rows, Real>& at,
                           double least = least_J2) {
  deviator_of(stress, at);
  lode_of(at, least);
}

/// What isotropic yield functions depend on.
template <class Real>
struct Invariants {
  Real p;         ///< mean stress [Pa]
  Real rho;       ///< sqrt(2 J2) [Pa]
  Real per_rho;   ///< 1 / rho; something finite where rho is zero
  Real cos, sin;  ///< of the Lode angle theta
};

template <int Rows, class Real>
LAHAR_INLINE Invariants<Real> invariants_of(const StressPoint<Rows, Real>& at) {
  return {at.p, at.rho, at.per_rho, at.cos, at.sin};
}

/// Gradient of a function of the invariants: df/dp, df/drho and (df/dtheta) / rho, the components
/// along sqrt(3) I, the deviator and the direction in which theta alone grows.
template <class Real>
struct InvariantGradient {
  Real p, rho, theta;
};

/// f : D : g for isotropic elasticity with K and G [Pa].
template <class Real>
LAHAR_INLINE Real stiffness_between(const InvariantGradient<Real>& f,
                                    const InvariantGradient<Real>& g, double K, double G) {
  return K * f.p * g.p + (2.0 * G) * (f.rho * g.rho + f.theta * g.theta);
}

/// Unit tensors of a stress along which rho and theta alone grow. Where two principal stresses are
/// equal theta has no gradient and v is rounding: there the second is zero.
template <int Rows, class Real>
struct DeviatoricAxes {
  Real along_rho[Rows], along_theta[Rows];
  unsigned edge;  ///< bits of lanes with two equal principal stresses

  LAHAR_INLINE explicit DeviatoricAxes(const StressPoint<Rows, Real>& at) {
    constexpr double at_edge = 1.5e-8;
    edge = ~greater(at.sin3, Real(at_edge)) | ~greater(at.v2, Real(0.0));
    const Real per_v = select(edge, Real(0.0), -at.per_v);
    LAHAR_UNROLL
    for (int k = 0; k < Rows; ++k) {
      along_rho[k] = at.per_rho * at.s[k];
      along_theta[k] = per_v * at.v[k];
    }
  }
};

/// f : (an increment of stress).
template <int Rows, class Real>
LAHAR_INLINE Real along(const InvariantGradient<Real>& f, const DeviatoricAxes<Rows, Real>& axes,
                        const Real* increment) {
  Real sum = f.p * (1.0 / 3.0) * (increment[0] + increment[1] + increment[2]);
  LAHAR_UNROLL
  for (int k = 0; k < Rows; ++k)
    sum += (k < 3 ? 1.0 : 2.0) * (f.rho * axes.along_rho[k] + f.theta * axes.along_theta[k]) *
           increment[k];
  return sum;
}

/// Component k of D : g.
template <int Rows, class Real>
LAHAR_INLINE Real stress_of(const InvariantGradient<Real>& g,
                            const DeviatoricAxes<Rows, Real>& axes, double K, double G, int k) {
  const Real deviator = (2.0 * G) * (g.rho * axes.along_rho[k] + g.theta * axes.along_theta[k]);
  return k < 3 ? K * g.p + deviator : deviator;
}

/// The stresses with the principal directions of one of them, as points of a plane for each mean
/// stress: x = rho cos(theta), y = rho sin(theta), continued beyond 0 and 60 degrees, where the
/// principal stresses change their order. Isotropic laws return within it, without an angle to
/// be trisected at each step.
template <int Rows, class Real>
struct DeviatoricPlane {
  Real p, x, y;  ///< the point [Pa]

  LAHAR_INLINE explicit DeviatoricPlane(const StressPoint<Rows, Real>& at)
      : p(at.p), x(at.rho * at.cos), y(at.rho * at.sin), axes_(at), cos_(at.cos), sin_(at.sin) {}

  /// Lanes whose theta cannot change.
  unsigned edge() const { return axes_.edge; }

  /// Invariants of the point; `order` is 1 where theta grows as the angle of (x, y), or -1.
  LAHAR_INLINE Invariants<Real> invariants(Real& order) const {
    const unsigned first = greater(Real(0.0), y);
    Real u = x, w = select(first, -y, y);
    // Beyond 60 degrees: mirrored there, and once more at zero.
    const unsigned second = greater(w, root3 * u);
    const Real mirrored = (0.5 * root3) * u + 0.5 * w;
    u = select(second, (0.5 * root3) * w - 0.5 * u, u);
    w = select(second, mirrored, w);
    const unsigned third = greater(Real(0.0), w);
    w = select(third, -w, w);
    order = select(first ^ second ^ third, Real(-1.0), Real(1.0));
    const Real rho2 = u * u + w * w;
    const Real per_rho = inverse_sqrt(max(rho2, Real(1e-300)));
    return {p, rho2 * per_rho, per_rho, select(greater(rho2, Real(0.0)), u * per_rho, Real(1.0)),
            w * per_rho};
  }
  /// Component k of the stress of the point.
  LAHAR_INLINE Real stress(int k) const {
    const Real deviator =
        axes_.along_rho[k] * (x * cos_ + y * sin_) + axes_.along_theta[k] * (y * cos_ - x * sin_);
    return k < 3 ? p + deviator : deviator;
  }

 private:
  DeviatoricAxes<Rows, Real> axes_;
  Real cos_, sin_;  // of the stress that the axes belong to
};

}  // namespace lahar
