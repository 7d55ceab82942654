/// \file What an iterative solver keeps at the nodes of a patch, and what it tells all patches.
#pragma once

#include <array>

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
    full_step   ///< its second half
  } product = Product::residual;
  /// The m of the next round; D is the inverse of the diagonal of A.
  enum class Factor { x, p, Dr, Dw, Ds, Dz } factor = Factor::Dr;
  bool restarts = true;   ///< with `residual`: there are no directions, and r* = r
  bool bicgstab = false;  ///< whose sums are given
  double alpha = 0, beta = 0, omega = 0;
};

/// Sums that patches give after a round. Some places have another meaning with BiCGStab.
enum class SolverSum : int {
  rr,           ///< (r, r)
  rDr,          ///< (r, D r)
  wDr,          ///< (w, D r)
  bb,           ///< (b, b), with Product::residual
  unsolvable,   ///< with Product::residual: rows without a diagonal entry, but with a right side
  r_r = 1,      ///< (r*, r)
  r_w = 2,      ///< (r*, w)
  r_s = 3,      ///< (r*, s)
  r_z = 4,      ///< (r*, z)
  half_rw = 1,  ///< (r, w) after the first half
  half_ww = 2   ///< (w, w) after the first half
};
inline constexpr int n_solver_sums = 5;

/// Vectors by local node, node_width apart, complete at all copies of a node. Lanes in which there
/// is nothing to solve for are zero.
struct SolverVectors {
  const SolverOrder* order = nullptr;  ///< the same for all patches
  Index first_round = 0;               ///< in which the diagonal is exchanged
  NodeArray inverse;                   ///< {D, 1 where this patch counts the node in sums}
  NodeArray factor;                    ///< m
  NodeArray r, w, s, z, p;
  NodeArray v, t, shadow;  ///< BiCGStab; r* is the shadow residual
  std::array<double, n_solver_sums> sums{};
};

}  // namespace lahar
