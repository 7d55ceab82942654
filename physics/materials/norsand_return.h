/// \file The implicit step of NorSand, see norsand_law.h.
#pragma once

#include "physics/materials/norsand_law.h"

namespace lahar {

/// A step of one particle. What is known of it may carry derivatives.
template <class Number>
class NorSandReturn {
 public:
  NorSandReturn(const NorSand& law, const VoigtOf<Number>& strain, const VoigtOf<Number>& sigma,
                const Number* state)
      : law_(law), M_tc_(law.M_tc()), chi_i_(law.chi_image()), s_(state) {
    K_ = law.bulk_modulus(-(sigma[0] + sigma[1] + sigma[2]) / 3, state);
    G_ = law.shear_modulus(K_);
    VoigtOf<Number> elastic = elastic_trial(sigma, strain, K_, G_);
    leave_axes<6>(elastic.data(), value_of(K_), true);
    trial_ = with_lode_angle(soil_stress(elastic));
    using std::abs, std::exp, std::log;
    scale_ = value_of(std::max({state[S::p_image] + state[S::p_cohesion] + state[S::p_dilation],
                                Number(abs(trial_.p)), trial_.q}));
    e_ = state[S::void_ratio];
    ln_p_i_ = log(state[S::p_image]);
    capped_ = held_by_cap(sigma);
    e_ = (1 + e_) * exp(strain[0] + strain[1] + strain[2]) - 1;
  }

  /// Stress and state at its end; false if the equations do not converge.
  bool take(VoigtOf<Number>& sigma, Number* s) {
    const Number uncapped = ln_p_i_;
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
    Point<Number> end;
    bool done = solve(end);
    if (done && capped_ && end.ln_p_i > uncapped) {  // the pressure grew: not on the cap after all
      capped_ = false;
      ln_p_i_ = uncapped;
      done = solve(end);
    }
    if (done) take_over(end, sigma, s);
    return done;
  }

  /// Where that fails: the elastic stress, its pressure not below that of the apex, its deviator
  /// reduced to the yield surface, which grows where the pressure is beyond its tip.
  void land(VoigtOf<Number>& sigma, Number* s) {
    using std::exp, std::log;
    Point<Number> end;
    end.deviatoric = trial_.q / (3 * G_);
    set_bonds(end);
    const Number bonds = end.p_cohesion + end.p_dilation;
    const Number tip = exp(ln_p_i_) + bonds;
    const Number P = std::max<Number>(trial_.p + end.p_cohesion, law_.apex * tip);
    const Number p_i = std::max<Number>(exp(ln_p_i_), P / std::numbers::e - bonds);
    end.ln_p_i = log(p_i);
    const Number M_i =
        strength_ratio(M_tc_, trial_.theta) * strength_share(state_parameter(end.ln_p_i));
    const Number most = M_i * P * (1 - log(P / (p_i + bonds)));
    end.P = P;
    end.q = std::clamp<Number>(most, 0.0, trial_.q);
    end.theta = trial_.theta;
    end.deviatoric = (trial_.q - end.q) / (3 * G_);
    take_over(end, sigma, s);
  }

 private:
  using S = NorSand::State;
  /// A stress is inside of the yield surface, a p_i above its cap, if by this share of it.
  static constexpr double margin = 1e-9;

  template <class>
  friend class NorSandReturn;

  /// The end of a step.
  template <class D>
  struct Point {
    D P, q, theta, ln_p_i, p_cohesion, p_dilation, deviatoric;
  };

  const NorSand& law_;
  double M_tc_, chi_i_;
  const Number* s_;             ///< state at the beginning
  SoilStressOf<Number> trial_;  ///< elastic
  Number K_, G_;                ///< of the beginning [Pa]
  double scale_;                ///< [Pa] of stresses in the equations
  Number e_;                    ///< void ratio of the end
  Number ln_p_i_;               ///< at the beginning, p_i in Pa; capped: at the trial pressure
  bool capped_ = false;         ///< p_i is on its inner cap; else it hardens

