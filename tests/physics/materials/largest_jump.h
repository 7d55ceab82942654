/// \file Jumps of the stress along a line of increments.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

namespace lahar::test {

/// The largest difference of a component of the stresses of two states.
template <class State>
double stress_difference(const State& a, const State& b) {
  double most = 0;
  for (std::size_t k = 0; k < a.stress.size(); ++k)
    most = std::max(most, std::abs(a.stress[k] - b.stress[k]));
  return most;
}

/// Where the stress of the state `at(t)` changes most between t = 0 and 1. The part with the
/// largest difference is found of n equal ones, and is divided again, `zooms` times.
template <class At>
std::pair<double, double> where_it_changes_most(const At& at, int n, int zooms) {
  double low = 0, high = 1;
  for (int zoom = 0; zoom < zooms; ++zoom) {
    const double step = (high - low) / n, first = low;
    auto before = at(first);
    double most = -1;
    for (int i = 1; i <= n; ++i) {
      const auto now = at(first + i * step);
      if (const double change = stress_difference(now, before); change > most) {
        most = change;
        low = first + (i - 1) * step, high = first + i * step;
      }
      before = now;
    }
  }
  return {low, high};
}

}  // namespace lahar::test
