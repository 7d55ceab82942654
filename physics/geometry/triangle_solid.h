/// \file Closed triangulated surfaces as solids.
#pragma once

#include <limits>

#include "physics/geometry/solid.h"
#include "physics/geometry/triangle_tree.h"

namespace lahar {

/// What a closed surface encloses: every edge has two triangles, in opposite directions, and no
/// triangle is flat (find_flat()). Takes some 50 bytes per triangle, and 100 more while it is made.
/// Distances up to `band` [m] are exact; beyond it the side is right, and the distance at most the
/// exact one. The normal is that of the face, or the direction from the nearest point where that
/// is on an edge or corner.
SolidPtr<3> solid_of_triangles(TriangleTree tree,
                               double band = std::numeric_limits<double>::infinity());
SolidPtr<3> solid_of_triangles(Triangles triangles,
                               double band = std::numeric_limits<double>::infinity());

}  // namespace lahar
