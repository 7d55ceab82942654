/// \file Output at multiples of a time: which steps give it.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "physics/base/types.h"

namespace lahar {

/// A multiple that is missed by this share of the interval is reached: times are rounded.
inline constexpr double rounding_of_multiples = 1e-6;

/// Numbers of multiples up to this are exact. The reader refuses intervals that give more where it
/// knows how long a run is.
inline constexpr double most_multiples = 9e15;

/// How many multiples of `interval` [s] after 0 a `time` [s] has reached, at most `most_multiples`.
inline Index multiples_by(double time, double interval) {
  return static_cast<Index>(
      std::min(std::floor(time / interval + rounding_of_multiples), most_multiples));
}

/// The next multiple of `interval` after those that `time` has reached [s]; always after `time`.
inline double next_multiple(double time, double interval) {
  const double next = (std::floor(time / interval + rounding_of_multiples) + 1.0) * interval;
  return std::max(next, std::nextafter(time, std::numeric_limits<double>::infinity()));
}

}  // namespace lahar
