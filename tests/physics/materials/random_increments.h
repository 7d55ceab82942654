/// \file Random increments of every law with random valid parameters: from rounding to far too
/// large, at apexes, on edges and inside.
#pragma once

#include <Eigen/Eigenvalues>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <optional>
#include <string>
#include <utility>

#include "physics/materials/materials.h"

namespace lahar::test {

/// A cheap generator (splitmix64, Steele, Lea and Flood 2014).
class Dice {
 public:
  explicit Dice(std::uint64_t seed) : state_(seed) {}
  std::uint64_t next() {
    std::uint64_t z = (state_ += 0x9e3779b97f4a7c15);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9;
    z = (z ^ (z >> 27)) * 0x94d049bb133111eb;
    return z ^ (z >> 31);
  }
  int below(int n) { return static_cast<int>((next() >> 33) % static_cast<unsigned>(n)); }
  double unit() { return static_cast<double>(next() >> 11) * 0x1p-53; }
  double between(double a, double b) { return a + (b - a) * unit(); }
  /// Between 10^a and 10^b, all sizes as probable.
  double size(double a, double b) { return std::pow(10.0, between(a, b)); }
  double normal_like() { return unit() + unit() + unit() - 1.5; }

 private:
  std::uint64_t state_;
};

// Random valid parameters; zero and the ends of ranges are as probable as what lies between.

inline double zero_or(Dice& dice, double value) {
  return dice.below(3) == 0 ? 0.0 : value;
}
inline double any_poisson(Dice& dice) {
  const double often[] = {0.0, 0.2, 0.3, 0.45};
  return dice.below(2) ? often[dice.below(4)] : dice.between(-0.5, 0.49);
}

inline LinearElastic random_law(Dice& dice, const LinearElastic*) {
  return {.youngs_modulus = dice.size(2, 11), .poisson_ratio = any_poisson(dice)};
}
inline NeoHookean random_law(Dice& dice, const NeoHookean*) {
  return {.youngs_modulus = dice.size(2, 11), .poisson_ratio = dice.between(0, 0.49)};
}
inline VonMises random_law(Dice& dice, const VonMises*) {
  const double E = dice.size(2, 11);
  return {.youngs_modulus = E,
          .poisson_ratio = any_poisson(dice),
          .yield_stress = E * dice.size(-8, -1),
          .hardening_modulus = zero_or(dice, E * dice.size(-3, 1))};
}
inline Newtonian random_law(Dice& dice, const Newtonian*) {
  return {.bulk_modulus = dice.size(2, 10),
          .dynamic_viscosity = zero_or(dice, dice.size(-4, 4)),
          .incompressible = dice.below(8) == 0};
}
inline Bingham random_law(Dice& dice, const Bingham*) {
  return {.youngs_modulus = dice.size(2, 10),
          .poisson_ratio = any_poisson(dice),
          .tau0 = zero_or(dice, dice.size(-2, 4)),
          .mu = zero_or(dice, dice.size(-4, 4)),
          .critical_shear_rate = dice.size(-6, 1),
          .incompressible = dice.below(8) == 0};
}
inline DruckerPrager random_law(Dice& dice, const DruckerPrager*) {
  DruckerPrager law{};
  law.youngs_modulus = dice.size(2, 11);
  law.poisson_ratio = any_poisson(dice);
  law.friction = zero_or(dice, dice.between(0.1, 60));
  law.dilation = zero_or(dice, law.friction * (dice.below(4) ? dice.unit() : 1.0));
  law.cohesion = law.friction == 0 ? law.youngs_modulus * dice.size(-8, -2)
                                   : zero_or(dice, law.youngs_modulus * dice.size(-8, -2));
  const double tip = law.friction == 0
                         ? law.youngs_modulus
                         : law.cohesion / std::tan(law.friction * std::numbers::pi / 180);
  law.tension_cutoff =
      dice.below(2) ? zero_or(dice, tip * dice.unit()) : std::numeric_limits<double>::quiet_NaN();
  return law;
}
inline MohrCoulomb random_law(Dice& dice, const MohrCoulomb*) {
  MohrCoulomb law{};
  law.youngs_modulus = dice.size(2, 11);
  law.poisson_ratio = any_poisson(dice);
  law.friction = zero_or(dice, dice.between(0.1, 60));
  law.dilation = zero_or(dice, law.friction * (dice.below(4) ? dice.unit() : 1.0));
  law.cohesion = law.friction == 0 ? law.youngs_modulus * dice.size(-8, -2)
                                   : zero_or(dice, law.youngs_modulus * dice.size(-8, -2));
  const double apex = law.friction == 0
                          ? law.cohesion
                          : law.cohesion / std::tan(law.friction * std::numbers::pi / 180);
  law.tension_cutoff = zero_or(dice, apex * (dice.below(4) ? dice.unit() : 1.0));
  law.softening = dice.below(3) == 0;
  if (law.softening) {
    law.residual_friction = law.friction * dice.unit();
    law.residual_dilation = law.dilation * dice.unit();
    law.residual_cohesion = law.cohesion * dice.unit();
    law.peak_pdstrain = zero_or(dice, dice.size(-6, -1));
    law.residual_pdstrain = law.peak_pdstrain + dice.size(-4, 0);
  }
  return law;
}
inline ModifiedCamClay random_law(Dice& dice, const ModifiedCamClay*) {
  ModifiedCamClay law{};
  law.youngs_modulus = dice.size(5, 8);
  law.poisson_ratio = dice.between(0, 0.45);
  law.p_ref = dice.size(3, 5);
  law.e_ref = dice.between(0.6, 2);
  law.pc0 = dice.size(3, 6);
  law.ocr = dice.below(2) ? 1 : dice.between(1, 10);
  law.m = dice.between(0.5, 1.7);
  law.lambda = dice.between(0.05, 0.3);
  law.kappa = law.lambda * dice.between(0.05, 0.5);
  law.three_invariants = dice.below(2);
  law.subloading = dice.below(3) == 0;
  law.subloading_u = dice.size(-1, 2);
  law.bonding = dice.below(3) == 0;
  law.s_h = dice.between(0.05, 1);
  law.mc_a = dice.size(3, 6);
  law.mc_b = dice.between(0.5, 2);
  law.mc_c = zero_or(dice, dice.size(2, 5));
  law.mc_d = dice.between(0.5, 2);
  law.m_degradation = zero_or(dice, dice.size(-1, 1));
  law.m_shear = zero_or(dice, dice.size(4, 7));
  return law;
}
inline NorSand random_law(Dice& dice, const NorSand*) {
  NorSand law{};
  law.poisson_ratio = dice.between(0, 0.45);
  law.reference_pressure = dice.size(2, 4);
  law.friction_cs = dice.between(20, 40);
  law.N = dice.between(0, 0.5);
  law.lambda = dice.between(0.01, 0.1);
  law.kappa = law.lambda * dice.between(0.05, 0.5);
  law.gamma = dice.between(0.8, 1.4);
  law.chi = dice.between(1, 5);
  law.hardening_modulus = dice.size(1, 2.7);
  law.void_ratio_initial = law.gamma - dice.between(0.05, 0.35);
  law.p_image_initial = dice.size(3, 6);
  law.bond_model = dice.below(3) == 0;
  law.p_cohesion_initial = dice.size(2, 4);
  law.p_dilation_initial = dice.size(2, 5);
  law.m_cohesion = dice.between(0, 20);
  law.m_dilation = dice.between(0, 20);
  law.m_modulus = dice.between(0, 100);
  return law;
}

template <class LawType>
LawType valid_law(Dice& dice) {
  for (;;) {
    const LawType law = random_law(dice, static_cast<const LawType*>(nullptr));
    if (law.problem().empty()) return law;
  }
}

// By how much [Pa] a stress is beyond what a law allows.

/// Principal stresses [Pa], ascending.
inline Eigen::Vector3d principal(const double* s) {
  Eigen::Matrix3d t;
  t << s[0], s[3], s[5], s[3], s[1], s[4], s[5], s[4], s[2];
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(t, Eigen::EigenvaluesOnly).eigenvalues();
}
inline double mises(const double* s) {
  const double a = s[0] - s[1], b = s[1] - s[2], c = s[2] - s[0];
  return std::sqrt((a * a + b * b + c * c) / 2 + 3 * (s[3] * s[3] + s[4] * s[4] + s[5] * s[5]));
}

template <class LawType>
double beyond(const LawType&, const double*, const double*, const double*) {
  return 0;
}
inline double beyond(const VonMises& law, const double* s, const double*, const double* q) {
  return mises(s) - law.yield_stress - law.hardening_modulus * q[0];
}
inline double beyond(const DruckerPrager& law, const double* s, const double*, const double*) {
  const double sine = std::sin(law.friction * std::numbers::pi / 180),
               cosine = std::cos(law.friction * std::numbers::pi / 180);
  const double p = (s[0] + s[1] + s[2]) / 3;
  const double cone = mises(s) + 6 * sine / (3 - sine) * p - 6 * cosine / (3 - sine) * law.cohesion;
  return std::isnan(law.tension_cutoff) ? cone : std::max(cone, p - law.tension_cutoff);
}
/// With the strength before the increment, which is what it is done with.
inline double beyond(const MohrCoulomb& law, const double* s, const double* before, const double*) {
  constexpr double radian = std::numbers::pi / 180;
  double share = 1;
  if (law.softening && before[6] > law.peak_pdstrain)
    share = std::max(
        0.0, (law.residual_pdstrain - before[6]) / (law.residual_pdstrain - law.peak_pdstrain));
  const double phi =
      law.softening
          ? radian * (law.residual_friction + share * (law.friction - law.residual_friction))
          : radian * law.friction;
  const double c = law.softening
                       ? law.residual_cohesion + share * (law.cohesion - law.residual_cohesion)
                       : law.cohesion;
  const Eigen::Vector3d sigma = principal(s);
  const double shear =
      (sigma[2] - sigma[0]) / 2 / std::cos(phi) + (sigma[2] + sigma[0]) / 2 * std::tan(phi) - c;
  return std::max(shear, sigma[2] - law.tension_cutoff);
}

/// Strength without pressure [Pa], which is rounded too.
template <class LawType>
double strength_of(const LawType& law) {
  if constexpr (requires { law.cohesion; })
    return law.cohesion;
  else if constexpr (requires { law.yield_stress; })
    return law.yield_stress;
  else
    return 0;
}

/// What was found of one law.
struct RandomIncrements {
  std::int64_t done = 0, divided = 0, failed = 0, not_finite = 0, not_allowed = 0;
  std::int64_t unhardened = 0;  ///< plastic strain became less
  std::int64_t unlike = 0;      ///< other bits in packs of another width
  double worst =
      0;  ///< largest share of the stresses about by which one was beyond what is allowed
  std::string first;  ///< the first increment that went wrong
};

/// `Packs` particles, each of all lanes, go a random path together.
template <class LawType, int Dim>
class RandomPaths {
  static constexpr int rows = stress_components<Dim>, width = lanes<Pack>;
  static constexpr std::size_t states = std::max<std::size_t>(1, LawType::state.size());

