/// \file A surface that has one height above each place in plan: the ground, a horizon, a slip
/// surface.
#pragma once

#include <array>
#include <utility>
#include <vector>

#include "physics/base/types.h"

namespace lahar {

/// Heights along the last axis (y in two dimensions, z in three) over a grid of the others, linear
/// or bilinear between its points. Where a height is not known, and outside of the grid, there is
/// no surface.
template <int Dim>
class Surface {
 public:
  static constexpr int plan = Dim - 1;
  /// Ascending coordinates [m] of the grid along the axes in plan; at least two each.
  using Axes = std::array<std::vector<double>, static_cast<std::size_t>(plan)>;

  Surface() = default;
  /// `heights` [m], NaN where not known; the first axis runs fastest.
  Surface(Axes axes, std::vector<float> heights);

  struct Point {
    double height;   ///< [m]; NaN: there is no surface
    Vec<Dim> slope;  ///< [-] of the height along the axes in plan; the last component is zero
  };
  /// Above or below a point x; its last component does not matter.
  Point at(const Vec<Dim>& x) const;
  double height(const Vec<Dim>& x) const { return at(x).height; }

  struct Range {
    double low, high;  ///< [m] of the heights that are known; low > high: none is
    bool complete;     ///< the surface is known everywhere
  };
  /// Heights over a box in plan.
  Range range(const Vec<Dim>& low, const Vec<Dim>& high) const;

  /// Lowest and highest corner of the box around the surface.
  const std::pair<Vec<Dim>, Vec<Dim>>& bounds() const { return bounds_; }
  const Axes& axes() const { return axes_; }
  const std::vector<float>& heights() const { return heights_; }

 private:
  Axes axes_;
  std::array<double, static_cast<std::size_t>(plan)> per_length_{};  ///< [1/m] steps, in the mean
  std::vector<float> heights_;
  std::pair<Vec<Dim>, Vec<Dim>> bounds_;
};

extern template class Surface<2>;
extern template class Surface<3>;

}  // namespace lahar
