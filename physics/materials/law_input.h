/// \file What a law is given and what it answers; laws that are evaluated particle by particle.
#pragma once

#include <algorithm>
#include <cmath>
#include <concepts>

#include "physics/materials/dual.h"

namespace lahar {

/// Components of a rate of rotation.
template <int Dim>
inline constexpr int spins = Dim == 2 ? 1 : 3;

/// What a law sees of a pack of particles. Voigt rows: 2D xx yy zz xy, 3D xx yy zz xy yz xz.
template <int Dim, class Real>
struct LawInput {
  static constexpr int rows = stress_components<Dim>;
  Real rate[rows];          ///< strain rate [1/s], engineering shear; 2D: zz = 0
  Real gradient[Dim][Dim];  ///< velocity gradient dv_a/dx_b [1/s]
  /// Rate of rotation [1/s]: of x towards y in 2D, the axial vector in 3D. With `turns` stresses of
  /// the beginning turn by it (turn()).
  Real spin[spins<Dim>] = {};
  bool turns = false;
  double dt;           ///< [s]
  Real volumetric;     ///< volumetric strain increment of fluids [-] (Analysis::volume_as_cbgeo)
  bool large = false;  ///< an implicit step: the increment may be many times the yield strain
  unsigned active = all_of;  ///< bit per lane: of the others (beyond a bin) nothing is kept
  static constexpr unsigned all_of = (1u << lanes<Real>)-1;
};

/// Volumetric strain rate [1/s].
template <int Dim, class Real>
LAHAR_INLINE Real volumetric_rate(const LawInput<Dim, Real>& in) {
  Real sum = in.rate[0] + in.rate[1];
  if constexpr (Dim == 3) sum += in.rate[2];
  return sum;
}

/// True of fluids: their first state variable is the pressure, which follows from `volumetric`.
template <class LawType>
inline constexpr bool pressure_is_state = [] {
  if constexpr (LawType::state.size() > 0)
    return LawType::state.front().name == "pressure";
  else
    return false;
}();

/// Whether stresses of the beginning have to turn before update() of a law. Fluids keep none, and
/// laws for large strains know the rotation.
template <class LawType>
inline constexpr bool turns_stress = !pressure_is_state<LawType> && !requires {
  requires LawType::knows_rotation;
};

/// The rate of rotation of a velocity gradient, its antisymmetric part.
template <int Dim, class Real>
LAHAR_INLINE void spin_of(const Real (&L)[Dim][Dim], Real (&spin)[spins<Dim>]) {
  if constexpr (Dim == 2) {
    spin[0] = 0.5 * (L[1][0] - L[0][1]);
  } else {
    spin[0] = 0.5 * (L[2][1] - L[1][2]);
    spin[1] = 0.5 * (L[0][2] - L[2][0]);
    spin[2] = 0.5 * (L[1][0] - L[0][1]);
  }
}

/// Turn a symmetric tensor by the rotation of a step, Q = (1 - w / 2)^-1 (1 + w / 2) with w = spin
/// dt (Hughes and Winget 1980): Q s Q^T. Its invariants stay, however large the step is; without
/// rotation it stays to the bit. Voigt rows of a stress. To first order in dt this is Jaumann's
/// rate.
template <int Dim, class Real>
LAHAR_INLINE void turn(const Real (&spin)[spins<Dim>], double dt, Real* s) {
  if constexpr (Dim == 2) {
    const Real t = (0.5 * dt) * spin[0];
    const Real scale = 1.0 / (1.0 + t * t);
    const Real sine = 2.0 * t * scale, cosine = 1.0 - t * sine;
    const Real half = 0.5 * (s[0] - s[1]), xy = s[3];
    const Real across = 2.0 * sine * (sine * half + cosine * xy);
    s[0] -= across;
    s[1] += across;
    s[3] += 2.0 * sine * (cosine * half - sine * xy);
  } else {
    Real a[3], T[3][3];
    LAHAR_UNROLL
    for (int d = 0; d < 3; ++d) a[d] = (0.5 * dt) * spin[d];
    const Real square = a[0] * a[0] + a[1] * a[1] + a[2] * a[2];
    const Real scale = 2.0 / (1.0 + square);
    constexpr int voigt[3][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}};
    Real A[3][3];  // Q - 1 = scale ([a] + [a]^2)
    LAHAR_UNROLL
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, k = (i + 2) % 3;
      A[i][i] = scale * (a[i] * a[i] - square);
      A[j][k] = scale * (a[j] * a[k] - a[i]);
      A[k][j] = scale * (a[j] * a[k] + a[i]);
    }
    LAHAR_UNROLL
    for (int i = 0; i < 3; ++i) LAHAR_UNROLL
    for (int j = 0; j < 3; ++j)
      T[i][j] = A[i][0] * s[voigt[0][j]] + A[i][1] * s[voigt[1][j]] + A[i][2] * s[voigt[2][j]];
    constexpr int row[6] = {0, 1, 2, 0, 1, 0}, column[6] = {0, 1, 2, 1, 2, 2};
    LAHAR_UNROLL
    for (int k = 0; k < 6; ++k) {
      const int i = row[k], j = column[k];
      s[k] += T[i][j] + T[j][i] + (T[i][0] * A[j][0] + T[i][1] * A[j][1] + T[i][2] * A[j][2]);
    }
  }
}

