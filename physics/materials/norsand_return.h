/// \file The implicit step of NorSand, see norsand_law.h.
#pragma once

#include "physics/materials/norsand_law.h"

namespace lahar {

/// A step of one particle.
class NorSandReturn {
 public:
  NorSandReturn(const NorSand& law, const Voigt& strain, const Voigt& sigma, const double* state)
      : law_(law), M_tc_(law.M_tc()), chi_i_(law.chi_image()), s_(state) {
    K_ = law.bulk_modulus(-(sigma[0] + sigma[1] + sigma[2]) / 3, state);
    G_ = law.shear_modulus(K_);
    trial_ = with_lode_angle(soil_stress(elastic_trial(sigma, strain, K_, G_)));
    scale_ = std::max({state[S::p_image] + state[S::p_cohesion] + state[S::p_dilation],
                       std::abs(trial_.p), trial_.q});
    e_ = state[S::void_ratio];
    ln_p_i_ = std::log(state[S::p_image]);
    capped_ = held_by_cap(sigma);
    e_ = (1 + e_) * std::exp(strain[0] + strain[1] + strain[2]) - 1;
  }

  /// Stress and state at its end; false if the equations do not converge.
  bool take(Voigt& sigma, double* s) {
    const double uncapped = ln_p_i_;
    if (capped_) {
      ln_p_i_ = inner_cap(trial_.p, ln_p_i_);
      capped_ = ln_p_i_ < uncapped;
    }
    if (yield_function(trial_, ln_p_i_) <= newton_tolerance * scale_) {
      sigma = stress_of(trial_, trial_.p, trial_.q, trial_.theta);
      s[S::void_ratio] = e_;
      law_.finish(strength_ratio(M_tc_, trial_.theta), s);
      return true;
    }
    Point end;
    bool done = solve(end);
    if (done && capped_ &&
        end.ln_p_i.v > uncapped) {  // the pressure grew: not on the cap after all
      capped_ = false;
      ln_p_i_ = uncapped;
      done = solve(end);
    }
    if (done) take_over(end, sigma, s);
    return done;
  }

  /// Where that fails: the elastic stress, its pressure not below that of the apex, its deviator
  /// reduced to the yield surface, which grows where the pressure is beyond its tip.
  void land(Voigt& sigma, double* s) {
    Point end;
    end.deviatoric = trial_.q / (3 * G_);
    set_bonds(end);
    const double cohesion = end.p_cohesion.v, bonds = cohesion + end.p_dilation.v;
    const double tip = std::exp(ln_p_i_) + bonds;
    const double P = std::max(trial_.p + cohesion, law_.apex * tip);
    const double p_i = std::max(std::exp(ln_p_i_), P / std::numbers::e - bonds);
    end.ln_p_i = std::log(p_i);
    const double M_i =
        strength_ratio(M_tc_, trial_.theta) * strength_share(state_parameter(end.ln_p_i.v));
    const double most = M_i * P * (1 - std::log(P / (p_i + bonds)));
    end.P = P;
    end.q = std::clamp(most, 0.0, trial_.q);
    end.theta = trial_.theta;
    end.deviatoric = (trial_.q - end.q.v) / (3 * G_);
    take_over(end, sigma, s);
  }

 private:
  using S = NorSand::State;
  /// A stress is inside of the yield surface, a p_i above its cap, if by this share of it.
  static constexpr double margin = 1e-9;

  /// The end of a step.
  struct Point {
    Dual<3> P, q, theta, ln_p_i, p_cohesion, p_dilation, deviatoric;
  };

  const NorSand& law_;
  double M_tc_, chi_i_;
  const double* s_;      ///< state at the beginning
  SoilStress trial_;     ///< elastic
  double K_, G_;         ///< of the beginning [Pa]
  double scale_;         ///< [Pa] of stresses in the equations
  double e_;             ///< void ratio of the end
  double ln_p_i_;        ///< at the beginning, p_i in Pa; capped: at the trial pressure
  bool capped_ = false;  ///< p_i is on its inner cap; else it hardens

  template <class D>
  D state_parameter(const D& ln_p_i) const {
    return e_ - law_.gamma + law_.lambda * (ln_p_i - std::log(law_.reference_pressure));
  }
  template <class D>
  D strength_share(const D& psi) const {
    using std::abs, std::max;
    return max(D(law_.least_mu), 1.0 - (chi_i_ * law_.N / M_tc_) * abs(psi));
  }
  /// ln(p_i / p) at the inner cap.
  template <class D>
  D cap(const D& ln_p_i) const {
    const D psi = state_parameter(ln_p_i);
    return bounded((-chi_i_ / M_tc_) * psi / strength_share(psi), law_.most_ln_cap);
  }

  /// ln p_i of the inner cap at a pressure, or the given one where that is less.
  double inner_cap(double p, double ln_p_i) const {
    const double ln_p = std::log(std::max(p, least_pressure * law_.p_image_initial));
    const auto above = [&](const auto& y) { return y - ln_p - cap(y); };
    if (!(above(ln_p_i) > margin)) return ln_p_i;
    std::array<double, 1> y{ln_p_i};
    const auto residual = [&](const Duals<1>& x) { return Duals<1>{above(x[0])}; };
    return newton<1>(residual, y, {10.0}) ? y[0] : ln_p_i;
  }

