/// \file Walls that lie along the axes of the mesh.
#pragma once

#include <cmath>
#include <optional>

#include "physics/boundary/constrained_node.h"

namespace lahar {

struct GlobalAxis {
  int dir;
  double sign;  ///< the wall's axis is sign e_dir
};

/// The global axis along which the local axis k of a wall lies, if it lies along one.
template <int Dim>
std::optional<GlobalAxis> global_axis(const ConstrainedNode<Dim>& wall, int k) {
  constexpr double aligned = 0.999;  // cosine
  for (int d = 0; d < Dim; ++d)
    if (std::abs(wall.axes(d, k)) > aligned) return GlobalAxis{d, wall.axes(d, k) > 0 ? 1.0 : -1.0};
  return {};
}

}  // namespace lahar