/// Lanes whose increment was not done as a whole; a bit for each.
struct Failures {
  unsigned failed = 0;   ///< no stress that the law allows was found: the run ends
  unsigned divided = 0;  ///< found, but only in parts: counted and reported
};

/// A stress or strain of numbers that may carry derivatives.
template <class Number>
using VoigtOf = std::array<Number, 6>;

/// What a law that is evaluated particle by particle sees, in two dimensions too (yz = xz = 0).
template <class Number>
struct IncrementOf {
  VoigtOf<Number> strain;  ///< [-] engineering shear
  double dt;               ///< [s]
  Number volumetric;       ///< volumetric strain increment of fluids [-]
  bool large = false;      ///< LawInput::large
};
using Increment = IncrementOf<double>;

/// An equal part of an increment.
template <class Number>
IncrementOf<Number> part_of(const IncrementOf<Number>& whole, int parts) {
  IncrementOf<Number> part{{}, whole.dt / parts, whole.volumetric / parts, whole.large};
  for (std::size_t k = 0; k < 6; ++k) part.strain[k] = whole.strain[k] / parts;
  return part;
}

/// An increment that does not converge is done in 2, 4, ... parts, at most as many as this.
inline constexpr int most_parts = 1 << 10;
/// Where even these do not converge, in so many parts, of which some end on an admissible stress
/// that is not the law's own.
inline constexpr int landing_parts = 16;

template <int W>
LAHAR_INLINE void set_lane(PackOf<W>& pack, int lane, double value) {
  if constexpr (W == 1)
    pack.v = value;
  else
    pack.v[lane] = value;
}

/// One increment of one particle: as a whole by `law.update_one(increment, stress, state)`, which
/// returns whether it converged, or else in equal parts. Where none is small enough
/// `law.land(increment, stress, state)`, if there is one, gives a stress that the law allows, part
/// by part. Returns the number of parts; 0 = there is no result, stress and state are as before.
template <class LawType, class Number>
int update_in_parts(const LawType& law, const std::type_identity_t<IncrementOf<Number>>& whole,
                    VoigtOf<Number>& stress, Number* state) {
  constexpr std::size_t n = LawType::state.size();
  for (int parts = 1; parts <= most_parts; parts *= 2) {
    const IncrementOf<Number> part = part_of(whole, parts);
    VoigtOf<Number> s = stress;
    std::array<Number, n> q;
    std::copy_n(state, n, q.begin());
    bool converged = true;
    for (int i = 0; i < parts && converged; ++i) converged = law.update_one(part, s, q.data());
    if (!converged) continue;
    stress = s;
    std::copy_n(q.begin(), n, state);
    return parts;
  }
  if constexpr (requires(const IncrementOf<Number>& in) { law.land(in, stress, state); }) {
    // What is not finite to begin with stays so: the step tells of it.
    const IncrementOf<Number> part = part_of(whole, landing_parts);
    double sum = 0;
    for (std::size_t k = 0; k < 6; ++k) sum += value_of(part.strain[k]) + value_of(stress[k]);
    if (!std::isfinite(sum)) return 0;
    for (int i = 0; i < landing_parts; ++i)
      if (!law.update_one(part, stress, state)) law.land(part, stress, state);
    return landing_parts;
  }
  return 0;
}