  double yield_function(const SoilStress& at, double ln_p_i) const {
    const double P = at.p + s_[S::p_cohesion];
    if (!(P > 0)) return scale_;
    const double P_i = std::exp(ln_p_i) + s_[S::p_cohesion] + s_[S::p_dilation];
    const double M_i = strength_ratio(M_tc_, at.theta) * strength_share(state_parameter(ln_p_i));
    return at.q - M_i * P * (1 - std::log(P / P_i));
  }

  /// Whether the inner cap limits p_i in a step: at its trial pressure p_i is above the cap, and
  /// the stress at its beginning is inside of the yield surface and of what the cap leaves of it.
  /// (While soil yields, p_i follows its law, to which the cap is the limit.)
  bool held_by_cap(const Voigt& sigma) const {
    const double ln_p = std::log(std::max(trial_.p, least_pressure * law_.p_image_initial));
    if (ln_p_i_ - ln_p <= cap(ln_p_i_)) return false;
    const SoilStress now = with_lode_angle(soil_stress(sigma));
    return yield_function(now, ln_p_i_) < -margin * scale_ &&
           yield_function(now, inner_cap(now.p, ln_p_i_)) <= margin * scale_;
  }

  /// To the smooth surface, or where that leads beyond q = 0, to its tip.
  bool solve(Point& end) const {
    if (to_apex(end)) return true;
    const double P = trial_.p + s_[S::p_cohesion];
    // From a trial stress without pressure: from where the yield surface is flat.
    const double begin = P > 0 ? std::log(P) : ln_p_i_;
    for (const bool tip : {false, true}) {
      std::array<double, 3> x{0, begin, ln_p_i_};
      const auto residual = [&](const Duals<3>& unknown) {
        Point point;
        return plastic(unknown, tip, point);
      };
      if (!newton<3>(residual, x, {1e3, 1, 1})) continue;
      Duals<3> unknown;
      for (std::size_t i = 0; i < 3; ++i) unknown[i] = Dual<3>::unknown(x[i], i);
      plastic(unknown, tip, end);
      if (tip ? in_cone_of_tip(end) : x[0] >= 0 && end.q.v >= 0) return true;
    }
    return false;
  }

  /// To the apex, where soil is torn apart, if the plastic strain dilates more than the flow there.
  bool to_apex(Point& end) const {
    const double deviatoric = trial_.q / (3 * G_);
    end.deviatoric = deviatoric;
    set_bonds(end);
    const double p_i = std::exp(ln_p_i_), cohesion = end.p_cohesion.v;
    const double P = law_.apex * (p_i + cohesion + end.p_dilation.v);
    const double volumetric = (trial_.p - (P - cohesion)) / K_;
    const double M_i =
        strength_ratio(M_tc_, trial_.theta) * strength_share(state_parameter(ln_p_i_));
    if (!(volumetric < 0 && volumetric <= M_i * std::log(law_.apex) * deviatoric)) return false;
    end.P = P;
    end.q = 0;
    end.theta = trial_.theta;
    end.ln_p_i = ln_p_i_;
    return true;
  }

  /// p_cohesion and p_dilation after the plastic strain of a step.
  void set_bonds(Point& e) const {
    e.p_cohesion = Dual<3>(s_[S::p_cohesion]);
    e.p_dilation = Dual<3>(s_[S::p_dilation]);
    if (!law_.bond_model) return;
    e.p_cohesion = e.p_cohesion * exp(-law_.m_cohesion * e.deviatoric);
    e.p_dilation = e.p_dilation * exp(-law_.m_dilation * e.deviatoric);
  }

  /// Whether the plastic strain of a return to the tip lies between the flow of all sides.
  bool in_cone_of_tip(const Point& end) const {
    const double M_i =
        strength_ratio(M_tc_, end.theta.v) * strength_share(state_parameter(end.ln_p_i.v));
    const double volumetric = (trial_.p - (end.P.v - end.p_cohesion.v)) / K_;
    return volumetric >= M_i * end.deviatoric.v * (1 - 1e-9);
  }

