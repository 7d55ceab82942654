/// \file NorSand, a critical state model of sand, with bonds.
#pragma once

#include <string>

#include "physics/materials/law_input.h"
#include "physics/materials/newton.h"
#include "physics/materials/soil_stress.h"
#include "physics/materials/table.h"

namespace lahar {

struct NorSand;
/// An explicit step as CB-Geo MPM takes it; false if the result is not finite.
template <class Number>
bool norsand_as_cbgeo(const NorSand& m, const VoigtOf<Number>& strain, VoigtOf<Number>& sigma,
                      Number* s);
template <class Number>
class NorSandReturn;

/// NorSand in the form of Jefferies and Been (2016, "Soil liquefaction", chapter 3), with the bonds
/// of CB-Geo MPM. Pressures and the plastic volumetric strain are positive in compression:
///   P = p + p_cohesion, P_i = p_i + p_cohesion + p_dilation, psi_i = e - e_i,
///   e_i = gamma - lambda ln(p_i / reference_pressure), critical state: e = e_i at p = p_i
///   yield       F = q - M_i P (1 - ln(P / P_i)) <= 0
///   strength    M_i = M(theta) mu, mu = 1 - chi_i N |psi_i| / M_tc, M_tc of
///               friction_cs, M(theta) as strength_ratio(), chi_i = chi / (1 - chi lambda / M_tc)
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
///
/// CB-Geo MPM (--as-cbgeo) takes explicit steps with the tangent of their beginning. It differs
/// from these equations where: its hardening law has M_tc for M_i,tc; its tangent takes M_i as
/// constant, so that p_i, taken from the yield function, does not follow the hardening law
/// (together 1 % of the strength in its own unit test, in the limit of small steps); a tangent is
/// taken where a step begins inside of the yield surface (18 % there, with steps of 1 %); d(e) = (1
/// + initial e) d(eps_v); eps_q^p is that of the sum of plastic strains, so that bonds heal in
/// reversed loading.
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
  bool as_cbgeo = false;  ///< the reference code's explicit steps, see norsand_as_cbgeo()

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
      {"tolerance", "-", "of CB-Geo MPM's yield function, used --as-cbgeo", &Self::tolerance,
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
  /// |ln(p_i / p)| of the limit of hardening is not more than this.
  static constexpr double most_ln_cap = 3;
  /// Where P falls to this share of P_i the stress is that of the apex, without deviator.
  static constexpr double apex = 1e-6;
  /// p_i is at least this share of p_image_initial.
  static constexpr double least_p_image = 1e-6;

  double M_tc() const {
    const double sine = std::sin(friction_cs * std::numbers::pi / 180);
    return 6 * sine / (3 - sine);
  }
  double cbgeo_tolerance() const {
    return std::isnan(tolerance) ? std::numeric_limits<double>::epsilon() : tolerance;
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
  /// Of elastic waves at a stress.
  WaveModuli wave_moduli(const Voigt& stress, const double* s) const {
    const double K = bulk_modulus(-(stress[0] + stress[1] + stress[2]) / 3, s),
                 G = shear_modulus(K);
    return {K + 4.0 / 3 * G, G};
  }
  double viscosity() const { return 0; }

  template <class Number>
  bool update_one(const IncrementOf<Number>& increment, VoigtOf<Number>& sigma, Number* s) const {
    if (as_cbgeo) return norsand_as_cbgeo(*this, increment.strain, sigma, s);
    const Number p = -(sigma[0] + sigma[1] + sigma[2]) / 3, K = bulk_modulus(p, s);
    const double change =
        distance(elastic_trial(sigma, increment.strain, K, shear_modulus(K)), sigma);
    const double pressure = std::max(value_of(p + s[p_cohesion]), 0.0) +
                            0.01 * value_of(s[p_image] + s[p_dilation]) +
                            least_pressure * p_image_initial;
    const auto take = [this](const auto& strain, auto& stress, auto* state_variables) {
      return step(strain, stress, state_variables);
    };
    if (increment.large)
      return smooth_steps<states>(take, increment.strain, pressure, sigma, s) ||
             land_in_steps(*this, increment, sigma, s);
    return accurate_step<states>(take, increment.strain, change, pressure, sigma, s);
  }

  /// One implicit step, however large. Returns whether it converged.
  template <class Number>
  bool step(const VoigtOf<Number>& strain, VoigtOf<Number>& sigma, Number* s) const;
  /// An increment for which no step is small enough: see NorSandReturn::land().
  template <class Number>
  void land(const IncrementOf<Number>& increment, VoigtOf<Number>& sigma, Number* s) const;

 private:
  template <class Number>
  friend class NorSandReturn;
  template <class Number>
  friend bool norsand_as_cbgeo(const NorSand&, const VoigtOf<Number>&, VoigtOf<Number>&, Number*);

  template <class Number>
  Number bulk_modulus(const Number& p, const Number* s) const {
    return swelling_modulus(s[void_ratio], kappa, p, p_image_initial) +
           (bond_model ? m_modulus * (s[p_cohesion] + s[p_dilation]) : Number(0));
  }
  template <class Number>
  Number shear_modulus(const Number& K) const {
    return 3 * K * (1 - 2 * poisson_ratio) / (2 * (1 + poisson_ratio));
  }

  /// State variables that follow from the others.
  template <class Number>
  void finish(const Number& M, Number* s) const {
    using std::abs, std::log;
    s[e_image] = gamma - lambda * log(s[p_image] / reference_pressure);
    s[psi_image] = s[void_ratio] - s[e_image];
    const Number mu = std::max<Number>(least_mu, 1 - chi_image() * N / M_tc() * abs(s[psi_image]));
    s[M_image] = M * mu;
    s[M_image_tc] = M_tc() * mu;
  }
};

}  // namespace lahar
