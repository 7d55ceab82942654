// Rounds of solvers whose preconditioner is a multigrid cycle.
#include "physics/kernels/coarse_nodes.h"
#include "physics/kernels/solver.h"
#include "physics/kernels/solver_lanes.h"
#include "physics/particles/node_sums.h"

namespace lahar {

namespace {

using Product = SolverOrder::Product;

/// What becomes of the product n.
LAHAR_INLINE void take_product(const SolverOrder& order, const NodeOfSolver& node,
                               const NodeVector& n) {
  const NodeVector alpha(order.alpha), beta(order.beta), omega(order.omega);
  switch (order.product) {
    case Product::smooth: {
      const NodeVector t = get(node.t) - n;
      const NodeVector d = NodeVector(order.previous) * get(node.d) +
                           NodeVector(order.latest) * NodeVector(node.inverse * t);
      store(t, node.t);
      store(d, node.d);
      return store(get(node.z) + d, node.z);
    }
    case Product::restrict:
      return store(get(node.t) - n, node.t);
    case Product::prolong:
      return store(get(node.z) + get(node.d), node.z);
    case Product::direction:
      store(get(node.z) + beta * get(node.p), node.p);
      return store(n + beta * get(node.s), node.s);
    case Product::descend:
      store(get(node.x) + alpha * get(node.p), node.x);
      return store(get(node.r) - alpha * get(node.s), node.r);
    case Product::bi_direction:
      return store(get(node.r) + beta * NodeVector(get(node.p) - omega * get(node.s)), node.p);
    case Product::first_product:
      return store(n, node.s);
    case Product::first_half:
      store(get(node.x) + alpha * get(node.z), node.x);
      return store(get(node.r) - alpha * get(node.s), node.r);
    case Product::second_product:
      return store(n, node.w);
    case Product::second_half:
      store(get(node.x) + omega * get(node.z), node.x);
      return store(get(node.r) - omega * get(node.w), node.r);
    default:
      return;
  }
}

LAHAR_INLINE void begin_cycle(const SolverOrder& order, const NodeOfSolver& node) {
  if (order.cycle == SolverOrder::Cycle::none) return;
  const NodeVector t = get(order.cycle == SolverOrder::Cycle::of_r ? node.r : node.p);
  const NodeVector d = NodeVector(order.latest) * NodeVector(node.inverse * t);
  store(t, node.t);
  store(d, node.d);
  store(d, node.z);
}

LAHAR_INLINE void add_sums(const SolverOrder& order, const NodeOfSolver& node, LaneSums& sums) {
  const NodeVector& inverse = node.inverse;
  const NodeVector r = get(node.r);
  if (order.cycle != SolverOrder::Cycle::none || order.product == Product::second_half)
    sums.add(SolverSum::rr, inverse, r, r);
  switch (order.product) {
    case Product::smooth:
      if (order.factor != SolverOrder::Factor::z) return;
      return sums.add(SolverSum::rz, inverse, r, get(node.z));
    case Product::direction:
      return sums.add(SolverSum::ps, inverse, get(node.p), get(node.s));
    case Product::bi_direction:
      return sums.add(SolverSum::pp, inverse, get(node.p), get(node.p));
    case Product::first_product:
      return sums.add(SolverSum::r_product, inverse, get(node.shadow), get(node.s));
    case Product::second_product:
      sums.add(SolverSum::half_rw, inverse, r, get(node.w));
      return sums.add(SolverSum::half_ww, inverse, get(node.w), get(node.w));
    case Product::second_half:
      return sums.add(SolverSum::r_r, inverse, get(node.shadow), r);
    default:
      return;
  }
}

}  // namespace

template <int Dim>
void advance_cycle(Patch<Dim>& patch, const StepContext<Dim>& round) {
  NodalSystem<Dim>& system = patch.system;
  SolverVectors& solver = system.solver;
  const SolverOrder order = *solver.order;
  if (order.product == Product::prolong) prolong(patch, order.of_coarse_nodes);
  LaneSums sums;
  for_each_node(patch, SumOverPatches<Dim>(patch, NodeSum::product, round.step),
                [&](Local i, const NodeVector&, const NodeVector& product) {
                  const NodeOfSolver node = node_of_solver(system, order, i);
                  take_product(order, node, where_free(node.inverse, product));
                  begin_cycle(order, node);
                  add_sums(order, node, sums);
                });
  sums.store_in(solver);
  if (order.product == Product::restrict) restrict_residual(patch);
}

template void advance_cycle<2>(Patch<2>&, const StepContext<2>&);
template void advance_cycle<3>(Patch<3>&, const StepContext<3>&);

}  // namespace lahar