  /// Equations of a step in units of `scale`: flow, yield and hardening. Unknowns: 3 G dgamma /
  /// scale, ln P and ln p_i, where dgamma multiplies the gradient of F. At the tip q = 0 takes the
  /// place of the yield function, and dgamma has no part.
  Duals<3> plastic(const Duals<3>& x, bool tip, Point& e) const {
    using D = Dual<3>;
    const SoilStress& trial = trial_;
    const D flow = scale_ * x[0];  // 3 G dgamma
    e.theta = tip ? D(trial.theta) : lode_angle(flow);
    const D turn = e.theta - trial.theta;
    e.q = tip ? D(0) : trial.q * cos(turn) - flow;
    // Radial and tangential part of the plastic strain; the latter turns the stress.
    const D radial = tip ? D(trial.q) : flow, tangential = trial.q * sin(turn);
    e.deviatoric = (1 / (3 * G_)) * sqrt(radial * radial + tangential * tangential + 1e-300);
    set_bonds(e);
    e.P = exp(x[1]);
    e.ln_p_i = x[2];
    const D p_i = exp(x[2]), p = e.P - e.p_cohesion;
    const D ln_ratio = x[1] - log(p_i + e.p_cohesion + e.p_dilation);
    const D M = strength_ratio_of(M_tc_, e.theta);
    const D M_i = M * strength_share(state_parameter(x[2]));
    const D ln_cap = cap(x[2]);
    const D floor(least_pressure * law_.p_image_initial);
    const D above_cap = x[2] - log(max(p, floor)) - ln_cap;
    Duals<3> residual;
    const double per_scale = 1 / scale_;
    if (tip) {
      residual[0] = x[0];
      residual[1] = ln_ratio - 1.0;
    } else {
      residual[0] = (K_ / (3 * G_)) * x[0] * M_i * ln_ratio + per_scale * (p - trial.p);
      residual[1] = per_scale * (e.q - M_i * (1.0 - ln_ratio) * e.P);
    }
    const D share = max(p, D(0)) / p_i;
    residual[2] = capped_ ? above_cap
                          : x[2] - ln_p_i_ -
                                (law_.hardening_modulus / M_tc_) * M * e.deviatoric *
                                    (share * share * exp(ln_cap) - share);
    return residual;
  }

  static Dual<3> strength_ratio_of(double M_tc, const Dual<3>& theta) {
    const double c = M_tc * M_tc / (3 + M_tc);
    return theta.chain(M_tc - c * std::cos(1.5 * theta.v), 1.5 * c * std::sin(1.5 * theta.v));
  }

  /// Lode angle of the returned stress: q_tr sin(theta - theta_tr) = 3 G dgamma M' / M, the part of
  /// the gradient of F along theta, or pi/3, the corner, where there is none below it.
  Dual<3> lode_angle(const Dual<3>& flow) const {
    const double q = trial_.q, begin = trial_.theta, w = std::max(flow.v, 0.0);
    const double c = M_tc_ * M_tc_ / (3 + M_tc_), corner = std::numbers::pi / 3;
    if (trial_.towards == Voigt{}) return Dual<3>(begin);
    double low = begin, high = corner, theta = begin, slope = 1, turned = 0;
    const auto equation = [&](double at) {
      const double M = M_tc_ - c * std::cos(1.5 * at);
      turned = 1.5 * c * std::sin(1.5 * at) / M;
      slope = q * std::cos(at - begin) - w * (2.25 * c * std::cos(1.5 * at) / M - turned * turned);
      return q * std::sin(at - begin) - w * turned;
    };
    if (!(equation(corner) > 0)) return Dual<3>(corner);
    for (int i = 0; i < 2 * newton_iterations; ++i) {
      const double value = equation(theta), next = theta - value / slope;
      if (std::abs(next - theta) <= 1e-15) break;
      (value > 0 ? high : low) = theta;
      theta = next > low && next < high ? next : (low + high) / 2;
    }
    equation(theta);
    return flow.chain(theta, turned / slope);
  }

  void take_over(const Point& end, Voigt& sigma, double* s) const {
    const double p = end.P.v - end.p_cohesion.v;
    sigma = stress_of(trial_, p, end.q.v, end.theta.v);
    const Voigt trial = stress_of(trial_, trial_.p, trial_.q, trial_.theta);
    const double volumetric = (trial_.p - p) / K_;
    for (std::size_t k = 0; k < 6; ++k) {
      const double dp = k < 3 ? p - trial_.p : 0;  // the difference is then one of deviators
      s[S::plastic_strain + k] += -(trial[k] - sigma[k] - dp) / (k < 3 ? 2 * G_ : G_);
      if (k < 3) s[S::plastic_strain + k] += volumetric / 3;
    }
    s[S::void_ratio] = e_;
    s[S::p_image] = std::max(std::exp(end.ln_p_i.v), law_.least_p_image * law_.p_image_initial);
    s[S::pdstrain] += end.deviatoric.v;
    s[S::p_cohesion] = end.p_cohesion.v;
    s[S::p_dilation] = end.p_dilation.v;
    law_.finish(strength_ratio(M_tc_, end.theta.v), s);
  }
};

inline void NorSand::land(const Increment& increment, Voigt& sigma, double* s) const {
  std::array<double, states> after;
  std::copy_n(s, std::size_t{states}, after.begin());
  Voigt stepped = sigma;
  bool stands = step(increment.strain, stepped, after.data());
  for (const double value : stepped) stands = stands && std::isfinite(value);
  for (std::size_t k = 0; k < after.size(); ++k)
    stands = stands && (state[k].of_stress || std::isfinite(after[k]));
  if (!stands) return NorSandReturn(*this, increment.strain, sigma, s).land(sigma, s);
  sigma = stepped;
  std::copy_n(after.begin(), std::size_t{states}, s);
}

inline bool NorSand::step(const Voigt& strain, Voigt& sigma, double* s) const {
  return NorSandReturn(*this, strain, sigma, s).take(sigma, s);
}

}  // namespace lahar
