/// \file NorSand, a critical state model of sand, with bonds.
#pragma once

#include <string>

#include "physics/materials/law_input.h"
#include "physics/materials/soil_stress.h"
#include "physics/materials/table.h"
#include "physics/materials/newton.h"

namespace lahar {

/// NorSand in the form of Jefferies and Been (2016, "Soil liquefaction", chapter 3), with the bonds
/// of CB-Geo MPM. Pressures and the plastic volumetric strain are positive in compression:
///   P = p + p_cohesion, P_i = p_i + p_cohesion + p_dilation, psi_i = e - e_i,
///   e_i = gamma - lambda ln(p_i / reference_pressure), critical state: e = e_i at p = p_i
///   yield       F = q - M_i P (1 - ln(P / P_i)) <= 0
///   strength    M_i = M(theta) mu, mu = 1 - chi_i N |psi_i| / M_tc, chi_i = chi / (1 - chi lambda
///   /
///               M_tc); M_tc of friction_cs, M(theta) as strength_ratio()
///   flow        associated, the dependence on theta included: dilatancy M_i ln(P / P_i)
///   hardening   d(ln p_i) = H M(theta) / M_tc ((p / p_i)^2 exp(-chi_i psi_i / M_i,tc) - p / p_i)
///               d(eps_q^p), M_i,tc = M_tc mu: the least dilatancy is chi_i psi_i = chi psi
///   inner cap   p_i <= p exp(-chi_i psi_i / M_i,tc) where the soil yields after unloading
///   elasticity  K = (1 + e) p / kappa + m_modulus (p_cohesion + p_dilation), Poisson's ratio
///   void ratio  d(e) = (1 + e) d(eps_v)
///   bonds       p_cohesion, p_dilation = initial * exp(-m * eps_q^p)
/// eps_q^p is the sum of the increments' norms sqrt(2/3) |d(e^p)|.
///
/// A step is implicit (backward Euler) with the moduli of its beginning. In the deviatoric plane
/// the yield surface has a corner at triaxial compression, in p, q one at q = 0: a stress returned
/// to them has the flow of both sides (Koiter 1953).
struct NorSand {
  double poisson_ratio;
  double reference_pressure;  ///< [Pa]
  double friction_cs;         ///< [degrees]
  double N;
  double lambda;
  double kappa;
  double gamma;
  double chi;
  double hardening_modulus;
  double void_ratio_initial;
  double p_image_initial;  ///< [Pa]
  bool bond_model = false;
  double p_cohesion_initial = 0, p_dilation_initial = 0;  ///< [Pa]
  double m_cohesion = 0, m_dilation = 0, m_modulus = 0;
  double tolerance = 0;

