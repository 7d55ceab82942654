/// \file The surface of material as triangles.
#pragma once

#include <filesystem>

#include "io/frames/frame.h"
#include "physics/geometry/triangles.h"

namespace lahar {

/// Where the share of space that particles fill passes `level`: inside it is nearly 1, far from
/// particles 0. The share at a point of a grid is sum(w V) / spacing^3, with the volumes V of
/// particles and w = product of 1 - |d| / spacing over the axes, for the distance d along each.
/// Between points it is linear on six tetrahedra of each cell (marching tetrahedra; Doi & Koide
/// 1991, IEICE Trans. E74, 214-224). The surface is closed; corners are counter-clockwise seen from
/// outside.
struct FreeSurfaceOptions {
  double spacing = 0;  ///< [m] of the grid; 0: twice the cube root of the mean volume
  double level = 0.5;
};

/// Throws InputError for frames in two dimensions, and where the grid is too large.
Triangles free_surface(const Frame& frame, FreeSurfaceOptions options = {});

/// A binary STL file. Throws IoError.
void write_stl(const Triangles& triangles, const std::filesystem::path& file);
/// A VTK PolyData file. Throws IoError.
void write_vtp(const Triangles& triangles, double time, const std::filesystem::path& file);

}  // namespace lahar
