/// \file Bingham fluid.
#pragma once

#include <cmath>
#include <limits>
#include <string>

#include "physics/materials/law_input.h"
#include "physics/materials/table.h"

namespace lahar {

/// Weakly compressible Bingham fluid: very viscous at shear rates up to a critical one, a yield
/// stress and a plastic viscosity beyond (the biviscous model of Beverly & Tanner 1992, J.
/// Non-Newton. Fluid Mech. 42, 85-115).
struct Bingham {
  double youngs_modulus, poisson_ratio;  ///< their bulk modulus compresses it
  double tau0, mu, critical_shear_rate;
  bool incompressible = false;
  bool as_cbgeo = false;  ///< what the reference code computes, see update()
  /// [Pa] the largest tension; the reference code has no limit
  double tension_limit = std::numeric_limits<double>::infinity();

  static constexpr std::string_view name = "Bingham";
  static constexpr std::string_view help = "viscous fluid with a yield stress";
  static constexpr auto parameters = std::to_array<Parameter<Bingham>>({
      {"youngs_modulus", "Pa", "Young's modulus", &Bingham::youngs_modulus, Bound::positive},
      {"poisson_ratio", "-", "Poisson's ratio", &Bingham::poisson_ratio, Bound::poisson},
      {"tau0", "Pa", "yield stress", &Bingham::tau0, Bound::not_negative},
      {"mu", "Pa s", "plastic viscosity", &Bingham::mu, Bound::not_negative},
      {"critical_shear_rate", "1/s",
       "shear rate at which the yield stress is reached; below, the fluid creeps with a viscosity "
       "of mu + tau0 / critical_shear_rate, which limits explicit steps",
       &Bingham::critical_shear_rate, Bound::positive},
      {"incompressible", "true: the law adds no pressure", &Bingham::incompressible},
      {"tension_limit", "Pa",
       "largest tension, beyond which the fluid parts into drops; without it 0, for CB-Geo input "
       "no "
       "limit",
       &Bingham::tension_limit, Bound::not_negative, no_default},
  });
  static constexpr auto state = std::to_array<StateVariable>({{"pressure", "Pa", "pressure"}});

  std::string problem() const { return ""; }
  bool has_tension_limit() const { return !incompressible && std::isfinite(tension_limit); }
  /// The lanes whose pressure is at the limit of tension.
  template <int Rows, class Real>
  LAHAR_INLINE unsigned at_tension_limit(const Real*, const Real* pressure, const Real&) const {
    return ~greater(*pressure, Real(-tension_limit)) & LawInput<2, Real>::all_of;
  }
  double bulk_modulus() const { return youngs_modulus / (3.0 * (1.0 - 2.0 * poisson_ratio)); }
  /// The mean of the initial stress is the pressure at the start; the reference code begins with
  /// none.
  void initial_state(const double* stress, double* pressure) const {
    *pressure =
        as_cbgeo || incompressible ? 0.0 : -(1.0 / 3.0) * (stress[0] + stress[1] + stress[2]);
  }
  double wave_modulus() const { return incompressible ? 0.0 : bulk_modulus(); }
  /// The largest apparent viscosity.
  double viscosity() const { return mu + tau0 / critical_shear_rate; }

  /// With D the rate of deformation and g = sqrt(2 D:D), or the critical rate where g is less:
  /// p -= K d(eps_v) with the volumetric increment at the cell's centre;
  /// sigma = -p I + 2 (tau0 / g + mu) D.
  ///
  /// The reference code has -p I below the critical rate (CB-Geo MPM, theory/material). It asks in
  /// addition that half the sum of squares of the normal components of the shear stress be at least
  /// tau0^2, where its documentation has all components (for which it is always true), so that
  /// nothing is left of it in simple shear; and in 2D it leaves the pressure out of sigma_zz.
  template <int Dim, class Real>
  LAHAR_INLINE void update(const LawInput<Dim, Real>& in, Real* stress, Real* pressure) const {
    Real normal2 = in.rate[0] * in.rate[0] + in.rate[1] * in.rate[1], shear2(0.0);
    if constexpr (Dim == 3) normal2 += in.rate[2] * in.rate[2];
    LAHAR_UNROLL
    for (int k = 3; k < in.rows; ++k) shear2 += in.rate[k] * in.rate[k];
    const Real g = sqrt(2.0 * normal2 + shear2);
    const Real critical(std::max(critical_shear_rate, 1e-15));
    unsigned flows = greater(g, critical);
    Real twice = 2.0 * (tau0 / select(flows, g, critical) + mu);
    if (as_cbgeo) {
      flows &= ~greater(Real(tau0 * tau0), 0.5 * twice * twice * normal2);
      twice = select(flows, twice, Real(0.0));
    }
    const double compressible = incompressible ? 0.0 : 1.0;
    *pressure -= compressible * bulk_modulus() * in.volumetric;
    *pressure = select(greater(Real(-tension_limit), *pressure), Real(-tension_limit), *pressure);
    const Real volumetric = -compressible * *pressure;
    LAHAR_UNROLL
    for (int k = 0; k < 3; ++k) {
      if (Dim == 2 && k == 2)
        stress[k] = as_cbgeo ? Real(0.0) : volumetric;
      else
        stress[k] = volumetric + twice * in.rate[k];
    }
    LAHAR_UNROLL
    for (int k = 3; k < in.rows; ++k) stress[k] = 0.5 * twice * in.rate[k];
  }
};

}  // namespace lahar
