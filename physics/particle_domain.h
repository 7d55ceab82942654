/// \file The domain of a particle (GIMP) when the particle is made.
#pragma once

#include <array>
#include <cmath>

#include "physics/particles.h"

namespace lahar {

/// The domain of a particle is a box of its volume with the proportions of its cell: those of
/// particles that fill cells regularly touch each other. `box` as in Patch::box.
template <int Dim>
void set_domain(Particles<Dim>& particles, Local p, const std::array<double, 2 * Dim>& box) {
  double cell_volume = 1.0;
  for (std::size_t d = 0; d < Dim; ++d) cell_volume *= 2.0 / box[Dim + d];
  const double share = std::pow(particles.row(Column::volume)[p] / cell_volume, 1.0 / Dim);
  const bool stretches = particles.layout().has(Column::next_domain);
  for (int d = 0; d < Dim; ++d) {
    const double edge = share * 2.0 / box[static_cast<std::size_t>(Dim + d)];
    particles.row(Column::domain, d)[p] = edge;
    if (stretches) particles.row(Column::next_domain, d)[p] = edge;
  }
}

}  // namespace lahar
