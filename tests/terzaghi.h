/// \file A layer that consolidates.
#pragma once

#include <cmath>
#include <numbers>

namespace lahar::test {

/// Pore pressure over the load at a depth of a layer, as a share of its thickness, which drains at
/// its top (Terzaghi 1923). T = c_v t / thickness^2.
inline double terzaghi(double T, double depth = 1) {
  double sum = 0;
  for (int m = 0; m < 200; ++m) {
    const double M = (2 * m + 1) * std::numbers::pi / 2;
    sum += 2 / M * std::sin(M * depth) * std::exp(-M * M * T);
  }
  return sum;
}

}  // namespace lahar::test
