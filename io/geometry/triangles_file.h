/// \file Triangulated surfaces from STL, OBJ and PLY files.
#pragma once

#include <optional>
#include <string>

#include "io/base/side_files.h"
#include "physics/geometry/triangles.h"

namespace lahar {

/// From the coordinates of a file to those of the model [m]: scale times x + offset.
struct TrianglesPlace {
  double scale = 1;
  Vec<3> offset = Vec<3>::Zero();
};

/// The most triangles that are read: their edges have numbers of 32 bits.
inline constexpr Index most_triangles = 700'000'000;

/// The triangles of a file, whose name ends on .stl, .obj or .ply; nothing if anything is wrong
/// with it. Points at the same place are one. Polygons become triangles if they are convex. Memory
/// is taken for what is returned, and for a piece of the file.
std::optional<Triangles> read_triangles(const SideFile& file, const TrianglesPlace& place,
                                        ProblemList& problems);

/// The ending of a name in lower case, such as "stl".
std::string ending_of(const std::string& name);

}  // namespace lahar
