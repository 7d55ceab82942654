/// \file Triangulated surfaces: their edges, and what is wrong with them.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <vector>

#include "physics/base/types.h"

namespace lahar {

/// Triangles with common corners. Corners are counter-clockwise seen from outside.
struct Triangles {
  using Corners = std::array<Local, 3>;
  std::vector<Vec<3>> points;    ///< [m]
  std::vector<Corners> corners;  ///< points of each triangle

  const Vec<3>& point(Index triangle, int corner) const {
    return points[static_cast<std::size_t>(
        corners[static_cast<std::size_t>(triangle)][static_cast<std::size_t>(corner)])];
  }
  /// Normal of a triangle, whose length is twice its area [m^2].
  Vec<3> area_vector(Index triangle) const {
    const Vec<3>&a = point(triangle, 0), b = point(triangle, 1), c = point(triangle, 2);
    return Vec<3>(b - a).cross(Vec<3>(c - a));
  }
  /// Mean of the corners [m].
  Vec<3> centre(Index triangle) const {
    return (point(triangle, 0) + point(triangle, 1) + point(triangle, 2)) / 3.0;
  }
};

/// Some flaws of one kind: how many, and the first.
struct TriangleFlaw {
  Index count = 0;
  Index triangle = -1;         ///< the first that has it
  Vec<3> at = Vec<3>::Zero();  ///< [m] where
  void add(Index which, const Vec<3>& where) {
    if (count++ == 0) triangle = which, at = where;
  }
};

/// A line of edges that belong to one triangle only.
struct TriangleHole {
  Index edges = 0;
  double length = 0;               ///< [m] of them
  Vec<3> centre = Vec<3>::Zero();  ///< [m] mean of their middles
};

/// Across which edges triangles meet.
struct TriangleEdges {
  static constexpr Local none = -1, several = -2;
  /// The triangle behind the edge from corner k to k + 1, or `none` or `several`.
  std::vector<std::array<Local, 3>> neighbour;
  TriangleFlaw open;      ///< edges that one triangle has
  TriangleFlaw branched;  ///< edges that more than two have
  TriangleFlaw turned;    ///< edges that two have in the same direction
};

/// Takes time and memory for the triangles (some 8 bytes for each edge).
TriangleEdges edges_of(const Triangles& triangles);

/// Removes triangles that have a corner twice: they cover nothing, and edges stay complete.
TriangleFlaw remove_collapsed(Triangles& triangles);

/// Triangles whose corners lie on a line, to rounding.
TriangleFlaw find_flat(const Triangles& triangles);

/// The holes, the longest first; at most `most` of them.
std::vector<TriangleHole> find_holes(const Triangles& triangles, const TriangleEdges& edges,
                                     std::size_t most);

/// What is enclosed [m^3]; negative where corners are clockwise seen from outside.
double enclosed_volume(const Triangles& triangles);

/// Turns all triangles over.
void turn_over(Triangles& triangles);

}  // namespace lahar