  static constexpr std::string_view name = "NorSand";
  static constexpr std::string_view help = "critical state model of sand, with bonds";
  using Self = NorSand;
  static constexpr auto parameters = std::to_array<Parameter<Self>>({
      {"poisson_ratio", "-", "Poisson's ratio", &Self::poisson_ratio, Bound::poisson},
      {"reference_pressure", "Pa", "pressure at which gamma is given", &Self::reference_pressure,
       Bound::positive},
      {"friction_cs", "deg", "friction angle at the critical state", &Self::friction_cs,
       Bound::angle},
      {"N", "-", "volumetric coupling: how the strength depends on the state, less than 1",
       &Self::N, Bound::not_negative},
      {"lambda", "-", "slope of the critical state line, void ratio against ln p", &Self::lambda,
       Bound::positive},
      {"kappa", "-", "slope of swelling", &Self::kappa, Bound::positive},
      {"gamma", "-", "void ratio of the critical state at reference_pressure", &Self::gamma,
       Bound::positive},
      {"chi", "-", "dilatancy at the peak per state parameter", &Self::chi, Bound::not_negative},
      {"hardening_modulus", "-", "plastic hardening modulus H", &Self::hardening_modulus,
       Bound::positive},
      {"void_ratio_initial", "-", "void ratio at the start", &Self::void_ratio_initial,
       Bound::positive},
      {"p_image_initial", "Pa", "image pressure (size of the yield surface) at the start",
       &Self::p_image_initial, Bound::positive},
      {"bond_model", "true: bonds between grains", &Self::bond_model},
      {"p_cohesion_initial", "Pa", "strength in isotropic tension by bonds",
       &Self::p_cohesion_initial, Bound::not_negative, no_default},
      {"p_dilation_initial", "Pa", "pressure by which bonds enlarge the yield surface",
       &Self::p_dilation_initial, Bound::not_negative, no_default},
      {"m_cohesion", "-", "loss of p_cohesion per deviatoric plastic strain", &Self::m_cohesion,
       Bound::not_negative, no_default},
      {"m_dilation", "-", "loss of p_dilation per deviatoric plastic strain", &Self::m_dilation,
       Bound::not_negative, no_default},
      {"m_modulus", "-", "bulk modulus that bonds add, per p_cohesion + p_dilation",
       &Self::m_modulus, Bound::not_negative, no_default},
      {"tolerance", "-", "of CB-Geo MPM's yield function; here without effect", &Self::tolerance,
       Bound::not_negative, no_default},
  });
  enum State {
    M_theta,
    M_image,
    M_image_tc,
    void_ratio,
    e_image,
    psi_image,
    p_image,
    p_cohesion,
    p_dilation,
    pdstrain,
    plastic_strain,
    states = plastic_strain + 6
  };
  static constexpr auto state = std::to_array<StateVariable>({
      {"M_theta", "-", "critical stress ratio at the Lode angle", true},
      {"M_image", "-", "image stress ratio at the Lode angle"},
      {"M_image_tc", "-", "image stress ratio in triaxial compression"},
      {"void_ratio", "-", "void ratio"},
      {"e_image", "-", "critical void ratio at the image pressure"},
      {"psi_image", "-", "state parameter, void_ratio - e_image"},
      {"p_image", "Pa", "image pressure"},
      {"p_cohesion", "Pa", "strength in isotropic tension by bonds"},
      {"p_dilation", "Pa", "pressure by which bonds enlarge the yield surface"},
      {"pdstrain", "-", "equivalent deviatoric plastic strain"},
      {"plastic_strain0", "-", "plastic strain xx, positive in compression"},
      {"plastic_strain1", "-", "plastic strain yy, positive in compression"},
      {"plastic_strain2", "-", "plastic strain zz, positive in compression"},
      {"plastic_strain3", "-", "plastic shear strain xy, of the sign of those"},
      {"plastic_strain4", "-", "plastic shear strain yz, of the sign of those"},
      {"plastic_strain5", "-", "plastic shear strain xz, of the sign of those"},
  });

  /// mu is not less than this, however far a state is from the critical one.
  static constexpr double least_mu = 0.1;
  /// The stiffness is at least that at this share of p_image_initial, so that soil without stress
  /// can be compressed; for the inner cap p counts as at least as much.
  static constexpr double least_p = 1e-3;
  /// p_i is at least this share of p_image_initial.
  static constexpr double least_p_image = 1e-6;

  double M_tc() const {
    const double sine = std::sin(friction_cs * std::numbers::pi / 180);
    return 6 * sine / (3 - sine);
  }
  double chi_image() const { return chi / (1 - chi * lambda / M_tc()); }

  std::string problem() const {
    if (!(friction_cs > 0)) return "friction_cs must be more than 0";
    if (N >= 1) return "N must be less than 1";
    if (chi * lambda >= M_tc())
      return "chi * lambda must be less than 6 sin(friction_cs) / (3 - sin(friction_cs))";
    for (const auto& p : parameters)
      if (bond_model && p.number && std::isnan(this->*p.number) && p.key != "tolerance")
        return "\"bond_model\": true needs " + std::string(p.key);
    return "";
  }

  void initial_state(const double* stress, double* s) const {
    std::fill_n(s, states, 0.0);
    s[void_ratio] = void_ratio_initial;
    s[p_image] = p_image_initial;
    s[p_cohesion] = bond_model ? p_cohesion_initial : 0;
    s[p_dilation] = bond_model ? p_dilation_initial : 0;
    derive(stress, s);
    finish(s[M_theta], s);
  }

  void derive(const double* stress, double* s) const {
    Voigt sigma;
    std::copy_n(stress, 6, sigma.begin());
    s[M_theta] = strength_ratio(M_tc(), with_lode_angle(soil_stress(sigma)).theta);
  }

  /// At the largest elastic pressure of the beginning, e (2.718) times p_image_initial.
  double wave_modulus() const {
    double s[states] = {};
    s[void_ratio] = void_ratio_initial;
    s[p_cohesion] = bond_model ? p_cohesion_initial : 0;
    s[p_dilation] = bond_model ? p_dilation_initial : 0;
    const double K = bulk_modulus(std::numbers::e * p_image_initial, s);
    return K + 4.0 / 3 * shear_modulus(K);
  }
  double viscosity() const { return 0; }

