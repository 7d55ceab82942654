/// \file Drucker-Prager plasticity.
#pragma once

#include <cmath>
#include <string>

#include "physics/materials/beside_axes.h"
#include "physics/materials/law_input.h"
#include "physics/materials/table.h"

namespace lahar {

/// Perfectly plastic Drucker-Prager cone through the outer corners of Mohr-Coulomb's pyramid
/// (triaxial compression), with a cone of its own for the flow, and a tension cut-off of the mean
/// stress.
struct DruckerPrager {
  double youngs_modulus, poisson_ratio, friction, dilation, cohesion, tension_cutoff;

  static constexpr std::string_view name = "DruckerPrager";
  static constexpr std::string_view help =
      "Drucker-Prager plasticity, matched to Mohr-Coulomb in triaxial compression";
  static constexpr bool native = true;
  static constexpr auto parameters = std::to_array<Parameter<DruckerPrager>>({
      {"youngs_modulus", "Pa", "Young's modulus", &DruckerPrager::youngs_modulus, Bound::positive},
      {"poisson_ratio", "-", "Poisson's ratio", &DruckerPrager::poisson_ratio, Bound::poisson},
      {"friction", "degrees", "friction angle", &DruckerPrager::friction, Bound::angle},
      {"dilation", "degrees", "dilation angle", &DruckerPrager::dilation, Bound::angle, Default{0}},
      {"cohesion", "Pa", "cohesion", &DruckerPrager::cohesion, Bound::not_negative},
      {"tension_cutoff", "Pa", "largest mean stress; without it that of the cone's tip",
       &DruckerPrager::tension_cutoff, Bound::not_negative, no_default},
  });
  static constexpr auto state =
      std::to_array<StateVariable>({{"pdstrain", "-", "plastic deviatoric strain"},
                                    {"pvstrain", "-", "plastic volumetric strain"}});

  double bulk_modulus() const { return youngs_modulus / (3.0 * (1.0 - 2.0 * poisson_ratio)); }
  double shear_modulus() const { return youngs_modulus / (2.0 * (1.0 + poisson_ratio)); }
  double wave_modulus() const { return bulk_modulus() + 4.0 / 3.0 * shear_modulus(); }
  double viscosity() const { return 0; }
  std::string problem() const {
    if (dilation > friction)
      return "'dilation' must be at most 'friction' = " + text_of(friction) + " degrees, found " +
             text_of(dilation);
    if (tension_cutoff > tip() * (1 + 1e-12))
      return "'tension_cutoff' must be at most the mean stress at the cone's tip, cohesion "
             "cot(friction) = " +
             text_of(tip()) + " Pa, found " + text_of(tension_cutoff);
    return "";
  }

  bool has_tension_limit() const { return friction > 0 || !std::isnan(tension_cutoff); }
  /// The lanes whose mean stress is at the cut-off or the tip.
  template <int Rows, class Real>
  LAHAR_INLINE unsigned at_tension_limit(const Real* stress, const Real*,
                                         const Real& tolerance) const {
    return greater(mean_of(stress) + tolerance, Real(highest()));
  }

  /// q <= slope(friction) (tip - p), p <= cut-off, p positive in tension; flow of slope(dilation):
  /// d(ev) = slope(dilation) d(eq). The return is exact: along a straight line to the cone, to the
  /// cut-off, or to the circle where they meet (de Souza Neto et al. 2008, 8.3, with a plane at the
  /// cut-off for the tip).
  template <int Dim, class Real>
  LAHAR_INLINE void update(const LawInput<Dim, Real>& in, Real* stress, Real* state) const {
    const double K = bulk_modulus(), G = shear_modulus();
    const double eta = slope(friction), flow = slope(dilation);
    const double strength = 6.0 * cohesion * std::cos(radians(friction)) /
                            (3.0 - std::sin(radians(friction)));  // eta times the tip, also if 0
    const double limit = highest();
    elastic_trial<Dim>(in, K, G, stress);
    leave_axes<LawInput<Dim, Real>::rows>(stress, K, false);
    StressPoint<LawInput<Dim, Real>::rows, Real> at;
    deviator_of(stress, at);
    const Real q = root3_2 * at.rho;
    // To the cone: q - 3 G x = strength - eta (p - K flow x).
    const Real x = max(q - strength + eta * at.p, Real(0.0)) / (3.0 * G + K * eta * flow);
    Real p = at.p - (K * flow) * x, to_q = q - (3.0 * G) * x;
    // Beyond the cut-off there: to the plane, and where that is beyond the cone, to their circle.
    const unsigned tensile = greater(p, Real(limit));
    const Real circle = Real(std::max(strength - eta * limit, 0.0));
    p = select(tensile, Real(limit), p);
    to_q = select(tensile, -max(-q, -circle), to_q);
    const Real keep = max(to_q, Real(0.0)) / select(greater(q, Real(0.0)), q, Real(1.0));
    state[0] += (q - to_q) * (1.0 / (3.0 * G));
    state[1] += (at.p - p) * (1.0 / K);
    LAHAR_UNROLL
    for (int k = 0; k < in.rows; ++k) stress[k] = keep * at.s[k] + (k < 3 ? p : Real(0.0));
  }

 private:
  static double radians(double degrees) { return degrees * std::numbers::pi / 180.0; }
  static double slope(double degrees) {
    const double sine = std::sin(radians(degrees));
    return 6.0 * sine / (3.0 - sine);
  }
  /// [Pa] the largest mean stress
  double highest() const {
    return std::min(std::isnan(tension_cutoff) ? tip() : tension_cutoff, 1e300);
  }
  /// [Pa] infinite without friction
  double tip() const {
    return friction > 0 ? cohesion / std::tan(radians(friction))
                        : std::numeric_limits<double>::infinity();
  }
};

}  // namespace lahar
