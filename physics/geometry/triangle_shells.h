/// \file Closed surfaces of which triangles consist, and which of them lie within others.
#pragma once

#include <vector>

#include "physics/geometry/triangles.h"

namespace lahar {

/// Shells: triangles that hang together across edges.
struct TriangleShells {
  std::vector<Local> of;  ///< the shell of each triangle, in the order of their first ones
  Local count = 0;
};

TriangleShells shells_of(const TriangleEdges& edges);

/// What each shell encloses [m^3]; negative where it shows its inside.
std::vector<double> shell_volumes(const Triangles& triangles, const TriangleShells& shells);

/// How many other shells each one lies within; shells must be closed and not cross. By a line
/// along z through the widest triangle of a shell: the time is that of sorting triangles, and of
/// what these lines meet. Empty where they meet too many to be kept, which shells do that lie
/// within each other or cross by thousands.
std::vector<int> nesting_depths(const Triangles& triangles, const TriangleShells& shells);

/// Turns over the triangles of shells that are marked.
void turn_over(Triangles& triangles, const TriangleShells& shells, const std::vector<bool>& which);

}  // namespace lahar
