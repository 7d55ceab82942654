/// \file Values between given ones.
#pragma once

#include <algorithm>
#include <array>
#include <vector>

namespace lahar {

/// Linear between points of ascending first components, constant outside; there is one at least.
inline double interpolated(const std::vector<std::array<double, 2>>& points, double at) {
  const auto after = std::upper_bound(points.begin(), points.end(), at,
                                      [](double x, const auto& p) { return x < p[0]; });
  if (after == points.begin()) return points.front()[1];
  if (after == points.end()) return points.back()[1];
  const auto& [x0, y0] = *(after - 1);
  return y0 + (at - x0) / ((*after)[0] - x0) * ((*after)[1] - y0);
}

}  // namespace lahar
