/// \file A grid of boxes around a closed surface that knows on which side of it they are.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "physics/geometry/triangles.h"

namespace lahar {

enum class Side : std::uint8_t { unknown, outside, inside, on_surface };

/// Boxes that the surface does not cross are wholly inside or outside.
class SideGrid {
 public:
  /// `is_inside` is asked once for each region of boxes that hang together.
  SideGrid(const Triangles& triangles, const Vec<3>& low, const Vec<3>& high,
           const std::function<bool(const Vec<3>&)>& is_inside);

  /// Side::on_surface: the box of x is crossed.
  Side at(const Vec<3>& x) const;

 private:
  void mark_crossed(const Triangles& triangles);
  void flood(Index from, Side side);
  Vec<3> centre_of(Index box) const;
  std::array<Index, 3> place_of(Index box) const;

  Vec<3> low_, high_;
  double edge_;                  ///< [m] of a box
  std::array<Index, 3> counts_;  ///< of boxes along each axis
  std::vector<Side> sides_;
};

}  // namespace lahar