  /// The step without derivatives; `state` is that of its beginning.
  template <class Other>
  NorSandReturn(const NorSandReturn<Other>& of, const double* state)
      : law_(of.law_),
        M_tc_(of.M_tc_),
        chi_i_(of.chi_i_),
        s_(state),
        trial_{value_of(of.trial_.p), value_of(of.trial_.q), value_of(of.trial_.theta),
               values_of(of.trial_.direction), values_of(of.trial_.towards)},
        K_(value_of(of.K_)),
        G_(value_of(of.G_)),
        scale_(of.scale_),
        e_(value_of(of.e_)),
        ln_p_i_(value_of(of.ln_p_i_)),
        capped_(of.capped_) {}
  /// f(that step).
  template <class F>
  auto without_derivatives(const F& f) const {
    std::array<double, S::states> state;
    for (std::size_t k = 0; k < state.size(); ++k) state[k] = value_of(s_[k]);
    return f(NorSandReturn<double>(*this, state.data()));
  }

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

  /// By how much ln p_i = y is above its inner cap.
  template <class D>
  D above_cap(const D& y, const Number& ln_p) const {
    return y - ln_p - cap(y);
  }
  Number ln_pressure(const Number& p) const {
    using std::log;
    return log(std::max<Number>(p, least_pressure * law_.p_image_initial));
  }

  /// ln p_i of the inner cap at a pressure, or the given one where that is less.
  Number inner_cap(const Number& p, const Number& ln_p_i) const {
    const Number ln_p = ln_pressure(p);
    if (!(above_cap(ln_p_i, ln_p) > margin)) return ln_p_i;
    if constexpr (is_dual<Number>) {
      return without_derivatives([&](const NorSandReturn<double>& values) {
        const double y = values.inner_cap(value_of(p), value_of(ln_p_i));
        if (y == value_of(ln_p_i)) return ln_p_i;
        const double slope = values.above_cap(Dual<1>::unknown(y, 0), value_of(ln_p)).d[0];
        return implicit_root(y, above_cap(Number(y), ln_p), slope);
      });
    } else {
      std::array<double, 1> y{ln_p_i};
      const auto residual = [&](const Duals<1>& x) { return Duals<1>{above_cap(x[0], ln_p)}; };
      return newton<1>(residual, y, {10.0}) ? y[0] : ln_p_i;
    }
  }

  Number yield_function(const SoilStressOf<Number>& at, const Number& ln_p_i) const {
    using std::exp, std::log;
    const Number P = at.p + s_[S::p_cohesion];
    if (!(P > 0)) return scale_;
    const Number P_i = exp(ln_p_i) + s_[S::p_cohesion] + s_[S::p_dilation];
    const Number M_i = strength_ratio(M_tc_, at.theta) * strength_share(state_parameter(ln_p_i));
    return at.q - M_i * P * (1 - log(P / P_i));
  }

  /// Whether the inner cap limits p_i in a step: at its trial pressure p_i is above the cap, and
  /// the stress at its beginning is inside of the yield surface and of what the cap leaves of it.
  /// (While soil yields, p_i follows its law, to which the cap is the limit.)
  bool held_by_cap(const VoigtOf<Number>& sigma) const {
    if (ln_p_i_ - ln_pressure(trial_.p) <= cap(ln_p_i_)) return false;
    const SoilStressOf<Number> now = with_lode_angle(soil_stress(sigma));
    return yield_function(now, ln_p_i_) < -margin * scale_ &&
           yield_function(now, inner_cap(now.p, ln_p_i_)) <= margin * scale_;
  }

