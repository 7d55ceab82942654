/// \file Isotropic linear elasticity.
#pragma once

#include <string>

#include "physics/materials/law_input.h"
#include "physics/materials/table.h"

namespace lahar {

/// Isotropic linear elasticity in rate form; 2D is plane strain.
struct LinearElastic {
  double youngs_modulus;  ///< [Pa]
  double poisson_ratio;   ///< [-]

  static constexpr std::string_view name = "LinearElastic";
  static constexpr std::string_view help = "isotropic linear elasticity; 2D is plane strain";
  static constexpr auto parameters = std::to_array<Parameter<LinearElastic>>({
      {"youngs_modulus", "Pa", "Young's modulus", &LinearElastic::youngs_modulus, Bound::positive},
      {"poisson_ratio", "-", "Poisson's ratio", &LinearElastic::poisson_ratio, Bound::poisson},
  });
  static constexpr NoState state{};

  std::string problem() const { return ""; }
  double wave_modulus() const {
    return youngs_modulus * (1.0 - poisson_ratio) /
           ((1.0 + poisson_ratio) * (1.0 - 2.0 * poisson_ratio));
  }
  double viscosity() const { return 0; }

  /// Hooke's law in rate form, sigma += lambda tr(de) I + 2 G de (engineering shear: G). In plane
  /// strain sigma_zz follows.
  template <int Dim, class Real>
  LAHAR_INLINE void update(const LawInput<Dim, Real>& in, Real* stress, Real*) const {
    const double G = youngs_modulus / (2.0 * (1.0 + poisson_ratio));
    const double lambda =
        youngs_modulus * poisson_ratio / ((1.0 + poisson_ratio) * (1.0 - 2.0 * poisson_ratio));
    const Real volumetric = (lambda * in.dt) * volumetric_rate(in);
    LAHAR_UNROLL
    for (int k = 0; k < 3; ++k) {
      if (Dim == 2 && k == 2)
        stress[k] += volumetric;
      else
        stress[k] += volumetric + (2.0 * G * in.dt) * in.rate[k];
    }
    LAHAR_UNROLL
    for (int k = 3; k < in.rows; ++k) stress[k] += (G * in.dt) * in.rate[k];
  }
};

}  // namespace lahar
