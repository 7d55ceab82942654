/// \file Iterative solvers of NodalSystem, as far as a patch does them: a product with its own part
/// of the matrix, and, when neighbours have added theirs, whatever follows from it.
///
/// A round is add_product(), an exchange of NodeSum::product, and advance_solver(). So iterations
/// have one product, whose exchange and reduction are one each and are under way together:
///
/// - pipelined conjugate gradients (P. Ghysels and W. Vanroose, "Hiding global synchronization
///   latency in the preconditioned conjugate gradient algorithm", Parallel Computing 40, 2014,
///   algorithm 3);
/// - pipelined BiCGStab (S. Cools and W. Vanroose, "The communication-hiding pipelined BiCGStab
///   method for the parallel solution of large unsymmetric linear systems", Parallel Computing 65,
///   2017, algorithm 4); an iteration takes two rounds.
///
/// Their preconditioner is the diagonal D of inverses; vectors that are D times another are not
/// kept. With a multigrid cycle as preconditioner, products outnumber reductions, and the methods
/// are the plain ones: conjugate gradients (Y. Saad, "Iterative methods for sparse linear systems",
/// 2003, algorithm 9.1) and BiCGStab (H. van der Vorst, "Bi-CGSTAB", SIAM J. Sci. Stat. Comput. 13,
/// 1992). What needs no product is a round without one.
#pragma once

#include "physics/particles/patch.h"

namespace lahar {

/// Before the first round: x = 0, or the present solution, and m = x.
template <int Dim>
void begin_solver(Patch<Dim>& patch, const SolverOrder& order, Index first_round,
                  bool from_solution);

/// This patch's part of n = A m; in the first round also of the diagonal.
template <int Dim>
void add_product(Patch<Dim>& patch, const StepContext<Dim>& round);

/// What SolverOrder says, and the sums of this patch: SolverVectors::sums.
template <int Dim>
void advance_solver(Patch<Dim>& patch, const StepContext<Dim>& round);
/// The same for is_of_cycle(): called by advance_solver().
template <int Dim>
void advance_cycle(Patch<Dim>& patch, const StepContext<Dim>& round);

}  // namespace lahar
