/// \file Vectors with three components, in models of two and of three dimensions.
#pragma once

#include <algorithm>
#include <array>

#include "physics/base/types.h"

namespace lahar {

/// The third component of a vector in two dimensions is 0.
template <int Dim>
std::array<double, 3> in_space(const Vec<Dim>& x) {
  std::array<double, 3> all{};
  std::copy_n(x.data(), Dim, all.begin());
  return all;
}

}  // namespace lahar
