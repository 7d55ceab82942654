/// \file Stress of soils in invariants, as critical state models are written; steps that are small
/// enough.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

#include "physics/materials/beside_axes.h"

namespace lahar {

/// Moduli of elastic waves.
struct WaveModuli {
  double compression, shear;  ///< [Pa]
};

/// A stress as p, q, theta and directions of its deviator. Pressures are positive in compression;
/// the components of a stress are positive in tension, as everywhere.
template <class Number>
struct SoilStressOf {
  Number p;      ///< mean pressure [Pa]
  Number q;      ///< sqrt(3 J2) [Pa]
  Number theta;  ///< Lode angle, 0 (triaxial extension) to pi/3 (triaxial compression) [rad]
  VoigtOf<Number> direction;  ///< s / |s|, |s| = sqrt(2/3) q; zero where q is
  /// normal to it in the deviatoric plane, to larger theta; zero at its ends
  VoigtOf<Number> towards{};
};
using SoilStress = SoilStressOf<double>;

/// Below this sin(3 theta) a stress is taken to be one of triaxial compression or extension, where
/// the direction in which theta grows is not defined. (Rounding errors of it are of order 1e-16
/// divided by this, of a rotation that is at most of its size.)
inline constexpr double axial_sine = 1e-10;

template <class Number>
Number contract(const VoigtOf<Number>& a, const VoigtOf<Number>& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + 2 * (a[3] * b[3] + a[4] * b[4] + a[5] * b[5]);
}

/// p, q and the direction; theta is that of triaxial compression, see with_lode_angle().
template <class Number>
SoilStressOf<Number> soil_stress(const VoigtOf<Number>& sigma) {
  using std::sqrt;
  SoilStressOf<Number> s{-(sigma[0] + sigma[1] + sigma[2]) / 3, 0, std::numbers::pi / 3, sigma, {}};
  VoigtOf<Number>& n = s.direction;
  for (std::size_t k = 0; k < 3; ++k) n[k] += s.p;
  const Number length = sqrt(contract(n, n));
  s.q = std::sqrt(1.5) * length;
  for (Number& component : n) component = length > 0 ? component / length : 0;
  return s;
}

/// Lode angle from the deviator t of the square of the direction, of length 1.
inline SoilStress with_lode_angle(SoilStress s, const Voigt& t) {
  const Voigt& n = s.direction;
  const double cosine = std::clamp(contract(n, t), -1.0, 1.0);
  s.theta = std::acos(cosine) / 3;
  const double sine = std::sin(3 * s.theta);
  if (sine > axial_sine)
    for (std::size_t k = 0; k < 6; ++k) s.towards[k] = (cosine * n[k] - t[k]) / sine;
  return s;
}

/// With its Lode angle. cos(3 theta) = sqrt(6) tr(n^3) of the unit deviator n; the deviator of its
/// square, of length 1 / sqrt(6), lies at the angle -2 theta in the deviatoric plane, which gives
/// the other direction.
template <class Number>
SoilStressOf<Number> with_lode_angle(SoilStressOf<Number> s) {
  if (!(s.q > 0)) return s;
  const VoigtOf<Number>& n = s.direction;
  const auto [xx, yy, zz, xy, yz, xz] = n;
  VoigtOf<Number> t{xx * xx + xy * xy + xz * xz, xy * xy + yy * yy + yz * yz,
                    xz * xz + yz * yz + zz * zz, xx * xy + xy * yy + xz * yz,
                    xy * xz + yy * yz + yz * zz, xx * xz + xy * yz + xz * zz};
  for (std::size_t k = 0; k < 3; ++k) t[k] -= 1.0 / 3;
  for (Number& component : t) component *= std::sqrt(6.0);
  if constexpr (is_dual<Number>) {
    // The sine of a small angle has derivatives only where it does not come from the cosine.
    const Number cosine = contract(n, t);
    for (std::size_t k = 0; k < 6; ++k) t[k] = cosine * n[k] - t[k];
    const Number sine = sqrt(contract(t, t));
    s.theta = atan2(sine, cosine) / 3;
    if (sine > axial_sine)
      for (std::size_t k = 0; k < 6; ++k) s.towards[k] = t[k] / sine;
    return s;
  } else {
    return with_lode_angle(s, t);
  }
}
/// The stress with these invariants whose principal axes are those of `s`.
template <class Number>
VoigtOf<Number> stress_of(const SoilStressOf<Number>& s, const std::type_identity_t<Number>& p,
                          const std::type_identity_t<Number>& q,
                          const std::type_identity_t<Number>& theta) {
  using std::cos, std::sin;
  const Number length = std::sqrt(2.0 / 3) * q, turn = theta - s.theta;
  VoigtOf<Number> sigma;
  for (std::size_t k = 0; k < 6; ++k)
    sigma[k] = length * (cos(turn) * s.direction[k] + sin(turn) * s.towards[k]);
  for (std::size_t k = 0; k < 3; ++k) sigma[k] -= p;
  return sigma;
}

/// sigma + K tr(de) I + 2 G dev(de), engineering shear.
template <class Number>
VoigtOf<Number> elastic_trial(std::type_identity_t<VoigtOf<Number>> sigma,
                              const VoigtOf<Number>& strain, const std::type_identity_t<Number>& K,
                              const std::type_identity_t<Number>& G) {
  const Number trace = strain[0] + strain[1] + strain[2];
  for (std::size_t k = 0; k < 3; ++k) sigma[k] += (K - 2.0 / 3 * G) * trace + 2 * G * strain[k];
  for (std::size_t k = 3; k < 6; ++k) sigma[k] += G * strain[k];
  return sigma;
}

/// M(theta) = M_tc - M_tc^2 / (3 + M_tc) cos(3 theta / 2): the strength of a friction angle in
/// triaxial compression (theta = pi/3) and extension, smooth between (Jefferies and Shuttle 2011).
template <class Number>
Number strength_ratio(double M_tc, const Number& theta) {
  using std::cos;
  return M_tc - M_tc * M_tc / (3 + M_tc) * cos(1.5 * theta);
}

/// Norm of the difference of two stresses, the same in all coordinates [Pa].
template <class Number>
double distance(const VoigtOf<Number>& a, const VoigtOf<Number>& b) {
  Voigt difference;
  for (std::size_t k = 0; k < 6; ++k) difference[k] = value_of(a[k]) - value_of(b[k]);
  return std::sqrt(contract(difference, difference));
}

/// 1 + e, as stiffness depends on it, is not more than this: soil that was torn apart is not
/// stiffer for its gaps.
inline constexpr double most_specific_volume = 10;
/// Stiffness is at least that at this share of a soil's initial size of the yield surface, so that
/// it can be compressed where it has no stress; errors are compared with no less either.
inline constexpr double least_pressure = 1e-3;

/// K = (1 + e) p / kappa [Pa], bounded by the two above; `size` is that of the yield surface [Pa].
template <class Number>
Number swelling_modulus(const Number& void_ratio, double kappa, const Number& p, double size) {
  return std::min<Number>(1 + void_ratio, most_specific_volume) / kappa *
         std::max<Number>(p, least_pressure * size);
}

/// Largest error of a stress by the size of one step, as a share of the pressure.
inline constexpr double step_error = 1e-4;
/// Steps whose elastic stress changes at most by this share of the pressure are accurate enough
/// without an estimate: their error is of the order of its square.
inline constexpr double small_step = 5e-3;

/// One implicit step, `take(strain, sigma, state) -> converged`, if it is accurate enough: its
/// result must agree with that of two half steps. `change` is the norm of the elastic stress
/// increment [Pa], `pressure` what errors are compared with [Pa]. False, with sigma and
/// state in whatever state, asks for a smaller increment.
template <std::size_t States, class Number, class Take>
bool accurate_step(const Take& take, const VoigtOf<Number>& strain, double change, double pressure,
                   VoigtOf<Number>& sigma, Number* state) {
  Voigt halves = values_of(sigma);
  std::array<double, States> copy;
  for (std::size_t k = 0; k < States; ++k) copy[k] = value_of(state[k]);
  if (!take(strain, sigma, state)) return false;
  if (change <= small_step * pressure) return true;
  Voigt half = values_of(strain);
  for (double& component : half) component /= 2;
  if (!take(half, halves, copy.data()) || !take(half, halves, copy.data())) return false;
  return distance(values_of(sigma), halves) <= step_error * pressure;
}

/// Into so many steps smooth_steps() divides an increment. More would take seconds for soil that an
/// iteration of Newton's method has torn far apart.
inline constexpr int most_smooth_steps = 128;

/// What accurate_step() and its division do, as a continuous function of the strain: implicit steps
/// cannot be solved with any other. With R_n the result of n implicit steps, and e_n what R_n and
/// R_2n differ by, in units of the error that n of them may have, the result is R_2 if e_1 < 1/2,
/// goes over to R_4 smoothly as e_1 goes to 1, and so on with e_2, e_4 ... False, with nothing
/// changed, where most_smooth_steps do not suffice.
template <std::size_t States, class Number, class Take>
bool smooth_steps(const Take& take, const VoigtOf<Number>& strain, double pressure,
                  VoigtOf<Number>& sigma, Number* state) {
  using std::sqrt;
  if constexpr (is_dual<Number>) {  // derivatives take long: only where there is a result
    Voigt values = values_of(sigma);
    std::array<double, States> copy;
    for (std::size_t k = 0; k < States; ++k) copy[k] = value_of(state[k]);
    if (!smooth_steps<States>(take, values_of(strain), pressure, values, copy.data())) return false;
  }
  struct Result {
    VoigtOf<Number> sigma;
    std::array<Number, States> state;
    bool converged;
  };
  const auto in_parts = [&](int n) {
    Result to{sigma, {}, true};
    std::copy_n(state, States, to.state.begin());
    VoigtOf<Number> part = strain;
    for (Number& component : part) component /= n;
    for (int i = 0; i < n && to.converged; ++i)
      to.converged = take(part, to.sigma, to.state.data());
    return to;
  };
  Result sum{{}, {}, false}, last = sum;
  Number left(1);  // the share of what is still to come
  Result coarse = in_parts(1);
  for (int n = 1; n <= most_smooth_steps / 2; n *= 2) {
    Result fine = in_parts(2 * n);
    if (fine.converged && coarse.converged) {
      // By differences: what all of them agree about keeps its bits.
      if (value_of(left) == 1) {
        sum = fine;
      } else {
        for (std::size_t k = 0; k < 6; ++k) sum.sigma[k] += left * (fine.sigma[k] - last.sigma[k]);
        for (std::size_t k = 0; k < States; ++k)
          sum.state[k] += left * (fine.state[k] - last.state[k]);
      }
      last = fine;
      VoigtOf<Number> difference;
      for (std::size_t k = 0; k < 6; ++k) difference[k] = fine.sigma[k] - coarse.sigma[k];
      const Number square = contract(difference, difference);
      const double allowed = n * step_error * pressure, e = sqrt(value_of(square)) / allowed;
      if (e <= 0.5) {
        left = Number(0);
      } else if (e < 1) {
        const Number x = 2.0 * (1 / allowed) * sqrt(square) - 1.0;
        left = left * (x * x * (3.0 - 2.0 * x));
      }
      if (value_of(left) == 0) {
        sigma = sum.sigma;
        std::copy_n(sum.state.begin(), States, state);
        return true;
      }
    }
    coarse = fine;
  }
  return false;
}

/// Where smooth_steps() is not accurate enough: as many steps, each as `law.land` takes it. False
/// where stress or strain are not finite.
template <class LawType, class Number>
bool land_in_steps(const LawType& law, const IncrementOf<Number>& whole, VoigtOf<Number>& sigma,
                   Number* state) {
  const IncrementOf<Number> part = part_of(whole, most_smooth_steps);
  for (std::size_t k = 0; k < 6; ++k)
    if (!std::isfinite(value_of(part.strain[k]) + value_of(sigma[k]))) return false;
  for (int i = 0; i < most_smooth_steps; ++i) law.land(part, sigma, state);
  return true;
}

}  // namespace lahar
