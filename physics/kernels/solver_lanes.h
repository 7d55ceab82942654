/// \file What solvers do to the lanes of a node.
#pragma once

#include "physics/base/node_vector.h"
#include "physics/base/simd.h"
#include "physics/particles/solver_vectors.h"

namespace lahar {

/// `value` in lanes in which there is something to solve for, else zero.
LAHAR_INLINE NodeVector where_free(const NodeVector& inverse, const NodeVector& value) {
  const NodeVector zero(0.0);
  return NodeVector::of(inverse.v != zero.v ? value.v : zero.v);
}

/// Sums of a patch, lane by lane.
class LaneSums {
 public:
  /// Terms a b, of a node with this SolverVectors::inverse.
  LAHAR_INLINE void add(SolverSum which, const NodeVector& inverse, const NodeVector& a,
                        const NodeVector& b) {
    sum_[static_cast<int>(which)] += NodeVector(a * b) * NodeVector(inverse[mass_lane]);
  }
  void store_in(SolverVectors& solver) const {
    for (std::size_t k = 0; k < n_solver_sums; ++k) solver.sums[k] = reduce(sum_[k]);
  }

 private:
  NodeVector sum_[n_solver_sums] = {0.0, 0.0, 0.0, 0.0, 0.0};
};

}  // namespace lahar
