/// \file What a node has of one quantity: a vector of doubles.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "physics/base/simd.h"
#include "physics/base/types.h"

namespace lahar {

/// Doubles of every quantity of a node, one vector: {m v, m}, {f, 0}, {m v, m} (MUSL's second
/// mapping), {m p, 0, 0, 0}, {V grad N, 0} and ends of the body (contact; not sums but the
/// furthest: contact_surface.h), {m u, 0} and {m c_p, m c_s, m rho, m} (NodeMeans),
/// {m, 0} and {m v, 0} by direction of particles whose velocity along it is prescribed, twice
/// {m v, 0} (orders of the velocity transfer); nodal state {v, m} and {a, 0}.
inline constexpr int node_width = 4;
inline constexpr int mass_lane = 3;
using NodeVector = PackOf<node_width>;
using NodeArray = std::vector<double, Eigen::aligned_allocator<double>>;

/// {f, 0}
template <int Dim>
LAHAR_INLINE NodeVector node_vector(const Vec<Dim>& f) {
  double values[node_width] = {};
  for (int d = 0; d < Dim; ++d) values[d] = f[d];
  return load<NodeVector>(values);
}

}  // namespace lahar
