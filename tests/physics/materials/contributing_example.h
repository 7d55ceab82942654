/// \file Elasticity whose shear stress relaxes, as in ice and salt.
#pragma once

#include "physics/materials/stress_invariants.h"
#include "physics/materials/table.h"

namespace lahar {

/// Maxwell body: elastic in volume, a spring and a dashpot in series in shear.
struct Maxwell {
  double youngs_modulus, poisson_ratio, relaxation_time;

  static constexpr std::string_view name = "Maxwell";  // "type" in the scenario
  static constexpr std::string_view help = "viscoelastic body that relaxes in shear";
  static constexpr bool native = true;  // CB-Geo MPM does not have it
  static constexpr auto parameters = std::to_array<Parameter<Maxwell>>({
      {"youngs_modulus", "Pa", "Young's modulus", &Maxwell::youngs_modulus, Bound::positive},
      {"poisson_ratio", "-", "Poisson's ratio", &Maxwell::poisson_ratio, Bound::poisson},
      {"relaxation_time", "s", "time in which shear falls to 37 %", &Maxwell::relaxation_time,
       Bound::positive},
  });
  static constexpr auto state =
      std::to_array<StateVariable>({{"vdstrain", "-", "viscous deviatoric strain"}});

  std::string problem() const { return ""; }
  double bulk() const { return youngs_modulus / (3.0 * (1.0 - 2.0 * poisson_ratio)); }
  double shear() const { return youngs_modulus / (2.0 * (1.0 + poisson_ratio)); }
  double wave_modulus() const { return bulk() + 4.0 / 3.0 * shear(); }
  double viscosity() const { return 0; }

  /// ds/dt = 2 G de/dt - s / T, implicit in time.
  template <int Dim, class Real>
  LAHAR_INLINE void update(const LawInput<Dim, Real>& in, Real* stress, Real* vdstrain) const {
    elastic_trial<Dim>(in, bulk(), shear(), stress);
    StressPoint<LawInput<Dim, Real>::rows, Real> at;
    deviator_of(stress, at);
    const double keep = 1.0 / (1.0 + in.dt / relaxation_time);
    *vdstrain += (root2_3 * (1.0 - keep) / (2.0 * shear())) * at.rho;
    for (int k = 0; k < in.rows; ++k) stress[k] = keep * at.s[k] + (k < 3 ? at.p : Real(0.0));
  }
};

}  // namespace lahar
