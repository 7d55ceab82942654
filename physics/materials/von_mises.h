/// \file Von Mises plasticity.
#pragma once

#include <string>

#include "physics/materials/law_input.h"
#include "physics/materials/stress_invariants.h"
#include "physics/materials/table.h"

namespace lahar {

/// Von Mises plasticity with linear isotropic hardening, for metals and undrained clay.
struct VonMises {
  double youngs_modulus, poisson_ratio, yield_stress, hardening_modulus = 0;

  static constexpr std::string_view name = "VonMises";
  static constexpr std::string_view help = "von Mises plasticity with linear hardening";
  static constexpr bool native = true;
  static constexpr auto parameters = std::to_array<Parameter<VonMises>>({
      {"youngs_modulus", "Pa", "Young's modulus", &VonMises::youngs_modulus, Bound::positive},
      {"poisson_ratio", "-", "Poisson's ratio", &VonMises::poisson_ratio, Bound::poisson},
      {"yield_stress", "Pa", "initial yield stress in uniaxial tension", &VonMises::yield_stress,
       Bound::positive},
      {"hardening_modulus", "Pa", "increase of the yield stress per plastic strain",
       &VonMises::hardening_modulus, Bound::not_negative, Default{0}},
  });
  static constexpr auto state =
      std::to_array<StateVariable>({{"pdstrain", "-", "equivalent plastic strain"}});

  std::string problem() const { return ""; }
  double bulk_modulus() const { return youngs_modulus / (3.0 * (1.0 - 2.0 * poisson_ratio)); }
  double shear_modulus() const { return youngs_modulus / (2.0 * (1.0 + poisson_ratio)); }
  double wave_modulus() const { return bulk_modulus() + 4.0 / 3.0 * shear_modulus(); }
  double viscosity() const { return 0; }

  /// Radial return (Wilkins 1964): with q = sqrt(3 J2) of the trial stress, d(ep) = (q - sy) / (3 G
  /// + H) and s *= 1 - 3 G d(ep) / q. Exact for one increment, so nothing can fail.
  template <int Dim, class Real>
  LAHAR_INLINE void update(const LawInput<Dim, Real>& in, Real* stress, Real* pdstrain) const {
    const double K = bulk_modulus(), G = shear_modulus();
    elastic_trial<Dim>(in, K, G, stress);
    StressPoint<LawInput<Dim, Real>::rows, Real> at;
    deviator_of(stress, at);
    const Real q = root3_2 * at.rho;
    const Real beyond = max(q - (yield_stress + hardening_modulus * *pdstrain), Real(0.0));
    const Real plastic = beyond / (3.0 * G + hardening_modulus);
    const Real keep = 1.0 - (3.0 * G) * plastic / max(q, Real(yield_stress));
    *pdstrain += plastic;
    LAHAR_UNROLL
    for (int k = 0; k < in.rows; ++k) stress[k] = keep * at.s[k] + (k < 3 ? at.p : Real(0.0));
  }
};

}  // namespace lahar
