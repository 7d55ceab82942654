/// \file NorSand as CB-Geo MPM computes it; see norsand_law.h.
#pragma once

#include <limits>

#include "physics/materials/norsand_law.h"

namespace lahar {

/// The tangent of the beginning of a step, with which that code takes the whole of it.
template <class Number>
struct NorSandTangent {
  VoigtOf<Number> flow;  ///< gradient of the yield function, compression positive, strain-like
  Number deviatoric;     ///< sqrt(2/3) of the norm of its deviator
  Number hardening;      ///< -dF of a unit of flow by hardening and the loss of bonds [Pa]
};

template <class Number>
NorSandTangent<Number> norsand_tangent(const NorSand& m, const SoilStressOf<Number>& now,
                                       const Number& p, const Number* s) {
  using S = NorSand::State;
  using std::exp, std::log, std::sin, std::sqrt;
  const double M_tc = m.M_tc(), c = M_tc * M_tc / (3 + M_tc);
  const Number P = p + s[S::p_cohesion], P_i = s[S::p_image] + s[S::p_cohesion] + s[S::p_dilation];
  const Number M_i = s[S::M_image], ln = log(P / P_i);
  const bool deviator = now.q > std::numeric_limits<double>::epsilon();
  // dM_i / dtheta; theta grows by towards / |s| per stress.
  const Number turn =
      P * (ln - 1) * M_i / strength_ratio(M_tc, now.theta) * 1.5 * c * sin(1.5 * now.theta);
  NorSandTangent<Number> t;
  for (std::size_t k = 0; k < 6; ++k) {
    // Of compression positive stresses: minus the directions, which are tension positive.
    const Number radial = deviator ? -std::sqrt(1.5) * now.direction[k] : Number(0);
    const Number along =
        deviator ? -turn * now.towards[k] / (std::sqrt(2.0 / 3) * now.q) : Number(0);
    t.flow[k] = (k < 3 ? 1 : 2) * (radial + along) + (k < 3 ? M_i * ln / 3 : Number(0));
  }
  const Number along = deviator ? turn / now.q : Number(0);
  t.deviatoric = deviator && now.towards != VoigtOf<Number>{} ? Number(sqrt(1 + along * along))
                                                              : Number(deviator);
  const Number ratio = p / s[S::p_image];
  const Number image = m.hardening_modulus * (M_i / s[S::M_image_tc]) * ratio * ratio *
                       (exp(-m.chi_image() * s[S::psi_image] / M_tc) - 1 / ratio) * s[S::p_image];
  t.hardening = -M_i * P / P_i * image;
  if (m.bond_model)
    t.hardening +=
        -M_i * (ln - P / P_i) * m.p_cohesion_initial * m.m_cohesion *
            exp(-m.m_cohesion * s[S::pdstrain]) +
        M_i * P / P_i * m.p_dilation_initial * m.m_dilation * exp(-m.m_dilation * s[S::pdstrain]);
  t.hardening *= t.deviatoric;
  return t;
}

/// State variables at the end of a step that was plastic.
template <class Number>
void norsand_harden(const NorSand& m, const VoigtOf<Number>& sigma, Number* s) {
  using S = NorSand::State;
  using std::exp, std::log, std::sqrt;
  constexpr double least = 1e-15;
  const Number M_i = s[S::M_image];
  const SoilStressOf<Number> end = soil_stress(sigma);
  const Number P_end = std::max<Number>(end.p, least) + s[S::p_cohesion];
  s[S::p_image] = P_end * exp(end.q / (P_end * M_i) - 1) - s[S::p_cohesion] - s[S::p_dilation];
  s[S::e_image] =
      std::max<Number>(m.gamma - m.lambda * log(s[S::p_image] / m.reference_pressure), least);
  const Number* e = s + S::plastic_strain;
  const Number mean = (e[0] + e[1] + e[2]) / 3;
  Number sum = 0.5 * (e[3] * e[3] + e[4] * e[4] + e[5] * e[5]);
  for (int k = 0; k < 3; ++k) sum += (e[k] - mean) * (e[k] - mean);
  s[S::pdstrain] = sqrt(2.0 / 3 * sum);
  if (m.bond_model) {
    s[S::p_cohesion] = m.p_cohesion_initial * exp(-m.m_cohesion * s[S::pdstrain]);
    s[S::p_dilation] = m.p_dilation_initial * exp(-m.m_dilation * s[S::pdstrain]);
  }
}

template <class Number>
bool norsand_as_cbgeo(const NorSand& m, const VoigtOf<Number>& strain, VoigtOf<Number>& sigma,
                      Number* s) {
  using S = NorSand::State;
  using std::abs, std::log;
  constexpr double least = 1e-15;  // [Pa] and void ratio, that code's lower bound
  const double M_tc = m.M_tc();
  const SoilStressOf<Number> now = with_lode_angle(soil_stress(sigma));
  const Number p = std::max<Number>(now.p, least);
  const Number K = (1 + s[S::void_ratio]) / m.kappa * p +
                   (m.bond_model ? m.m_modulus * (s[S::p_cohesion] + s[S::p_dilation]) : Number(0));
  const Number G = 3 * K * (1 - 2 * m.poisson_ratio) / (2 * (1 + m.poisson_ratio));
  sigma = elastic_trial(sigma, strain, K, G);
  const SoilStressOf<Number> trial = soil_stress(sigma);

  s[S::psi_image] = s[S::void_ratio] - s[S::e_image];
  const Number mu = 1 - m.chi_image() * m.N * abs(s[S::psi_image]) / M_tc;
  s[S::M_image] = strength_ratio(M_tc, now.theta) * mu;
  s[S::M_image_tc] = M_tc * mu;
  const Number M_i = s[S::M_image], P = std::max<Number>(trial.p, least) + s[S::p_cohesion];
  const Number ln_ratio = log((s[S::p_image] + s[S::p_cohesion] + s[S::p_dilation]) / P);
  const Number ln_cap = -m.chi_image() * s[S::psi_image] / s[S::M_image_tc];
  const Number F = trial.q / P - M_i - M_i * std::min(ln_ratio, ln_cap);
  s[S::void_ratio] = std::max<Number>(
      s[S::void_ratio] + (1 + m.void_ratio_initial) * (strain[0] + strain[1] + strain[2]), least);
  if (!(F > m.cbgeo_tolerance())) return std::isfinite(value_of(F));

  const NorSandTangent<Number> t = norsand_tangent(m, now, p, s);
  const VoigtOf<Number> elastic = elastic_trial({}, t.flow, K, G);  // of compression positive flow
  Number work = 0, stiffness = 0;
  for (std::size_t k = 0; k < 6; ++k) {
    work -= elastic[k] * strain[k];
    stiffness += elastic[k] * t.flow[k];
  }
  const Number multiplier = work / (stiffness - t.hardening);
  for (std::size_t k = 0; k < 6; ++k) {
    sigma[k] += multiplier * elastic[k];
    s[S::plastic_strain + k] += multiplier * t.flow[k];
  }
  norsand_harden(m, sigma, s);
  for (const Number& component : sigma)
    if (!std::isfinite(value_of(component))) return false;
  return std::isfinite(value_of(s[S::p_image]));
}

}  // namespace lahar
