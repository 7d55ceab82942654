/// \file The tolerance with which a particle outside every cell by rounding is still inside.
#pragma once

#include <limits>

namespace lahar {

/// A point outside every cell belongs to a cell that it misses by less than this [natural
/// coordinates]: far above the rounding of a particle's move, far below any length of interest.
inline constexpr double touch_natural = 1e-10;
/// Coordinates carry this many rounding units of error when they reach the search [-]; matters for
/// meshes far from the origin (cells of 1 m at coordinates of 1e6 m).
inline constexpr double touch_rounding_units = 16;

/// Tolerance [natural coordinates] for a point of magnitude x [m] and a cell of length [m].
inline double touch_tolerance(double x, double length) {
  return touch_natural + touch_rounding_units * std::numeric_limits<double>::epsilon() * x / length;
}

}  // namespace lahar
