/// \file What a region is made of: a test of points, a box around it, and how it meets boxes.
#pragma once

#include <functional>
#include <limits>
#include <memory>
#include <utility>

#include "io/scenario/regions.h"

namespace lahar {

template <int Dim>
struct RegionShape {
  using Point = Vec<Dim>;
  using Box = std::pair<Point, Point>;

  std::function<bool(const Point&)> contains;
  Box bounds = everywhere();
  /// How much of the box from `low` to `high` lies in the shape.
  std::function<Coverage(const Point& low, const Point& high)> coverage = unknown;
  /// The test for points of a box, without what the whole box says; empty: `contains`.
  std::function<std::function<bool(const Point&)>(const Point& low, const Point& high)> within = {};
  bool exact = false;             ///< it is, or has, a polygon or a shape of `geometry`
  SolidPtr<Dim> solid = nullptr;  ///< what fills it; null where it has no surface

  static Box everywhere() {
    constexpr double inf = std::numeric_limits<double>::infinity();
    return {Point::Constant(-inf), Point::Constant(inf)};
  }
  std::function<bool(const Point&)> contains_within(const Point& low, const Point& high) const {
    return within ? within(low, high) : contains;
  }
  static Coverage unknown(const Point&, const Point&) { return Coverage::part; }
};

/// How a ball around a box meets a shape whose surface is `distance` [m] away from its centre,
/// below zero inside; the shape's edges are rounded off by `tolerance`.
template <int Dim>
Coverage coverage_of(double distance, const Vec<Dim>& low, const Vec<Dim>& high, double tolerance) {
  const double radius = 0.5 * (high - low).norm() + tolerance;
  return distance > radius ? Coverage::none : distance < -radius ? Coverage::all : Coverage::part;
}

// Shapes of `geometry`; `tolerance` [m] as in Region.

/// Points below (`side` 1) or above (-1) a surface.
template <int Dim>
RegionShape<Dim> side_of_surface(std::shared_ptr<const Surface<Dim>> surface, int side,
                                 double tolerance);
template <int Dim>
RegionShape<Dim> inside_solid(SolidPtr<Dim> solid, double tolerance);
/// Points whose place in plan is in the outlines.
RegionShape<3> under_outlines(std::shared_ptr<const Outlines> outlines, double tolerance);

/// Points in any or all of some shapes, or in the first and none of the others.
template <int Dim>
RegionShape<Dim> union_of(std::vector<RegionShape<Dim>> parts);
template <int Dim>
RegionShape<Dim> intersection_of(std::vector<RegionShape<Dim>> parts);
template <int Dim>
RegionShape<Dim> difference_of(std::vector<RegionShape<Dim>> parts);

}  // namespace lahar
