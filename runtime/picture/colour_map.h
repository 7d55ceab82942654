/// \file Colours of values: equal steps of a value look like equal steps.
#pragma once

#include <string>

#include "runtime/picture/image.h"

namespace lahar {

/// matplotlib's map "viridis", for values from 0 to 1.
Rgba viridis(double value);

/// For values with a sign: blue at 0, light at 1/2, red at 1.
Rgba diverging(double value);

/// `#rrggbb`
std::string hex_of(const Rgba& colour);

/// How a field is shown.
struct ColourScale {
  double low = 0, high = 1;  ///< beyond, the colours of the ends
  bool is_signed = false;    ///< zero is in the middle, and the map is diverging

  /// Of finite values.
  Rgba colour(double value) const;
  /// 0 to 1 where a value is within the scale.
  double share(double value) const { return (value - low) / (high - low); }
};

}  // namespace lahar