  bool update_one(const Increment& increment, Voigt& sigma, double* s) const {
    const double p = -(sigma[0] + sigma[1] + sigma[2]) / 3, K = bulk_modulus(p, s);
    const double change =
        distance(elastic_trial(sigma, increment.strain, K, shear_modulus(K)), sigma);
    const double pressure = std::max(p + s[p_cohesion], 0.0) + 0.01 * (s[p_image] + s[p_dilation]);
    const auto take = [this](const Voigt& strain, Voigt& stress, double* state_variables) {
      return step(strain, stress, state_variables);
    };
    return accurate_step<states>(take, increment.strain, change, pressure, sigma, s);
  }

  /// One implicit step, however large. Returns whether it converged.
  bool step(const Voigt& strain, Voigt& sigma, double* s) const {
    Return r;
    r.K = bulk_modulus(-(sigma[0] + sigma[1] + sigma[2]) / 3, s);
    r.G = shear_modulus(r.K);
    r.trial = with_lode_angle(soil_stress(elastic_trial(sigma, strain, r.K, r.G)));
    r.M_tc = M_tc();
    r.chi_i = chi_image();
    r.s = s;
    r.scale =
        std::max({s[p_image] + s[p_cohesion] + s[p_dilation], std::abs(r.trial.p), r.trial.q});
    const double ln_p_i = std::log(s[p_image]);
    const bool held = held_by_cap(r, sigma, ln_p_i);
    r.e = (1 + s[void_ratio]) * std::exp(strain[0] + strain[1] + strain[2]) - 1;
    r.ln_p_i = held ? std::min(inner_cap(r, r.trial.p, ln_p_i), ln_p_i) : ln_p_i;
    r.capped = r.ln_p_i < ln_p_i;
    s[void_ratio] = r.e;
    if (yield_function(r, r.trial, r.ln_p_i) <= newton_tolerance * r.scale) {
      sigma = stress_of(r.trial, r.trial.p, r.trial.q, r.trial.theta);
      finish(strength_ratio(r.M_tc, r.trial.theta), s);
      return true;
    }
    Point end;
    bool done = solve(r, end);
    if (done && r.capped && end.ln_p_i.v > ln_p_i) {  // the pressure grew: not on the cap after all
      r.capped = false;
      r.ln_p_i = ln_p_i;
      done = solve(r, end);
    }
    if (!done) return false;
    take_over(r, end, sigma, s);
    return true;
  }

 private:
  /// A stress is inside of the yield surface, a p_i above its cap, if by this share of it.
  static constexpr double margin = 1e-9;

  /// What the equations of a plastic step are made of.
  struct Return {
    SoilStress trial;
    double K, G, M_tc, chi_i;
    double scale;         ///< [Pa] of stresses in the equations
    const double* s;      ///< state at the beginning
    double e = 0;         ///< void ratio of the end
    double ln_p_i = 0;    ///< at the beginning, p_i in Pa; capped: at the trial pressure
    bool capped = false;  ///< p_i is on its cap; else it hardens
  };
  /// The end of a step.
  struct Point {
    Dual<3> P, q, theta, ln_p_i, p_cohesion, p_dilation, deviatoric;
  };

  double bulk_modulus(double p, const double* s) const {
    const double least = least_p * p_image_initial;
    return (1 + s[void_ratio]) / kappa * std::max(p, least) +
           (bond_model ? m_modulus * (s[p_cohesion] + s[p_dilation]) : 0);
  }
  double shear_modulus(double K) const {
    return 3 * K * (1 - 2 * poisson_ratio) / (2 * (1 + poisson_ratio));
  }

  template <class D>
  D state_parameter(const Return& r, const D& ln_p_i) const {
    return r.e - gamma + lambda * (ln_p_i - std::log(reference_pressure));
  }
  template <class D>
  D strength_share(const Return& r, const D& psi) const {
    using std::abs, std::max;
    return max(D(least_mu), 1.0 - (r.chi_i * N / r.M_tc) * abs(psi));
  }
  /// ln(p_i / p) at the inner cap.
  template <class D>
  D cap(const Return& r, const D& ln_p_i) const {
    const D psi = state_parameter(r, ln_p_i);
    return (-r.chi_i / r.M_tc) * psi / strength_share(r, psi);
  }

  /// ln p_i of the inner cap at a pressure, or the given one where that is less.
  double inner_cap(const Return& r, double p, double ln_p_i) const {
    const double ln_p = std::log(std::max(p, least_p * p_image_initial));
    const auto above = [&](const auto& y) { return y - ln_p - cap(r, y); };
    if (!(above(ln_p_i) > margin)) return ln_p_i;
    std::array<double, 1> y{ln_p_i};
    const auto residual = [&](const Duals<1>& x) { return Duals<1>{above(x[0])}; };
    return newton<1>(residual, y, {10.0}) ? y[0] : ln_p_i;
  }

