/// \file Weakly compressible Newtonian fluid.
#pragma once

#include <cmath>
#include <limits>
#include <string>

#include "physics/materials/law_input.h"
#include "physics/materials/table.h"

namespace lahar {

/// Weakly compressible Newtonian fluid.
struct Newtonian {
  double bulk_modulus;          ///< [Pa]
  double dynamic_viscosity;     ///< [Pa s]
  bool incompressible = false;  ///< true: no volumetric (pressure) stress, as in the reference
  bool as_cbgeo = false;        ///< an initial stress is no pressure
  /// [Pa] the largest tension; the reference code has no limit
  double tension_limit = std::numeric_limits<double>::infinity();

  static constexpr std::string_view name = "Newtonian";
  static constexpr std::string_view help = "weakly compressible viscous fluid";
  static constexpr auto parameters = std::to_array<Parameter<Newtonian>>({
      {"bulk_modulus", "Pa", "bulk modulus of the fluid", &Newtonian::bulk_modulus,
       Bound::positive},
      {"dynamic_viscosity", "Pa s", "viscosity", &Newtonian::dynamic_viscosity,
       Bound::not_negative},
      {"incompressible", "true: the law adds no pressure", &Newtonian::incompressible},
      {"tension_limit", "Pa",
       "largest tension, beyond which the fluid parts into drops; without it 0, for CB-Geo input "
       "no "
       "limit",
       &Newtonian::tension_limit, Bound::not_negative, no_default},
  });
  static constexpr auto state = std::to_array<StateVariable>({{"pressure", "Pa", "pressure"}});

  std::string problem() const { return ""; }
  bool has_tension_limit() const { return !incompressible && std::isfinite(tension_limit); }
  /// The lanes whose pressure is at the limit of tension.
  template <int Rows, class Real>
  LAHAR_INLINE unsigned at_tension_limit(const Real*, const Real* pressure, const Real&) const {
    return ~greater(*pressure, Real(-tension_limit)) & LawInput<2, Real>::all_of;
  }
  /// The mean of the initial stress is the pressure at the start; the reference code begins with
  /// none.
  void initial_state(const double* stress, double* pressure) const {
    *pressure =
        as_cbgeo || incompressible ? 0.0 : -(1.0 / 3.0) * (stress[0] + stress[1] + stress[2]);
  }
  double wave_modulus() const { return incompressible ? 0.0 : bulk_modulus; }
  double viscosity() const { return dynamic_viscosity; }

  /// p -= K d(eps_v) with the volumetric increment at the cell's centre; sigma = -p I + 2 mu (rate
  /// - tr(rate)/3 I) (CB-Geo MPM, theory/material). 2D: sigma_zz carries no deviatoric term beyond
  /// -2/3 mu tr(rate), which is what it is at rate_zz = 0.
  template <int Dim, class Real>
  LAHAR_INLINE void update(const LawInput<Dim, Real>& in, Real* stress, Real* pressure) const {
    const double compressible = incompressible ? 0.0 : 1.0;
    const double mu = dynamic_viscosity;
    *pressure -= compressible * bulk_modulus * in.volumetric;
    *pressure = select(greater(Real(-tension_limit), *pressure), Real(-tension_limit), *pressure);
    const Real volumetric = compressible * (-*pressure - (2.0 / 3.0) * mu * volumetric_rate(in));
    LAHAR_UNROLL
    for (int k = 0; k < 3; ++k) {
      if (Dim == 2 && k == 2)
        stress[k] = volumetric;
      else
        stress[k] = volumetric + (2.0 * mu) * in.rate[k];
    }
    LAHAR_UNROLL
    for (int k = 3; k < in.rows; ++k) stress[k] = mu * in.rate[k];
  }
};

}  // namespace lahar
