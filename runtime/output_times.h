/// \file Output at multiples of a time: which steps give it.
#pragma once

#include <cmath>

#include "physics/types.h"

namespace lahar {

/// A multiple that is missed by this share of the interval is reached: times are rounded.
inline constexpr double rounding_of_multiples = 1e-6;

/// How many multiples of `interval` [s] after 0 a `time` [s] has reached.
inline Index multiples_by(double time, double interval) {
  return static_cast<Index>(std::floor(time / interval + rounding_of_multiples));
}

/// The next multiple of `interval` after those that `time` has reached [s].
inline double next_multiple(double time, double interval) {
  return static_cast<double>(multiples_by(time, interval) + 1) * interval;
}

}  // namespace lahar