  double yield_function(const Return& r, const SoilStress& at, double ln_p_i) const {
    const double P = at.p + r.s[p_cohesion];
    if (!(P > 0)) return r.scale;
    const double P_i = std::exp(ln_p_i) + r.s[p_cohesion] + r.s[p_dilation];
    const double M_i =
        strength_ratio(r.M_tc, at.theta) * strength_share(r, state_parameter(r, ln_p_i));
    return at.q - M_i * P * (1 - std::log(P / P_i));
  }

  /// Whether the inner cap limits p_i in a step: at its trial pressure p_i is above the cap, and
  /// the stress at its beginning is inside of the yield surface and of what the cap leaves of it.
  /// (While soil yields, p_i follows its law, to which the cap is the limit.)
  bool held_by_cap(Return r, const Voigt& sigma, double ln_p_i) const {
    r.e = r.s[State::void_ratio];
    const double ln_p = std::log(std::max(r.trial.p, least_p * p_image_initial));
    if (ln_p_i - ln_p <= cap(r, ln_p_i)) return false;  // the cap does not matter
    const SoilStress now = with_lode_angle(soil_stress(sigma));
    return yield_function(r, now, ln_p_i) < -margin * r.scale &&
           yield_function(r, now, inner_cap(r, now.p, ln_p_i)) <= margin * r.scale;
  }

  /// To the smooth surface, or where that leads beyond q = 0, to its tip.
  bool solve(const Return& r, Point& end) const {
    const double P = r.trial.p + r.s[p_cohesion];
    // From a trial stress without pressure: from where the yield surface is flat.
    const double begin = P > 0 ? std::log(P) : r.ln_p_i;
    for (const bool tip : {false, true}) {
      std::array<double, 3> x{0, begin, r.ln_p_i};
      const auto residual = [&](const Duals<3>& unknown) {
        Point point;
        return plastic(r, unknown, tip, point);
      };
      if (!newton<3>(residual, x, {1e3, 1, 1})) continue;
      Duals<3> unknown;
      for (std::size_t i = 0; i < 3; ++i) unknown[i] = Dual<3>::unknown(x[i], i);
      plastic(r, unknown, tip, end);
      if (tip ? in_cone_of_tip(r, end) : x[0] >= 0 && end.q.v >= 0) return true;
    }
    return false;
  }

  /// Whether the plastic strain of a return to the tip lies between the flow of all sides.
  bool in_cone_of_tip(const Return& r, const Point& end) const {
    const double M_i =
        strength_ratio(r.M_tc, end.theta.v) * strength_share(r, state_parameter(r, end.ln_p_i.v));
    const double volumetric = (r.trial.p - (end.P.v - end.p_cohesion.v)) / r.K;
    return volumetric >= M_i * end.deviatoric.v * (1 - 1e-9);
  }

  /// Equations of a step in units of `scale`: flow, yield and hardening. Unknowns: 3 G dgamma /
  /// scale, ln P and ln p_i, where dgamma multiplies the gradient of F. At the tip q = 0 takes the
  /// place of the yield function, and dgamma has no part.
  Duals<3> plastic(const Return& r, const Duals<3>& x, bool tip, Point& e) const {
    using D = Dual<3>;
    const SoilStress& trial = r.trial;
    const D flow = r.scale * x[0];  // 3 G dgamma
    e.theta = tip ? D(trial.theta) : lode_angle(r, flow);
    const D turn = e.theta - trial.theta;
    e.q = tip ? D(0) : trial.q * cos(turn) - flow;
    // Radial and tangential part of the plastic strain; the latter turns the stress.
    const D radial = tip ? D(trial.q) : flow, tangential = trial.q * sin(turn);
    e.deviatoric = (1 / (3 * r.G)) * sqrt(radial * radial + tangential * tangential + 1e-300);
    e.p_cohesion = r.s[State::p_cohesion] * D(1);
    e.p_dilation = r.s[State::p_dilation] * D(1);
    if (bond_model) {
      e.p_cohesion = e.p_cohesion * exp(-m_cohesion * e.deviatoric);
      e.p_dilation = e.p_dilation * exp(-m_dilation * e.deviatoric);
    }
    e.P = exp(x[1]);
    e.ln_p_i = x[2];
    const D p_i = exp(x[2]), p = e.P - e.p_cohesion;
    const D ln_ratio = x[1] - log(p_i + e.p_cohesion + e.p_dilation);
    const D M = strength_ratio_of(r.M_tc, e.theta);
    const D M_i = M * strength_share(r, state_parameter(r, x[2]));
    const D ln_cap = cap(r, x[2]);
    const D floor(least_p * p_image_initial);
    const D above_cap = x[2] - log(max(p, floor)) - ln_cap;
    Duals<3> residual;
    const double per_scale = 1 / r.scale;
    if (tip) {
      residual[0] = x[0];
      residual[1] = ln_ratio - 1.0;
    } else {
      residual[0] = (r.K / (3 * r.G)) * x[0] * M_i * ln_ratio + per_scale * (p - trial.p);
      residual[1] = per_scale * (e.q - M_i * (1.0 - ln_ratio) * e.P);
    }
    const D share = max(p, D(0)) / p_i;
    residual[2] = r.capped ? above_cap
                           : x[2] - r.ln_p_i -
                                 (hardening_modulus / r.M_tc) * M * e.deviatoric *
                                     (share * share * exp(ln_cap) - share);
    return residual;
  }

