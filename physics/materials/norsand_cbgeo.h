/// \file NorSand as CB-Geo MPM computes it; see norsand_law.h.
#pragma once

#include <limits>

#include "physics/materials/norsand_law.h"

namespace lahar {

/// The tangent of the beginning of a step, with which that code takes the whole of it.
struct NorSandTangent {
  Voigt flow;         ///< gradient of the yield function, compression positive, strain-like
  double deviatoric;  ///< sqrt(2/3) of the norm of its deviator
  double hardening;   ///< -dF of a unit of flow by hardening and the loss of bonds [Pa]
};

inline NorSandTangent norsand_tangent(const NorSand& m, const SoilStress& now, double p,
                                      const double* s) {
  using S = NorSand::State;
  const double M_tc = m.M_tc(), c = M_tc * M_tc / (3 + M_tc);
  const double P = p + s[S::p_cohesion], P_i = s[S::p_image] + s[S::p_cohesion] + s[S::p_dilation];
  const double M_i = s[S::M_image], ln = std::log(P / P_i);
  const bool deviator = now.q > std::numeric_limits<double>::epsilon();
  // dM_i / dtheta; theta grows by towards / |s| per stress.
  const double turn =
      P * (ln - 1) * M_i / strength_ratio(M_tc, now.theta) * 1.5 * c * std::sin(1.5 * now.theta);
  NorSandTangent t;
  for (std::size_t k = 0; k < 6; ++k) {
    // Of compression positive stresses: minus the directions, which are tension positive.
    const double radial = deviator ? -std::sqrt(1.5) * now.direction[k] : 0;
    const double along = deviator ? -turn * now.towards[k] / (std::sqrt(2.0 / 3) * now.q) : 0;
    t.flow[k] = (k < 3 ? 1 : 2) * (radial + along) + (k < 3 ? M_i * ln / 3 : 0);
  }
  const double along = deviator ? turn / now.q : 0;
  t.deviatoric = deviator && now.towards != Voigt{} ? std::sqrt(1 + along * along) : deviator;
  const double ratio = p / s[S::p_image];
  const double image = m.hardening_modulus * (M_i / s[S::M_image_tc]) * ratio * ratio *
                       (std::exp(-m.chi_image() * s[S::psi_image] / M_tc) - 1 / ratio) *
                       s[S::p_image];
  t.hardening = -M_i * P / P_i * image;
  if (m.bond_model)
    t.hardening += -M_i * (ln - P / P_i) * m.p_cohesion_initial * m.m_cohesion *
                       std::exp(-m.m_cohesion * s[S::pdstrain]) +
                   M_i * P / P_i * m.p_dilation_initial * m.m_dilation *
                       std::exp(-m.m_dilation * s[S::pdstrain]);
  t.hardening *= t.deviatoric;
  return t;
}

inline bool norsand_as_cbgeo(const NorSand& m, const Voigt& strain, Voigt& sigma, double* s) {
  using S = NorSand::State;
  constexpr double least = 1e-15;  // [Pa] and void ratio, that code's lower bound
  const double M_tc = m.M_tc();
  const SoilStress now = with_lode_angle(soil_stress(sigma));
  const double p = std::max(now.p, least);
  const double K = (1 + s[S::void_ratio]) / m.kappa * p +
                   (m.bond_model ? m.m_modulus * (s[S::p_cohesion] + s[S::p_dilation]) : 0);
  const double G = 3 * K * (1 - 2 * m.poisson_ratio) / (2 * (1 + m.poisson_ratio));
  sigma = elastic_trial(sigma, strain, K, G);
  const SoilStress trial = with_lode_angle(soil_stress(sigma));

  s[S::psi_image] = s[S::void_ratio] - s[S::e_image];
  const double mu = 1 - m.chi_image() * m.N * std::abs(s[S::psi_image]) / M_tc;
  s[S::M_image] = strength_ratio(M_tc, now.theta) * mu;
  s[S::M_image_tc] = M_tc * mu;
  const double M_i = s[S::M_image], P = std::max(trial.p, least) + s[S::p_cohesion];
  const double ln_ratio = std::log((s[S::p_image] + s[S::p_cohesion] + s[S::p_dilation]) / P);
  const double ln_cap = -m.chi_image() * s[S::psi_image] / s[S::M_image_tc];
  const double F = trial.q / P - M_i - M_i * std::min(ln_ratio, ln_cap);
  s[S::void_ratio] = std::max(
      s[S::void_ratio] + (1 + m.void_ratio_initial) * (strain[0] + strain[1] + strain[2]), least);
  if (!(F > m.cbgeo_tolerance())) return std::isfinite(F);

  const NorSandTangent t = norsand_tangent(m, now, p, s);
  const Voigt elastic = elastic_trial({}, t.flow, K, G);  // of compression positive flow
  double work = 0, stiffness = 0;
  for (std::size_t k = 0; k < 6; ++k) {
    work -= elastic[k] * strain[k];
    stiffness += elastic[k] * t.flow[k];
  }
  const double multiplier = work / (stiffness - t.hardening);
  for (std::size_t k = 0; k < 6; ++k) {
    sigma[k] += multiplier * elastic[k];
    s[S::plastic_strain + k] += multiplier * t.flow[k];
  }
  const SoilStress end = soil_stress(sigma);
  const double P_end = std::max(end.p, least) + s[S::p_cohesion];
  s[S::p_image] = P_end * std::exp(end.q / (P_end * M_i) - 1) - s[S::p_cohesion] - s[S::p_dilation];
  s[S::e_image] =
      std::max(m.gamma - m.lambda * std::log(s[S::p_image] / m.reference_pressure), least);
  const double* e = s + S::plastic_strain;
  const double mean = (e[0] + e[1] + e[2]) / 3;
  double sum = 0.5 * (e[3] * e[3] + e[4] * e[4] + e[5] * e[5]);
  for (int k = 0; k < 3; ++k) sum += (e[k] - mean) * (e[k] - mean);
  s[S::pdstrain] = std::sqrt(2.0 / 3 * sum);
  if (m.bond_model) {
    s[S::p_cohesion] = m.p_cohesion_initial * std::exp(-m.m_cohesion * s[S::pdstrain]);
    s[S::p_dilation] = m.p_dilation_initial * std::exp(-m.m_dilation * s[S::pdstrain]);
  }
  for (const double component : sigma)
    if (!std::isfinite(component)) return false;
  return std::isfinite(s[S::p_image]);
}

}  // namespace lahar
