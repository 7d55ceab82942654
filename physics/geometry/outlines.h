/// \file Areas in plan: polygons with holes.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "physics/base/types.h"

namespace lahar {

/// Polygons in the plane of x and y. A point belongs to them if any of them holds it. Edges are
/// found by bands of y, so that a question costs little whatever the number of corners.
class Outlines {
 public:
  /// A closed line by its corners, in any orientation; the last is joined with the first.
  using Ring = std::vector<Vec<2>>;
  /// Its outer ring and its holes: a point is inside where an odd number of rings goes around it.
  using Polygon = std::vector<Ring>;

  explicit Outlines(const std::vector<Polygon>& polygons);

  /// Points within `tolerance` [m] of an edge are inside.
  bool contains(const Vec<2>& x, double tolerance) const;
  /// Whether an edge comes into a box; false only if none does.
  bool crosses(const Vec<2>& low, const Vec<2>& high) const;
  /// From the nearest point of an edge to a point [m].
  Vec<2> from_edge(const Vec<2>& x) const;
  /// Lowest and highest corner of the box around all.
  const std::pair<Vec<2>, Vec<2>>& bounds() const { return bounds_; }
  std::size_t edges() const { return edge_.size(); }

 private:
  struct Edge {
    Vec<2> from, to;
    std::uint32_t polygon;
  };
  std::size_t band_of(double y) const;
  bool fill_bands(std::size_t bands, std::size_t most);

  std::vector<Edge> edge_;              ///< of one polygon after the other
  std::vector<std::size_t> first_;      ///< of each band in `in_band_`, and the end
  std::vector<std::uint32_t> in_band_;  ///< positions in `edge_`, ascending in each band
  double per_band_ = 1, margin_ = 0;    ///< [m] height of a band; by which edges reach beyond
  std::pair<Vec<2>, Vec<2>> bounds_;
};

}  // namespace lahar
