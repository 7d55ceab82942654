/// \file The domain of a particle (GIMP, CPDI, CPDI2) when the particle is made.
#pragma once

#include <array>
#include <cmath>

#include "physics/particles/particles.h"

namespace lahar {

/// True if particles have a domain.
template <int Dim>
bool has_domain(const ColumnLayout<Dim>& layout) {
  return layout.has(Column::domain) || layout.has(Column::vectors) || layout.has(Column::corners);
}

/// The domain of a particle is a box of its volume with the proportions of its cell: those of
/// particles that fill cells regularly touch each other. `box` as in Patch::box, `depth` of
/// depth_at(). CB-Geo MPM takes the cell over the number of particles in it instead, along every
/// axis: `cbgeo_number`, if that is not 0.
template <int Dim>
void set_domain(Particles<Dim>& particles, Local p, const std::array<double, 2 * Dim>& box,
                double depth, Index cbgeo_number = 0) {
  double cell_volume = 1.0;
  for (std::size_t d = 0; d < Dim; ++d) cell_volume *= 2.0 / box[Dim + d];
  const double share =
      cbgeo_number > 0
          ? 1.0 / static_cast<double>(cbgeo_number)
          : std::pow(particles.row(Column::volume)[p] / depth / cell_volume, 1.0 / Dim);
  const auto put = [&](Column column, int component, double value) {
    if (particles.layout().has(column)) particles.row(column, component)[p] = value;
  };
  for (int d = 0; d < Dim; ++d) {
    const double edge = share * 2.0 / box[static_cast<std::size_t>(Dim + d)];
    put(Column::domain, d, edge);
    put(Column::next_domain, d, edge);
    put(Column::vectors, Dim * d + d, 0.5 * edge);
    put(Column::next_vectors, Dim * d + d, 0.5 * edge);
    for (int c = 0; c < corners<Dim>; ++c) {
      const double side = c >> d & 1 ? 0.5 * edge : -0.5 * edge;
      put(Column::corners, Dim * c + d, side);
      put(Column::next_corners, Dim * c + d, side);
    }
  }
}

}  // namespace lahar
