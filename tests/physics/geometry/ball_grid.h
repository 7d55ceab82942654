/// \file A grid from which a ball's surface is made.
#pragma once

#include "physics/geometry/level_surface.h"

namespace lahar::test {

/// Depths below the surface of a ball, on a grid around it.
template <int Dim>
GridValues<Dim> ball(double radius, double spacing) {
  GridValues<Dim> grid{.low = Vec<Dim>::Constant(-radius - 2 * spacing),
                       .spacing = Vec<Dim>::Constant(spacing),
                       .n = {},
                       .values = {}};
  grid.n.fill(static_cast<Index>(2 * (radius / spacing + 2)) + 2);
  for (Index point = 0; point < grid.size(); ++point)
    grid.values.push_back(static_cast<float>(radius - grid.place(point).norm()));
  return grid;
}

}  // namespace lahar::test
