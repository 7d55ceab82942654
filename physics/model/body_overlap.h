/// \file Particles that begin inside of a rigid body, which would throw them out.
#pragma once

#include <algorithm>
#include <array>

#include "physics/base/types.h"

namespace lahar {

/// How many there are, and the deepest of them; of equals, the first.
template <int Dim>
struct BodyOverlap {
  /// So much of a cell is no overlap.
  static constexpr double least_share = 1e-3;

  Index count = 0;
  double depth = 0;  ///< [m]
  std::array<double, Dim> x{};

  void add(const Vec<Dim>& at, double deep) {
    ++count;
    if (!(deep > depth)) return;
    depth = deep;
    std::copy_n(at.data(), Dim, x.begin());
  }
  void add(const BodyOverlap& other) {
    count += other.count;
    if (other.depth > depth) depth = other.depth, x = other.x;
  }
};

}  // namespace lahar