/// The lanes of `which`, one after the other: what a lane gets does not depend on the others.
template <int Dim, class Real, class LawType>
[[gnu::noinline]] Failures update_lane_by_lane(const LawType& law, const LawInput<Dim, Real>& in,
                                               Real* stress, Real* state, unsigned which) {
  constexpr int rows = stress_components<Dim>, n = static_cast<int>(LawType::state.size());
  using Number = NumberOf<Real>;
  Failures failures;
  for (int lane = 0; lane < lanes<Real>; ++lane) {
    if (!(which >> lane & 1)) continue;
    IncrementOf<Number> increment{{}, in.dt, lane_of(in.volumetric, lane), in.large};
    VoigtOf<Number> s{};
    std::array<Number, n> q;
    for (int k = 0; k < rows; ++k) {
      increment.strain[static_cast<std::size_t>(k)] = in.dt * lane_of(in.rate[k], lane);
      s[static_cast<std::size_t>(k)] = lane_of(stress[k], lane);
    }
    for (int k = 0; k < n; ++k) q[static_cast<std::size_t>(k)] = lane_of(state[k], lane);
    const int parts = update_in_parts(law, increment, s, q.data());
    if (parts == 0) failures.failed |= 1u << lane;
    if (parts > 1) failures.divided |= 1u << lane;
    for (int k = 0; k < rows; ++k) set_lane(stress[k], lane, s[static_cast<std::size_t>(k)]);
    for (int k = 0; k < n; ++k) set_lane(state[k], lane, q[static_cast<std::size_t>(k)]);
  }
  return failures;
}

/// One increment of a pack of particles, turned before by LawInput::spin, whichever way the law
/// gives it:
/// - `update<Dim>(in, stress, state)`, all lanes at once; returns Failures or nothing;
/// - else `update_one(increment, stress, state)`, one particle; returns whether it converged;
///   beside it, optionally, `update_elastic<Dim>(in, stress, state)` for all lanes at once, which
///   changes only lanes whose increment is elastic and returns them, a bit for each.
template <int Dim, class Real, class LawType>
LAHAR_INLINE Failures update(const LawType& law, const LawInput<Dim, Real>& in, Real* stress,
                             Real* state) {
  if constexpr (turns_stress<LawType>)
    if (in.turns) turn<Dim>(in.spin, in.dt, stress);
  if constexpr (requires { law.template update<Dim>(in, stress, state).failed; }) {
    return law.template update<Dim>(in, stress, state);
  } else if constexpr (requires { law.template update<Dim>(in, stress, state); }) {
    law.template update<Dim>(in, stress, state);
    return {};
  } else {
    unsigned left = in.active;
    if constexpr (requires { law.template update_elastic<Dim>(in, stress, state); })
      left &= ~law.template update_elastic<Dim>(in, stress, state);
    if (left == 0) return {};
    return update_lane_by_lane<Dim>(law, in, stress, state, left);
  }
}

/// Whether update() of a law may have failures to tell of.
template <class LawType, int Dim, class Real>
inline constexpr bool can_fail =
    !requires(const LawType law, LawInput<Dim, Real> in, Real* stress, Real* state) {
  { law.template update<Dim>(in, stress, state) } -> std::same_as<void>;
};

}  // namespace lahar