  static Dual<3> strength_ratio_of(double M_tc, const Dual<3>& theta) {
    const double c = M_tc * M_tc / (3 + M_tc);
    return theta.chain(M_tc - c * std::cos(1.5 * theta.v), 1.5 * c * std::sin(1.5 * theta.v));
  }

  /// Lode angle of the returned stress: q_tr sin(theta - theta_tr) = 3 G dgamma M' / M, the part of
  /// the gradient of F along theta, or pi/3, the corner, where there is none below it.
  Dual<3> lode_angle(const Return& r, const Dual<3>& flow) const {
    const double q = r.trial.q, begin = r.trial.theta, w = std::max(flow.v, 0.0);
    const double c = r.M_tc * r.M_tc / (3 + r.M_tc), corner = std::numbers::pi / 3;
    if (r.trial.towards == Voigt{}) return Dual<3>(begin);
    double low = begin, high = corner, theta = begin, slope = 1, turned = 0;
    const auto equation = [&](double at) {
      const double M = r.M_tc - c * std::cos(1.5 * at);
      turned = 1.5 * c * std::sin(1.5 * at) / M;
      slope = q * std::cos(at - begin) - w * (2.25 * c * std::cos(1.5 * at) / M - turned * turned);
      return q * std::sin(at - begin) - w * turned;
    };
    if (!(equation(corner) > 0)) return Dual<3>(corner);
    for (int i = 0; i < 2 * newton_iterations; ++i) {
      const double value = equation(theta);
      (value > 0 ? high : low) = theta;
      const double next = theta - value / slope;
      const double at = next > low && next < high ? next : (low + high) / 2;
      if (std::abs(at - theta) <= 1e-15 || value == 0) break;
      theta = at;
    }
    equation(theta);
    return flow.chain(theta, turned / slope);
  }

  void take_over(const Return& r, const Point& end, Voigt& sigma, double* s) const {
    const double p = end.P.v - end.p_cohesion.v;
    sigma = stress_of(r.trial, p, end.q.v, end.theta.v);
    const Voigt trial = stress_of(r.trial, r.trial.p, r.trial.q, r.trial.theta);
    const double volumetric = (r.trial.p - p) / r.K;
    for (std::size_t k = 0; k < 6; ++k) {
      const double dp = k < 3 ? p - r.trial.p : 0;  // the difference is then one of deviators
      s[plastic_strain + k] += -(trial[k] - sigma[k] - dp) / (k < 3 ? 2 * r.G : r.G);
      if (k < 3) s[plastic_strain + k] += volumetric / 3;
    }
    s[p_image] = std::max(std::exp(end.ln_p_i.v), least_p_image * p_image_initial);
    s[pdstrain] += end.deviatoric.v;
    s[p_cohesion] = end.p_cohesion.v;
    s[p_dilation] = end.p_dilation.v;
    finish(strength_ratio(r.M_tc, end.theta.v), s);
  }

  /// State variables that follow from the others.
  void finish(double M, double* s) const {
    s[e_image] = gamma - lambda * std::log(s[p_image] / reference_pressure);
    s[psi_image] = s[void_ratio] - s[e_image];
    const double mu = std::max(least_mu, 1 - chi_image() * N / M_tc() * std::abs(s[psi_image]));
    s[M_image] = M * mu;
    s[M_image_tc] = M_tc() * mu;
  }
};

}  // namespace lahar
