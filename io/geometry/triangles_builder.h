/// \file Triangles while they are read: points at the same place become one.
#pragma once

#include <string>
#include <vector>

#include "io/geometry/triangles_file.h"

namespace lahar {

class TrianglesBuilder {
 public:
  explicit TrianglesBuilder(const TrianglesPlace& place);

  /// The number of a point [of the file's units], which is the same for the same place.
  Local point(const Vec<3>& x);
  void triangle(const Triangles::Corners& corners) {
    if (size() == most_triangles) throw InputError("a surface has too many triangles");
    triangles_.corners.push_back(corners);
  }
  /// A polygon of at least three of these points; false if it has a reflex corner.
  bool polygon(const std::vector<Local>& corners);
  Index size() const { return static_cast<Index>(triangles_.corners.size()); }
  Triangles take() { return std::move(triangles_); }

 private:
  std::size_t slot_of(const Vec<3>& x) const;
  void grow();

  TrianglesPlace place_;
  Triangles triangles_;
  std::vector<Local> slots_;  ///< a hash table of points; -1 = free
};

// The formats. False if anything is wrong (reported).
bool read_stl(const SideFile& file, TrianglesBuilder& to, ProblemList& problems);
bool read_obj(const SideFile& file, TrianglesBuilder& to, ProblemList& problems);
bool read_ply(const SideFile& file, TrianglesBuilder& to, ProblemList& problems);

}  // namespace lahar
