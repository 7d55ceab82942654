/// \file What is wrong with the triangles of a file, in words.
#pragma once

#include <string>

#include "io/base/problems.h"
#include "physics/geometry/surface.h"
#include "physics/geometry/triangle_tree.h"
#include "physics/geometry/triangles.h"

namespace lahar {

/// Whether triangles enclose a solid: no hole, all with the same side outside. Mends, with a
/// warning, triangles that have a corner twice, and closed surfaces that are turned inside out: one
/// within another is a hollow, one within that a body again.
bool check_solid(const std::string& file, Triangles& triangles, ProblemList& problems);

/// Whether no triangles pass through each other.
bool check_crossings(const std::string& file, const TriangleTree& tree, ProblemList& problems);

/// Whether triangles are a surface with one height above each place; mends as check_solid().
bool check_surface(const std::string& file, Triangles& triangles, ProblemList& problems);

}  // namespace lahar