 public:
  /// A stress beyond what is allowed by less than this share of the stresses about is rounding.
  static constexpr double tolerance = 1e-9;
  /// The same of implicit steps, where MohrCoulombReturn::bisect() found it.
  static constexpr double large_tolerance = 1e-6;
  static constexpr int steps = 32;

  /// One of `look` increments is judged; `widths`: each is done in packs of 1, 2 and 4, too;
  /// `large`: as in implicit steps.
  RandomPaths(std::uint64_t seed, int look, bool widths = false, bool large = false)
      : dice_(seed), look_(look), widths_(widths), large_(large) {}

  /// `increments` of laws with new parameters for every path.
  RandomIncrements run(std::int64_t increments) {
    while (found_.done < increments) path(valid_law<LawType>(dice_));
    return found_;
  }

 private:
  double modulus(const LawType& law) const {
    return std::max({law.wave_modulus(), law.viscosity(), 1.0});
  }

  void path(const LawType& law) {
    const auto prepared = [&] {
      if constexpr (requires { law.prepared(); })
        return law.prepared();
      else
        return law;
    }();
    const double M = modulus(law);
    Pack stress[rows], state[states];
    start(law, M, stress, state);
    // Each lane has a size of its own, and often the one of its neighbour.
    const bool alike = dice_.below(2);
    for (int step = 0; step < steps; ++step) {
      LawInput<Dim, Pack> in;
      in.dt = dice_.size(-6, -1);
      in.large = large_;
      const int kind = dice_.below(8);
      const double common = dice_.size(-24, dice_.below(4) ? -2 : -1);
      double size[width];
      for (double& s : size) s = alike ? common : dice_.size(-24, dice_.below(4) ? -2 : -1);
      for (int a = 0; a < Dim; ++a)
        for (int b = 0; b < Dim; ++b) in.gradient[a][b] = Pack(0.0);
      for (int lane = 0; lane < width; ++lane) increment(kind, size[lane], stress, lane, in);
      in.volumetric = in.rate[0] + in.rate[1] + (Dim == 3 ? in.rate[2] : Pack(0.0));
      in.volumetric *= in.dt;
      Pack before[rows], q[states];
      for (int k = 0; k < rows; ++k) before[k] = stress[k];
      for (std::size_t k = 0; k < states; ++k) q[k] = state[k];
      const Failures failures = update<Dim>(prepared, in, stress, state);
      if (widths_)
        found_.unlike += unlike<1>(prepared, in, before, q, stress, state) +
                         unlike<2>(prepared, in, before, q, stress, state) +
                         unlike<4>(prepared, in, before, q, stress, state);
      judge(law, M, in, before, q, stress, state, failures, step);
    }
  }

