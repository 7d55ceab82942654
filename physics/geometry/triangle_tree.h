/// \file A tree of boxes around triangles, which finds the nearest one.
#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "physics/geometry/triangles.h"

namespace lahar {

/// Pairs of triangles of which an edge of one passes through the inside of the other.
struct TriangleCrossings {
  static constexpr Index most = 1'000'000;  ///< the search ends with so many
  Index count = 0;
  Local first = -1, second = -1;  ///< triangles of the first pair, in the order of the tree
  Vec<3> at = Vec<3>::Zero();     ///< [m] where they cross
};

/// Queries have no state: any thread may ask.
class TriangleTree {
 public:
  /// Keeps the triangles, and their points, in an order of its own.
  explicit TriangleTree(Triangles triangles);

  /// On which part of a triangle a point lies: within, on the edge from corner `corner` to the
  /// next, or at that corner.
  enum class Part : std::uint8_t { face, edge, corner };
  struct Hit {
    Local triangle = -1;  ///< -1: none
    Part part = Part::face;
    std::uint8_t corner = 0;
    double square = std::numeric_limits<double>::infinity();  ///< [m^2] of the distance
    Vec<3> point;                                             ///< [m] the nearest
  };
  /// The point of all triangles that is nearest to x, if it is nearer than the root of `square`.
  Hit nearest(const Vec<3>& x, double square) const;

  /// Triangles that touch do not cross, nor do those that rounding cannot tell from these.
  TriangleCrossings crossings() const;

  const Triangles& triangles() const { return triangles_; }
  const Vec<3>& low() const { return low_; }    ///< [m] lowest corner of the box around all
  const Vec<3>& high() const { return high_; }  ///< [m] highest

 private:
  static constexpr int ways = 4;       ///< children of a node
  static constexpr Index in_leaf = 4;  ///< triangles of a leaf, at most
  /// Boxes of its children [m from the centre of all], and what is in them: from triangle
  /// `first` on so many triangles, or, with none, the node `first`.
  struct alignas(64) Node {
    float low[3][ways], high[3][ways];
    Local first[ways];
    std::uint8_t count[ways];
  };
  struct Item;
  class Builder;
  struct Waiting;
  class CrossingSearch;
  void look_at(const Vec<3>& x, Local first, int count, Hit& best) const;

  Triangles triangles_;
  Vec<3> low_, high_, centre_;
  std::vector<Node> nodes_;
};

}  // namespace lahar