  /// To the smooth surface, or where that leads beyond q = 0, to its tip.
  bool solve(Point<Number>& end) const {
    if (to_apex(end)) return true;
    for (const bool tip : {false, true}) {
      std::array<Number, 3> x;
      if (!find_unknowns(tip, x)) continue;
      plastic(x, tip, end);
      if (tip ? in_cone_of_tip(end) : x[0] >= 0 && end.q >= 0) return true;
    }
    return false;
  }
  /// False if the equations do not converge.
  bool find_unknowns(bool tip, std::array<Number, 3>& x) const {
    if constexpr (is_dual<Number>) {
      return without_derivatives([&](const NorSandReturn<double>& values) {
        std::array<double, 3> root;
        if (!values.find_unknowns(tip, root)) return false;
        Duals<3> unknown;
        for (std::size_t i = 0; i < 3; ++i) unknown[i] = Dual<3>::unknown(root[i], i);
        const std::array<Number, 3> constant{root[0], root[1], root[2]};
        typename NorSandReturn<double>::template Point<Dual<3>> at;
        Point<Number> along;
        x = implicit_solution(root, values.plastic(unknown, tip, at),
                              plastic(constant, tip, along));
        return true;
      });
    } else {
      const double P = trial_.p + s_[S::p_cohesion];
      // From a trial stress without pressure: from where the yield surface is flat.
      x = {0, P > 0 ? std::log(P) : ln_p_i_, ln_p_i_};
      const auto residual = [&](const Duals<3>& unknown) {
        Point<Dual<3>> point;
        return plastic(unknown, tip, point);
      };
      return newton<3>(residual, x, {1e3, 1, 1});
    }
  }

  /// To the apex, where soil is torn apart, if the plastic strain dilates more than the flow there.
  bool to_apex(Point<Number>& end) const {
    using std::exp;
    const Number deviatoric = trial_.q / (3 * G_);
    end.deviatoric = deviatoric;
    set_bonds(end);
    const Number p_i = exp(ln_p_i_);
    const Number P = law_.apex * (p_i + end.p_cohesion + end.p_dilation);
    const Number volumetric = (trial_.p - (P - end.p_cohesion)) / K_;
    const Number M_i =
        strength_ratio(M_tc_, trial_.theta) * strength_share(state_parameter(ln_p_i_));
    if (!(volumetric < 0 && volumetric <= M_i * std::log(law_.apex) * deviatoric)) return false;
    end.P = P;
    end.q = 0;
    end.theta = trial_.theta;
    end.ln_p_i = ln_p_i_;
    return true;
  }

  /// p_cohesion and p_dilation after the plastic strain of a step.
  template <class D>
  void set_bonds(Point<D>& e) const {
    using std::exp;
    e.p_cohesion = D(s_[S::p_cohesion]);
    e.p_dilation = D(s_[S::p_dilation]);
    if (!law_.bond_model) return;
    e.p_cohesion = e.p_cohesion * exp(-law_.m_cohesion * e.deviatoric);
    e.p_dilation = e.p_dilation * exp(-law_.m_dilation * e.deviatoric);
  }

  /// Whether the plastic strain of a return to the tip lies between the flow of all sides.
  bool in_cone_of_tip(const Point<Number>& end) const {
    const Number M_i =
        strength_ratio(M_tc_, end.theta) * strength_share(state_parameter(end.ln_p_i));
    const Number volumetric = (trial_.p - (end.P - end.p_cohesion)) / K_;
    return volumetric >= M_i * end.deviatoric * (1 - 1e-9);
  }