  /// Without stress, under isotropic pressure, or one that the law leads to.
  void start(const LawType& law, double M, Pack (&stress)[rows], Pack (&state)[states]) {
    const int kind = dice_.below(4);
    double pressure = kind == 0 ? 0.0 : M * dice_.size(kind == 1 ? -30 : -9, -2);
    if constexpr (std::is_same_v<LawType, ModifiedCamClay>)
      pressure = std::min(pressure, law.pc0 * 0.99);
    if constexpr (std::is_same_v<LawType, NorSand>)
      pressure = std::min(pressure, law.p_image_initial);
    if constexpr (std::is_same_v<LawType, NeoHookean>) pressure = 0;
    for (int k = 0; k < rows; ++k) stress[k] = Pack(k < 3 ? -pressure : 0.0);
    Voigt begin{-pressure, -pressure, -pressure, 0, 0, 0};
    double s[states]{};
    if constexpr (requires { law.initial_state(begin.data(), s); })
      law.initial_state(begin.data(), s);
    for (std::size_t k = 0; k < states; ++k) state[k] = Pack(s[k]);
  }

  void increment(int kind, double size, const Pack* stress, int lane, LawInput<Dim, Pack>& in) {
    double e[6]{};
    double largest = 0;
    for (int k = 0; k < rows; ++k) largest = std::max(largest, std::abs(stress[k][lane]));
    if (kind < 3)  // any
      for (int k = 0; k < rows; ++k) e[k] = dice_.normal_like();
    else if (kind == 3)  // of volume alone
      e[0] = e[1] = e[2] = dice_.below(2) ? 1 : -1;
    else if (kind == 4)  // of one direction
      e[dice_.below(Dim)] = dice_.below(2) ? 1 : -1;
    else if (kind == 5)  // of two equal ones
      e[0] = e[1] = dice_.below(2) ? 1 : -1, e[2] = dice_.normal_like();
    else if (kind == 6 && largest > 0)  // back to where it comes from, or on
      for (int k = 0; k < rows; ++k) e[k] = (dice_.below(2) ? 1 : -1) * stress[k][lane] / largest;
    // else: none
    if (Dim == 2) e[2] = 0;
    for (int k = 0; k < rows; ++k) set_lane(in.rate[k], lane, size * e[k] / in.dt);
    for (int d = 0; d < Dim; ++d) set_lane(in.gradient[d][d], lane, size * e[d] / in.dt);
    for (int d = 0; d < Dim; ++d) {  // 3 xy, 4 yz, 5 xz
      if (Dim == 2 && d > 0) break;
      const int a = d == 1 ? 1 : 0, b = d == 0 ? 1 : 2, k = 3 + d;
      if constexpr (Dim == 3) {
        set_lane(in.gradient[a][b], lane, 0.5 * size * e[k] / in.dt);
        set_lane(in.gradient[b][a], lane, 0.5 * size * e[k] / in.dt);
      } else {
        set_lane(in.gradient[0][1], lane, 0.5 * size * e[3] / in.dt);
        set_lane(in.gradient[1][0], lane, 0.5 * size * e[3] / in.dt);
      }
    }
  }

