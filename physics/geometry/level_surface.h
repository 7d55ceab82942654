/// \file Where values on a regular grid pass a level: lines in two dimensions, triangles in three.
#pragma once

#include <array>
#include <type_traits>
#include <vector>

#include "physics/geometry/triangles.h"

namespace lahar {

/// Values at the points of a regular grid. Point (i,j,k) is value i + n[0] (j + n[1] k).
template <int Dim>
struct GridValues {
  Vec<Dim> low = Vec<Dim>::Zero();      ///< [m] its first point
  Vec<Dim> spacing = Vec<Dim>::Zero();  ///< [m] along the axes
  std::array<Index, Dim> n{};           ///< points along the axes
  std::vector<float> values;

  Index size() const;
  Vec<Dim> place(Index point) const;  ///< [m]
};

/// Straight lines with common ends.
struct Lines {
  std::vector<Vec<2>> points;                 ///< [m]
  std::vector<std::array<Local, 2>> corners;  ///< ends of each line
};

template <int Dim>
using LevelSurface = std::conditional_t<Dim == 2, Lines, Triangles>;

/// The surface of what has values above `level`. Values are linear on the simplices around the
/// diagonal of each cell, 2 or 6 (marching tetrahedra; Doi & Koide 1991, IEICE Trans. E74,
/// 214-224). It ends only where the grid does. Seen from outside corners are counter-clockwise; in
/// two dimensions the inside is on the left.
template <int Dim>
LevelSurface<Dim> level_surface(const GridValues<Dim>& grid, double level);

extern template struct GridValues<2>;
extern template struct GridValues<3>;
extern template Lines level_surface<2>(const GridValues<2>&, double);
extern template Triangles level_surface<3>(const GridValues<3>&, double);

}  // namespace lahar