  /// Equations of a step in units of `scale`: flow, yield and hardening. Unknowns: 3 G dgamma /
  /// scale, ln P and ln p_i, where dgamma multiplies the gradient of F. At the tip q = 0 takes the
  /// place of the yield function, and dgamma has no part. The unknowns, or what is known, may carry
  /// derivatives.
  template <class D>
  std::array<D, 3> plastic(const std::array<D, 3>& x, bool tip, Point<D>& e) const {
    using std::cos, std::exp, std::log, std::max, std::sin, std::sqrt;
    const SoilStressOf<Number>& trial = trial_;
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
    std::array<D, 3> residual;
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

  template <class D>
  static D strength_ratio_of(double M_tc, const D& theta) {
    const double c = M_tc * M_tc / (3 + M_tc), angle = 1.5 * value_of(theta);
    const double M = M_tc - c * std::cos(angle);
    if constexpr (is_dual<D>)
      return theta.chain(M, 1.5 * c * std::sin(angle));
    else
      return M;
  }

  /// Lode angle of the returned stress: q_tr sin(theta - theta_tr) = 3 G dgamma M' / M, the part of
  /// the gradient of F along theta, or pi/3, the corner, where there is none below it.
  template <class D>
  D lode_angle(const D& flow) const {
    const double q = value_of(trial_.q), begin = value_of(trial_.theta);
    const double w = std::max(value_of(flow), 0.0);
    const double c = M_tc_ * M_tc_ / (3 + M_tc_), corner = std::numbers::pi / 3;
    if (trial_.towards == VoigtOf<Number>{}) return D(trial_.theta);
    double low = begin, high = corner, theta = begin, slope = 1, turned = 0;
    const auto equation = [&](double at) {
      const double M = M_tc_ - c * std::cos(1.5 * at);
      turned = 1.5 * c * std::sin(1.5 * at) / M;
      slope = q * std::cos(at - begin) - w * (2.25 * c * std::cos(1.5 * at) / M - turned * turned);
      return q * std::sin(at - begin) - w * turned;
    };
    if (!(equation(corner) > 0)) return D(corner);
    for (int i = 0; i < 2 * newton_iterations; ++i) {
      const double value = equation(theta), next = theta - value / slope;
      if (std::abs(next - theta) <= 1e-15) break;
      (value > 0 ? high : low) = theta;
      theta = next > low && next < high ? next : (low + high) / 2;
    }
    equation(theta);
    if constexpr (is_dual<Number>)
      return implicit_root(theta, trial_.q * sin(theta - trial_.theta) - turned * flow, slope);
    else if constexpr (is_dual<D>)
      return flow.chain(theta, turned / slope);
    else
      return theta;
  }

  void take_over(const Point<Number>& end, VoigtOf<Number>& sigma, Number* s) const {
    using std::exp;
    const Number p = end.P - end.p_cohesion;
    sigma = stress_of(trial_, p, end.q, end.theta);
    const VoigtOf<Number> trial = stress_of(trial_, trial_.p, trial_.q, trial_.theta);
    const Number volumetric = (trial_.p - p) / K_;
    for (std::size_t k = 0; k < 6; ++k) {
      const Number dp = k < 3 ? p - trial_.p : Number(0);  // the difference is then of deviators
      s[S::plastic_strain + k] += -(trial[k] - sigma[k] - dp) / (k < 3 ? 2 * G_ : G_);
      if (k < 3) s[S::plastic_strain + k] += volumetric / 3;
    }
    s[S::void_ratio] = e_;
    s[S::p_image] = std::max<Number>(exp(end.ln_p_i), law_.least_p_image * law_.p_image_initial);
    s[S::pdstrain] += end.deviatoric;
    s[S::p_cohesion] = end.p_cohesion;
    s[S::p_dilation] = end.p_dilation;
    law_.finish(strength_ratio(M_tc_, end.theta), s);
  }
};

template <class Number>
void NorSand::land(const IncrementOf<Number>& increment, VoigtOf<Number>& sigma, Number* s) const {
  std::array<Number, states> after;
  std::copy_n(s, std::size_t{states}, after.begin());
  VoigtOf<Number> stepped = sigma;
  bool stands = step(increment.strain, stepped, after.data());
  for (const Number& component : stepped) stands = stands && std::isfinite(value_of(component));
  for (std::size_t k = 0; k < after.size(); ++k)
    stands = stands && (state[k].of_stress || std::isfinite(value_of(after[k])));
  if (!stands) return NorSandReturn<Number>(*this, increment.strain, sigma, s).land(sigma, s);
  sigma = stepped;
  std::copy_n(after.begin(), std::size_t{states}, s);
}

template <class Number>
bool NorSand::step(const VoigtOf<Number>& strain, VoigtOf<Number>& sigma, Number* s) const {
  return NorSandReturn<Number>(*this, strain, sigma, s).take(sigma, s);
}

}  // namespace lahar