  static constexpr bool of_stress(std::size_t k) {
    return k < LawType::state.size() && LawType::state[k].of_stress;
  }

  /// Lanes that get other bits in packs of W, and where state variables that follow from the stress
  /// are not numbers: a law does not read them.
  template <int W>
  static int unlike(const auto& prepared, const LawInput<Dim, Pack>& in, const Pack* before,
                    const Pack* q, const Pack* stress, const Pack* state) {
    using Real = PackOf<W>;
    int found = 0;
    for (int first = 0; first + W <= width; first += W) {
      const auto part = [&](const Pack& whole) {
        double values[width];
        store(whole, values);
        return load<Real>(values + first);
      };
      LawInput<Dim, Real> some;
      some.dt = in.dt;
      some.volumetric = part(in.volumetric);
      for (int k = 0; k < rows; ++k) some.rate[k] = part(in.rate[k]);
      for (int a = 0; a < Dim; ++a)
        for (int b = 0; b < Dim; ++b) some.gradient[a][b] = part(in.gradient[a][b]);
      Real s[rows], now[states];
      for (int k = 0; k < rows; ++k) s[k] = part(before[k]);
      for (std::size_t k = 0; k < states; ++k)
        now[k] = of_stress(k) ? Real(std::numeric_limits<double>::quiet_NaN()) : part(q[k]);
      update<Dim>(prepared, some, s, now);
      for (int lane = 0; lane < W; ++lane) {
        const auto differs = [&](const Real& x, const Pack& y) {
          return std::bit_cast<std::uint64_t>(x[lane]) !=
                 std::bit_cast<std::uint64_t>(y[first + lane]);
        };
        bool other = false;
        for (int k = 0; k < rows; ++k) other |= differs(s[k], stress[k]);
        for (std::size_t k = 0; k < states; ++k)
          other |= !of_stress(k) && differs(now[k], state[k]);
        found += other;
      }
    }
    return found;
  }

