/// \file The same surface with fewer triangles, for pictures that move.
#pragma once

#include "physics/geometry/triangles.h"

namespace lahar {

/// At most `most` triangles where that is possible: edges are collapsed, first those with which
/// the surface changes least (Garland & Heckbert 1997, SIGGRAPH '97, 209-216). What is closed
/// remains so, no triangle is turned over, and borders stay where they are, but for details.
Triangles coarser(Triangles surface, std::size_t most);

}  // namespace lahar
