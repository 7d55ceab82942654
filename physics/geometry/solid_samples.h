/// \file What a grid over the box around a solid says of it: its mass, points on its surface.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "physics/geometry/solid.h"

namespace lahar {

/// Volume of a solid [m^Dim], its centre [m], and its moments about it, of unit density.
template <int Dim>
struct SolidMoments {
  double volume = 0;
  Vec<Dim> centre = Vec<Dim>::Zero();
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();  ///< [m^(Dim + 2)]; in two dimensions zz
};

/// By equal boxes, `cuts` along the longest edge. A box that the surface cuts counts in part, so
/// that the error falls with the square of their size. With `around_axis` those of the body of
/// revolution [m^3] whose section at x > 0 this is.
template <int Dim>
SolidMoments<Dim> moments_of(const Solid<Dim>& solid, int cuts, bool around_axis = false);

/// Directions in the plane across a unit vector: both in two dimensions, eight in three.
template <int Dim>
std::vector<Vec<Dim>> directions_across(const Vec<Dim>& normal);

template <int Dim>
struct SurfacePoint {
  Vec<Dim> x;     ///< [m]
  Vec<Dim> out;   ///< unit vector out of the solid; the mean of the sides of an edge
  bool is_sharp;  ///< on an edge or a corner that points outwards
};

/// Points on the surface of a solid with an end, about `cuts` along its longest edge. Corners are
/// points, and edges have theirs, where sides meet at 15 degrees or more.
template <int Dim>
std::vector<SurfacePoint<Dim>> surface_points(const Solid<Dim>& solid, int cuts);

}  // namespace lahar