  void judge(const LawType& law, double M, const LawInput<Dim, Pack>& in, const Pack* before,
             const Pack* q, Pack* stress, Pack* state, const Failures& failures, int step) {
    found_.done += width;
    found_.divided += std::popcount(failures.divided);
    found_.failed += std::popcount(failures.failed);
    Pack sum(0.0);
    for (int k = 0; k < rows; ++k) sum += stress[k] - stress[k];
    for (std::size_t k = 0; k < LawType::state.size(); ++k)
      if (!LawType::state[k].of_stress) sum += state[k] - state[k];
    unsigned bad = failures.failed;
    for (int lane = 0; lane < width; ++lane)
      if (!(sum[lane] == 0)) bad |= 1u << lane, ++found_.not_finite;
    if (bad != 0 && found_.first.empty()) tell("failed", law, in, before, q, stress, bad, step);
    if (--until_look_ > 0 && bad == 0) return;
    until_look_ = look_;
    for (int lane = 0; lane < width && bad == 0; ++lane) {
      double s[6]{}, old[states], now[states], about = 0, strain = 0;
      for (int k = 0; k < rows; ++k) {
        s[k] = stress[k][lane];
        strain += std::abs(in.rate[k][lane]) * in.dt;
        about = std::max({about, std::abs(s[k]), std::abs(before[k][lane])});
      }
      for (std::size_t k = 0; k < states; ++k) old[k] = q[k][lane], now[k] = state[k][lane];
      about += M * strain + strength_of(law);
      double above = beyond(law, s, old, now);
      // In parts, each has the strength that the one before left.
      if (failures.divided >> lane & 1) above = std::min(above, beyond(law, s, now, now));
      const double share = above / (about > 0 ? about : 1e-300);
      for (std::size_t k = 0; k < LawType::state.size(); ++k)
        if (LawType::state[k].name == "pdstrain" && now[k] < old[k]) {
          ++found_.unhardened;
          if (found_.first.empty())
            tell("loses plastic strain", law, in, before, q, stress, 1u << lane, step);
        }
      found_.worst = std::max(found_.worst, share);
      if (share <= (large_ ? large_tolerance : tolerance)) continue;
      ++found_.not_allowed;
      if (found_.first.empty()) tell("not allowed", law, in, before, q, stress, 1u << lane, step);
    }
    if (bad == 0) return;
    for (int k = 0; k < rows; ++k) stress[k] = Pack(0.0);  // a new beginning
    Voigt none{};
    double s[states]{};
    if constexpr (requires { law.initial_state(none.data(), s); })
      law.initial_state(none.data(), s);
    for (std::size_t k = 0; k < states; ++k) state[k] = Pack(s[k]);
  }

  void tell(const char* what, const LawType& law, const LawInput<Dim, Pack>& in, const Pack* before,
            const Pack* q, const Pack* stress, unsigned which, int step) {
    const int lane = std::countr_zero(which);
    char text[64];
    std::string& to = found_.first;
    to = std::string(LawType::name) + " " + what + " at step " + std::to_string(step) + ":";
    const auto put = [&](double value) {
      std::snprintf(text, sizeof text, " %.17g", value);
      to += text;
    };
    for (const auto& p : LawType::parameters) {
      to += "\n  " + std::string(p.key);
      put(p.number ? law.*p.number : law.*p.flag);
    }
    to += "\n  stress";
    for (int k = 0; k < rows; ++k) put(before[k][lane]);
    to += "\n  strain";
    for (int k = 0; k < rows; ++k) put(in.rate[k][lane] * in.dt);
    to += "\n  becomes";
    for (int k = 0; k < rows; ++k) put(stress[k][lane]);
    to += "\n  state";
    for (std::size_t k = 0; k < LawType::state.size(); ++k) put(q[k][lane]);
  }

  Dice dice_;
  int look_, until_look_ = 1;
  bool widths_, large_;
  RandomIncrements found_;
};

}  // namespace lahar::test
