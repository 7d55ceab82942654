/// \file The vectors of a solver at one node, and what is done to their lanes.
#pragma once

#include "physics/base/simd.h"
#include "physics/particles/node_sums.h"

namespace lahar {

/// Null where a solver does not have that vector.
struct NodeOfSolver {
  double *x, *m, *r, *w, *s, *z, *p, *v, *t, *d, *shadow;
  const double* b;
  NodeVector inverse;
};

template <int Dim>
LAHAR_INLINE NodeOfSolver node_of_solver(NodalSystem<Dim>& system, const SolverOrder& order,
                                         Local i) {
  SolverVectors& solver = system.solver;
  const bool cycles = order.multigrid, pipelined = order.bicgstab;
  return {.x = at(system.solution, i),
          .m = at(solver.factor, i),
          .r = at(solver.r, i),
          .w = at(solver.w, i),
          .s = at(solver.s, i),
          .z = at(solver.z, i),
          .p = at(solver.p, i),
          .v = pipelined ? at(solver.v, i) : nullptr,
          .t = pipelined || cycles ? at(solver.t, i) : nullptr,
          .d = cycles ? at(solver.d, i) : nullptr,
          .shadow = pipelined || cycles ? at(solver.shadow, i) : nullptr,
          .b = at(system.right_side, i),
          .inverse = load<NodeVector>(at(solver.inverse, i))};
}

LAHAR_INLINE NodeVector get(const double* p) {
  return load<NodeVector>(p);
}

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
