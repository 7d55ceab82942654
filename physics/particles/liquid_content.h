/// \file How much of a liquid there is in pores, as it is compressed.
#pragma once

#include <cmath>
#include <optional>

#include "physics/materials/pore_liquid.h"
#include "physics/particles/particles.h"

namespace lahar {

/// n V rho exp(p / K) [kg], at a pore pressure p [Pa]: the mass that stays where no liquid comes or
/// goes, as the pressure changes by dp = -K / n div u dt. It is what is reported. Weight and
/// inertia take the density without pressure (Pores::liquid_mass()): moduli of liquids are often
/// lowered for longer steps, and weights must not follow. 0 without a liquid.
inline double compressed_mass_of(const std::optional<PoreLiquid>& liquid, double m, double V,
                                 double p) {
  const double mass = liquid_mass_of(liquid, m, V);
  if (!liquid || liquid->constant_mass) return mass;
  return mass * std::exp(p / liquid->bulk_modulus);
}

/// The same of a particle.
template <int Dim>
double compressed_mass_of(const std::optional<PoreLiquid>& liquid, const Particles<Dim>& particles,
                          Local p) {
  if (!liquid) return 0.0;
  return compressed_mass_of(liquid, particles.row(Column::mass)[p],
                            particles.row(Column::volume)[p],
                            particles.row(Column::pore_pressure)[p]);
}

}  // namespace lahar
