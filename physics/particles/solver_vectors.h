/// \file What an iterative solver keeps at the nodes of a patch, and what it tells all patches.
#pragma once

#include <array>
#include <vector>

#include "physics/base/node_vector.h"
#include "physics/base/types.h"

namespace lahar {

/// What all patches do in a round, when the product n = A m is there (physics/kernels/solver.h).
struct SolverOrder {
  /// What becomes of n.
  enum class Product {
    none,
    residual,   ///< r = b - n
    w,          ///< w = n
    s,          ///< s = n
    z,          ///< z = n
    step,       ///< an iteration of conjugate gradients
    half_step,  ///< the first half of one of BiCGStab
    full_step,  ///< its second half
    // With a multigrid cycle, z = M r, as preconditioner. Those without n have no product before.
    smooth,          ///< t -= n; d = previous d + latest D t; z += d
    restrict,        ///< t -= n, and what the coarse nodes get of it
    prolong,         ///< d = what coarse nodes found; z += d; without n
    direction,       ///< p = z + beta p; s = n + beta s
    descend,         ///< x += alpha p; r -= alpha s; without n
    bi_direction,    ///< p = r + beta (p - omega s); without n
    first_product,   ///< s = n
    first_half,      ///< x += alpha z; r -= alpha s; without n
    second_product,  ///< w = n
    second_half      ///< x += omega z; r -= omega w; without n
  } product = Product::residual;
  /// The m of the next round; D is the inverse of the diagonal of A. `none`: it has no product.
  enum class Factor { x, p, Dr, Dw, Ds, Dz, none, z, d } factor = Factor::Dr;
  /// A cycle begins, after all else: t = r or p; d = latest D t; z = d.
  enum class Cycle { none, of_r, of_p } cycle = Cycle::none;
  bool restarts = true;   ///< with `residual`: there are no directions, and r* = r
  bool bicgstab = false;  ///< whose sums are given
  bool multigrid = false;
  double alpha = 0, beta = 0, omega = 0;
  double previous = 0, latest = 0;          ///< of smoothing
  const double* of_coarse_nodes = nullptr;  ///< what they found, node_width apart
};

/// A round of solvers with a multigrid cycle (advance_cycle()).
constexpr bool is_of_cycle(const SolverOrder& order) {
  return order.product >= SolverOrder::Product::smooth || order.cycle != SolverOrder::Cycle::none;
}

/// Sums that patches give after a round. Some places have another meaning with BiCGStab.
enum class SolverSum : int {
  rr,            ///< (r, r)
  rDr,           ///< (r, D r)
  wDr,           ///< (w, D r)
  bb,            ///< (b, b), with Product::residual
  unsolvable,    ///< with Product::residual: rows without a diagonal entry, but with a right side
  r_r = 1,       ///< (r*, r)
  r_w = 2,       ///< (r*, w)
  r_s = 3,       ///< (r*, s)
  r_z = 4,       ///< (r*, z)
  half_rw = 1,   ///< (r, w) after the first half
  half_ww = 2,   ///< (w, w) after the first half
  rz = 1,        ///< (r, z) after smoothing
  ps = 1,        ///< (p, s) after `direction`
  pp = 1,        ///< (p, p) after `bi_direction`
  r_product = 1  ///< (r*, s) after `first_product`
};
inline constexpr int n_solver_sums = 5;

/// The coarse nodes around a patch, which are those of a lattice of boxes. A node of the mesh lies
/// in one of the boxes, and moves with its corners as multilinear functions say.
struct CoarseNodes {
  std::vector<Local> first;       ///< by local node: the coarse node at the lower corner of its box
  std::array<Local, 8> corner{};  ///< from there to the corners, in tensor order
  std::vector<double> weights;    ///< functions of the corners, by local node
  std::vector<Index> number;      ///< by coarse node: among all that there are; -1 = none
  NodeArray sums;                 ///< of `restrict`, by coarse node
};

/// Vectors by local node, node_width apart, complete at all copies of a node. Lanes in which there
/// is nothing to solve for are zero.
struct SolverVectors {
  const SolverOrder* order = nullptr;                       ///< the same for all patches
  Index first_round = 0;                                    ///< in which the diagonal is exchanged
  SolverOrder::Factor multiplied = SolverOrder::Factor::x;  ///< m of the next product
  CoarseNodes coarse;                                       ///< of a multigrid cycle
  NodeArray inverse;  ///< {D, 1 where this patch counts the node in sums}
  NodeArray factor;   ///< m, where it is none of the vectors below
  NodeArray r, w, s, z, p;
  NodeArray v;          ///< pipelined BiCGStab
  NodeArray t, shadow;  ///< and multigrid cycles, whose residual is t; r* is the shadow residual
  NodeArray d;          ///< multigrid cycles
  std::array<double, n_solver_sums> sums{};
};

}  // namespace lahar
