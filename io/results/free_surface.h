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
  double spacing = 0;  ///< [m] of the grid; 0: twice the cube root of the mean volume
  double level = 0.5;
};

/// Throws InputError for frames in two dimensions, and where the grid is too large.
Triangles free_surface(const Frame& frame, FreeSurfaceOptions options = {});

}  // namespace lahar
