#include "physics/kernels/solver.h"

#include <algorithm>
#include <initializer_list>

#include "physics/kernels/solver_lanes.h"
#include "physics/particles/node_sums.h"

namespace lahar {

namespace {

/// The inverse of the diagonal of free unknowns, and a zero.
template <int Dim>
NodeVector inverse_of(const NodeVector& diagonal, unsigned held) {
  double values[node_width] = {};
  for (int d = 0; d < Dim; ++d)
    if (!(held >> d & 1u) && diagonal[d] != 0) values[d] = 1 / diagonal[d];
  return load<NodeVector>(values);
}

/// Whether this patch is the first of those that have a row of their own for a shared node.
template <int Dim>
bool is_first_with_row(const Patch<Dim>& patch, const double* const* sums, std::size_t shared) {
  constexpr int lane = sum_offset(NodeSum::diagonal) + mass_lane;
  const auto& topology = patch.topology;
  for (Local e = topology.first[shared]; e < topology.first[shared + 1]; ++e) {
    const auto& share = topology.shares[static_cast<std::size_t>(e)];
    const double* const from = sums[share.neighbour + 1];
    if (from && from[static_cast<std::ptrdiff_t>(share.node) * sum_stride + lane] != 0)
      return share.neighbour < 0;
  }
  return false;
}

/// D, and which nodes this patch counts; how many rows of those have a right side, but nothing to
/// solve it with.
template <int Dim>
double find_inverse(Patch<Dim>& patch, Index round) {
  NodalSystem<Dim>& system = patch.system;
  NodeArray& inverse = system.solver.inverse;
  const SumOverPatches<Dim> diagonals(patch, NodeSum::diagonal, round);
  double unsolvable = 0;
  for_each_node(patch, diagonals, [&](Local i, const NodeVector& own, const NodeVector& sum) {
    const auto row = static_cast<std::size_t>(i);
    const unsigned held = system.held.empty() ? 0u : system.held[row];
    store(inverse_of<Dim>(sum, held), at(inverse, i));
    const bool counts = own[mass_lane] != 0;  // nodes that are not shared
    at(inverse, i)[mass_lane] = counts ? 1 : 0;
  });
  const double* const* sums = patch.all_sums(NodeSum::product, round);
  const auto& shared = patch.topology.shared_node;
  for (std::size_t k = 0; k < shared.size(); ++k)
    if (patch.node_is_active[static_cast<std::size_t>(shared[k])])
      at(inverse, shared[k])[mass_lane] = is_first_with_row(patch, sums, k) ? 1 : 0;
  for (Local i = 0; i < patch.n_nodes(); ++i) {
    if (at(inverse, i)[mass_lane] == 0) continue;
    const unsigned held = system.held.empty() ? 0u : system.held[static_cast<std::size_t>(i)];
    for (int d = 0; d < Dim; ++d)
      unsolvable += !(held >> d & 1u) && at(inverse, i)[d] == 0 && at(system.right_side, i)[d] != 0;
  }
  return unsolvable;
}

/// What becomes of a product; the sums of those rounds after which nothing else is given are (r, r)
/// and what the next iteration begins with.
LAHAR_INLINE void add_sums(const SolverOrder& order, const NodeOfSolver& node, LaneSums& sums) {
  const NodeVector& inverse = node.inverse;
  const NodeVector r = get(node.r), w = get(node.w);
  sums.add(SolverSum::rr, inverse, r, r);
  if (order.product == SolverOrder::Product::residual) {
    const NodeVector b = where_free(inverse, get(node.b));
    sums.add(SolverSum::bb, inverse, b, b);
  } else if (!order.bicgstab) {
    const NodeVector u = inverse * r;
    sums.add(SolverSum::rDr, inverse, r, u);
    sums.add(SolverSum::wDr, inverse, w, u);
  } else if (order.product == SolverOrder::Product::half_step) {
    sums.add(SolverSum::half_rw, inverse, r, w);
    sums.add(SolverSum::half_ww, inverse, w, w);
  } else {
    const NodeVector shadow = get(node.shadow);
    sums.add(SolverSum::r_r, inverse, shadow, r);
    sums.add(SolverSum::r_w, inverse, shadow, w);
    sums.add(SolverSum::r_s, inverse, shadow, get(node.s));
    sums.add(SolverSum::r_z, inverse, shadow, get(node.z));
  }
}

LAHAR_INLINE void take_residual(const SolverOrder& order, const NodeOfSolver& node,
                                const NodeVector& n) {
  const NodeVector r = where_free(node.inverse, get(node.b) - n);
  store(r, node.r);
  if (!order.restarts) return;
  const NodeVector zero(0.0);
  store(where_free(node.inverse, get(node.x)), node.x);
  for (double* direction : {node.s, node.z, node.p}) store(zero, direction);
  if (node.v) store(zero, node.v);
  if (node.shadow) store(r, node.shadow);
}

/// Ghysels and Vanroose, algorithm 3, lines 10 to 17.
LAHAR_INLINE void take_step(const SolverOrder& order, const NodeOfSolver& node,
                            const NodeVector& n) {
  const NodeVector alpha(order.alpha), beta(order.beta);
  const NodeVector z = n + beta * get(node.z);
  const NodeVector s = get(node.w) + beta * get(node.s);
  const NodeVector p = node.inverse * get(node.r) + beta * get(node.p);
  store(z, node.z);
  store(s, node.s);
  store(p, node.p);
  store(get(node.x) + alpha * p, node.x);
  store(get(node.r) - alpha * s, node.r);
  store(get(node.w) - alpha * z, node.w);
}

/// Cools and Vanroose, algorithm 4, to the first reduction: r and w become what they call q and y.
LAHAR_INLINE void take_half_step(const SolverOrder& order, const NodeOfSolver& node,
                                 const NodeVector& n) {
  const NodeVector alpha(order.alpha), beta(order.beta), omega(order.omega);
  const NodeVector p = get(node.r) + beta * NodeVector(get(node.p) - omega * get(node.s));
  const NodeVector s = get(node.w) + beta * NodeVector(get(node.s) - omega * get(node.z));
  const NodeVector z = n + beta * NodeVector(get(node.z) - omega * get(node.v));
  store(p, node.p);
  store(s, node.s);
  store(z, node.z);
  store(n, node.t);
  store(get(node.r) - alpha * s, node.r);
  store(get(node.w) - alpha * z, node.w);
}

/// The same, to the second reduction.
LAHAR_INLINE void take_full_step(const SolverOrder& order, const NodeOfSolver& node,
                                 const NodeVector& n) {
  const NodeVector alpha(order.alpha), omega(order.omega);
  const NodeVector q = get(node.r), y = get(node.w);
  const NodeVector change = alpha * get(node.p) + omega * q;
  store(get(node.x) + node.inverse * change, node.x);
  store(q - omega * y, node.r);
  store(y - omega * NodeVector(get(node.t) - alpha * n), node.w);
  store(n, node.v);
}

LAHAR_INLINE void take_product(const SolverOrder& order, const NodeOfSolver& node,
                               const NodeVector& product) {
  using Product = SolverOrder::Product;
  const NodeVector n = where_free(node.inverse, product);
  switch (order.product) {
    case Product::none:
      return;
    case Product::residual:
      return take_residual(order, node, product);
    case Product::w:
      return store(n, node.w);
    case Product::s:
      return store(n, node.s);
    case Product::z:
      return store(n, node.z);
    case Product::step:
      return take_step(order, node, n);
    case Product::half_step:
      return take_half_step(order, node, n);
    case Product::full_step:
      return take_full_step(order, node, n);
    default:  // advance_cycle()
      return;
  }
}

LAHAR_INLINE NodeVector next_factor(const SolverOrder& order, const NodeOfSolver& node) {
  using Factor = SolverOrder::Factor;
  switch (order.factor) {
    case Factor::x:
      return get(node.x);
    case Factor::p:
      return get(node.p);
    case Factor::Dr:
      return node.inverse * get(node.r);
    case Factor::Dw:
      return node.inverse * get(node.w);
    case Factor::Ds:
      return node.inverse * get(node.s);
    case Factor::Dz:
      return node.inverse * get(node.z);
    default:
      return NodeVector(0.0);
  }
}

}  // namespace

template <int Dim>
void begin_solver(Patch<Dim>& patch, const SolverOrder& order, Index first_round,
                  bool from_solution) {
  SolverVectors& solver = patch.system.solver;
  NodeArray& x = patch.system.solution;
  solver.order = &order;
  solver.first_round = first_round;
  solver.multiplied = SolverOrder::Factor::x;
  if (patch.active_nodes.empty()) return;
  const std::size_t size = static_cast<std::size_t>(patch.n_nodes()) * node_width;
  for (NodeArray* vector : {&solver.inverse, &solver.r, &solver.w, &solver.s, &solver.z, &solver.p})
    vector->assign(size, 0.0);
  if (order.bicgstab || order.multigrid)
    for (NodeArray* vector : {&solver.t, &solver.shadow, order.multigrid ? &solver.d : &solver.v})
      vector->assign(size, 0.0);
  if (from_solution)
    x.resize(size, 0.0);
  else
    x.assign(size, 0.0);
  patch.system.right_side.resize(size, 0.0);
  for (std::size_t i = 0; i < patch.system.held.size(); ++i)
    for (std::size_t d = 0; d < Dim; ++d)
      if (patch.system.held[i] >> d & 1) x[i * node_width + d] = 0;
  solver.factor = x;
}

template <int Dim>
void advance_solver(Patch<Dim>& patch, const StepContext<Dim>& round) {
  NodalSystem<Dim>& system = patch.system;
  SolverVectors& solver = system.solver;
  const SolverOrder order = *solver.order;
  solver.sums.fill(0.0);
  solver.multiplied = order.factor;
  if (patch.active_nodes.empty()) return;
  if (is_of_cycle(order)) return advance_cycle(patch, round);
  const double unsolvable =
      round.step == solver.first_round ? find_inverse(patch, round.step) : 0.0;
  LaneSums sums;
  for_each_node(patch, SumOverPatches<Dim>(patch, NodeSum::product, round.step),
                [&](Local i, const NodeVector&, const NodeVector& product) {
                  const NodeOfSolver node = node_of_solver(system, order, i);
                  take_product(order, node, product);
                  store(next_factor(order, node), node.m);
                  add_sums(order, node, sums);
                });
  sums.store_in(solver);
  if (order.product == SolverOrder::Product::residual)
    solver.sums[static_cast<std::size_t>(SolverSum::unsolvable)] = unsolvable;
}

template void begin_solver<2>(Patch<2>&, const SolverOrder&, Index, bool);
template void begin_solver<3>(Patch<3>&, const SolverOrder&, Index, bool);
template void advance_solver<2>(Patch<2>&, const StepContext<2>&);
template void advance_solver<3>(Patch<3>&, const StepContext<3>&);

}  // namespace lahar
