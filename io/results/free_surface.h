/// \file The surface of material as triangles.
#pragma once

#include "io/frames/frame.h"
#include "physics/geometry/triangles.h"

namespace lahar {

/// Where the share of space that particles fill passes `level`: inside it is nearly 1, far from
/// particles 0. The share at a point of a grid is sum(w V) / spacing^3, with the volumes V of
/// particles and w = product of 1 - |d| / spacing over the axes, for the distance d along each.
/// Between points it is as level_surface() says. The surface is closed; corners are
/// counter-clockwise seen from outside.
struct FreeSurfaceOptions {
  double spacing = 0;  ///< [m] of the grid; 0: the usual one
  double level = 0.5;
};

/// [m] Spacings of the grid for a frame.
struct SurfaceSpacings {
  /// 1.3 times the cube root of the mean volume. A finer grid shows holes between particles, at the
  /// latest where they lie in no order.
  double finest = 0;
  double usual = 0;  ///< twice that root
};
SurfaceSpacings surface_spacings(const Frame& frame);

/// Throws InputError for frames in two dimensions, and where the grid is too large.
Triangles free_surface(const Frame& frame, FreeSurfaceOptions options = {});

}  // namespace lahar
