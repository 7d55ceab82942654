/// \file Regions of the scenario as rigid shapes.
#pragma once

#include "io/json/json_source.h"
#include "io/scenario/geometry.h"
#include "physics/geometry/solid.h"

namespace lahar {

/// The solid that fills a region (region_section()), which Region has read without a problem. Null
/// where the region has no surface, such as one without an end on all sides.
template <int Dim>
SolidPtr<Dim> solid_of_region(const JsonValue& region, const Geometries<Dim>& geometries);

/// Volume of a solid [m^Dim], its centre [m], and its moments about it, of unit density: by equal
/// boxes that cut its bounds, `cuts` along the longest edge. A box that the surface cuts counts in
/// part, so that the error falls with the square of their size.
template <int Dim>
struct SolidMoments {
  double volume = 0;
  Vec<Dim> centre = Vec<Dim>::Zero();
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();  ///< [m^(Dim + 2)]; in two dimensions zz
};
template <int Dim>
SolidMoments<Dim> moments_of(const Solid<Dim>& solid, int cuts);

}  // namespace lahar
