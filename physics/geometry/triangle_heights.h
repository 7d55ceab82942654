/// \file Open triangulated surfaces as heights above a plan.
#pragma once

#include "physics/geometry/surface.h"
#include "physics/geometry/triangles.h"

namespace lahar {

struct TriangleHeights {
  Surface<3> surface;          ///< meaningful where there is no flaw
  TriangleFlaw steep;          ///< triangles that are vertical
  TriangleFlaw folded;         ///< edges where the surface turns back below or above itself
  TriangleFlaw double_points;  ///< points of the grid above which triangles have other heights
};

/// A spacing [m] that resolves the triangles as they are in the mean, and 1/500 of the whole.
double spacing_for(const Triangles& triangles);

/// Points along both axes of a grid with at most this spacing [m] from border to border.
std::array<Index, 2> grid_counts(const Triangles& triangles, double spacing);

/// Heights at the points of that grid; NaN where no triangle lies.
TriangleHeights triangle_heights(const Triangles& triangles, double spacing);

}  // namespace lahar
