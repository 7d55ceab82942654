/// \file Rigid shapes: how far a point is from their surface, and where to.
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "physics/base/types.h"
#include "physics/geometry/outlines.h"
#include "physics/geometry/surface.h"

namespace lahar {

/// A shape that may be a wall or a body. Queries have no state: any thread may ask.
template <int Dim>
class Solid {
 public:
  struct Nearest {
    double distance;  ///< [m] to the surface; negative inside
    Vec<Dim> normal;  ///< unit normal that points out of the solid, of the nearest point
  };
  virtual ~Solid() = default;
  /// Right near the surface; far away at least the side is right, and the distance not too large.
  virtual Nearest nearest(const Vec<Dim>& x) const = 0;
  /// Whether x is certainly outside by `distance` [m] or more; asks less than nearest().
  virtual bool is_beyond(const Vec<Dim>& x, double distance) const {
    return nearest(x).distance >= distance;
  }
  /// Whether x is inside or on the surface.
  virtual bool contains(const Vec<Dim>& x) const { return nearest(x).distance <= 0; }
  /// Box around it; infinite where it has no end.
  virtual std::pair<Vec<Dim>, Vec<Dim>> bounds() const = 0;
};

template <int Dim>
using SolidPtr = std::shared_ptr<const Solid<Dim>>;

/// (x - point) . normal <= 0; `normal` has length 1.
template <int Dim>
SolidPtr<Dim> half_space(const Vec<Dim>& point, const Vec<Dim>& normal);
/// Ball, in two dimensions a disc.
template <int Dim>
SolidPtr<Dim> ball(const Vec<Dim>& centre, double radius);
/// Axis-aligned box.
template <int Dim>
SolidPtr<Dim> box(const Vec<Dim>& low, const Vec<Dim>& high);
/// Around the line from `from` to `to`, with radii at both ends (a cylinder, cone or frustum) and
/// flat ends; in two dimensions a trapezium.
template <int Dim>
SolidPtr<Dim> frustum(const Vec<Dim>& from, const Vec<Dim>& to, double radius_from,
                      double radius_to);
/// All that is below a surface. Distances are those to the tangent plane at the foot of the
/// perpendicular on the tangent plane below or above.
template <int Dim>
SolidPtr<Dim> below(std::shared_ptr<const Surface<Dim>> surface);
/// A polygon without crossings, in any orientation.
SolidPtr<2> polygon(std::vector<Vec<2>> corners);
/// The polygon extruded along an axis, from `low` to `high`, either of which may be infinite. Its
/// corners have the other coordinates in cyclic order: y-z, z-x, x-y.
SolidPtr<3> prism(std::vector<Vec<2>> corners, int axis, double low, double high);

/// All that is above or below outlines in plan: a prism without ends.
SolidPtr<3> under(std::shared_ptr<const Outlines> outlines);

/// What is in any of the solids; in all of them; in the first and in none of the others. Distances
/// near edges where two meet are those to the nearer surface, extended.
template <int Dim>
SolidPtr<Dim> united(std::vector<SolidPtr<Dim>> parts);
template <int Dim>
SolidPtr<Dim> common(std::vector<SolidPtr<Dim>> parts);
template <int Dim>
SolidPtr<Dim> difference(std::vector<SolidPtr<Dim>> parts);
/// Everywhere else.
template <int Dim>
SolidPtr<Dim> outside(SolidPtr<Dim> solid);

}  // namespace lahar
