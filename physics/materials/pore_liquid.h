/// \file The liquid in the pores of a skeleton, and what follows from the porosity.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "physics/base/simd.h"

namespace lahar {

/// Pores that are full of one liquid. Grains and liquid do not change their density; the skeleton
/// and, by its bulk modulus, the pressure of the liquid follow what moves.
struct PoreLiquid {
  double density = 0;        ///< [kg/m^3] of the liquid
  double bulk_modulus = 0;   ///< [Pa] of the liquid
  double grain_density = 0;  ///< [kg/m^3] of the skeleton's material, without pores
  double porosity = 0;       ///< [-] at the beginning
  /// Pressure gradient per discharge [Pa s/m^2] at the initial porosity, by direction: rho g / k
  /// for a hydraulic conductivity k [m/s], mu / kappa for an intrinsic permeability kappa [m^2].
  std::array<double, 3> resistance{};
  bool constant_mass =
      false;  ///< particles keep the liquid mass of the beginning, as in CB-Geo MPM
};

/// Under which hydraulic conductivities are given [m/s^2]: laboratories measure them on earth,
/// whatever gravity a scenario has.
inline constexpr double conductivity_gravity = 9.81;

/// Bounds of the porosity of a particle. Beyond them it is deformed beyond what has a meaning.
inline constexpr double least_porosity = 1e-5;

/// What follows from the mass of the grains m [kg] and the volume V [m^3] of particles.
class Pores {
 public:
  explicit Pores(const PoreLiquid& liquid)
      : liquid_(liquid),
        initial_permeability_(permeability(liquid.porosity)),
        initial_ratio_(liquid.porosity * liquid.density /
                       ((1.0 - liquid.porosity) * liquid.grain_density)) {}

  /// n = 1 - m / (rho_s V) [-].
  template <class Real>
  LAHAR_INLINE Real porosity(const Real& m, const Real& V) const {
    const Real solid = m / (liquid_.grain_density * V);
    return max(Real(least_porosity), Real(1.0 - max(Real(least_porosity), solid)));
  }
  /// n rho_w V [kg].
  template <class Real>
  LAHAR_INLINE Real liquid_mass(const Real& m, const Real& V) const {
    return liquid_.constant_mass ? Real(initial_ratio_ * m)
                                 : Real(liquid_.density * (porosity(m, V) * V));
  }
  /// n^2 V over the permeability at porosity n as a multiple of that at the beginning [m^3]. The
  /// permeability goes like n^3 / (1 - n)^2 (Kozeny-Carman).
  template <class Real>
  LAHAR_INLINE Real drag_volume(const Real& m, const Real& V) const {
    const Real n = porosity(m, V), solid = Real(1.0) - n;
    return initial_permeability_ * (V * solid * solid / n);
  }
  const PoreLiquid& liquid() const { return liquid_; }

 private:
  static double permeability(double n) { return n * n * n / ((1.0 - n) * (1.0 - n)); }

  PoreLiquid liquid_;
  double initial_permeability_, initial_ratio_;
};

/// Mass of the liquid in the pores of one particle [kg]; 0 without a liquid.
inline double liquid_mass_of(const std::optional<PoreLiquid>& liquid, double m, double V) {
  return liquid ? Pores(*liquid).liquid_mass(Scalar(m), Scalar(V))[0] : 0.0;
}

/// Square of the speed of the fastest wave [m^2/s^2], without drag, which only ties the phases
/// together: of the skeleton's wave modulus M [Pa] and the volume per mass of the grains [m^3/kg].
/// Largest eigenvalue of {{(M + K (1-n)^2/n) / r_s, K (1-n) / r_s}, {K (1-n) / r_l, K n / r_l}},
/// with r_s and r_l the masses of grains and liquid per volume (Zienkiewicz et al. 1980).
template <class Real>
LAHAR_INLINE Real wave_speed_squared(const PoreLiquid& liquid, double M, const Real& per_mass) {
  const double K = liquid.bulk_modulus;
  const Real n =
      max(Real(least_porosity), Real(1.0) - Real(1.0) / (liquid.grain_density * per_mass));
  const Real solid = Real(1.0) - n, per_liquid = Real(1.0) / (liquid.density * n);
  const Real a = (M + K * (solid * solid / n)) * per_mass, d = (K * n) * per_liquid;
  const Real bc = (K * solid) * per_mass * ((K * solid) * per_liquid);
  const Real half = 0.5 * (a - d);
  return 0.5 * (a + d) + sqrt(Real(half * half + bc));
}

}  // namespace lahar
