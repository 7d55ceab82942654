/// \file What an iterative solver does next, from the sums of all patches: the same on all ranks.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "physics/particles/solver_vectors.h"
#include "runtime/solve/iterative_method.h"

namespace lahar {

/// Methods with the diagonal as preconditioner. Decides after each round what patches do in the
/// next one (physics/kernels/solver.h). Recurrences of pipelined methods drift away from what they
/// stand for. Therefore a residual is computed from x itself before a solution is accepted.
/// Conjugate gradients go on with all vectors computed anew from x and p, which costs four rounds
/// (S. Cools, E. F. Yetkin, E. Agullo, L. Giraud and W. Vanroose, "Analyzing the effect of local
/// rounding error propagation on the maximal attainable accuracy of the pipelined conjugate
/// gradient method", SIAM J. Matrix Anal. Appl. 39, 2018); BiCGStab begins again.
class Krylov : public IterativeMethod {
 public:
  Krylov(bool bicgstab, IterationLimits limits);

  bool take(std::span<const double> sums) override;
  /// Of D A, as conjugate gradients have found it: the largest one of Lanczos' matrix (Y. Saad,
  /// "Iterative methods for sparse linear systems", 2003, section 6.7.3). 0 = not known.
  double largest_eigenvalue() const;
  /// IterationLimits::trial has ended it.
  bool gave_up() const { return gave_up_; }

 private:
  using Product = SolverOrder::Product;
  using Factor = SolverOrder::Factor;
  /// Compute the residual from x: with no directions after that, or with the present ones.
  bool check(bool restarts);
  bool take_residual(std::span<const double> sums);
  bool step(std::span<const double> sums);
  bool first_half_step(std::span<const double> sums);
  bool next_half_step(std::span<const double> sums);
  bool full_step(std::span<const double> sums);
  bool seems_solved(double rr);
  bool breaks_down(const std::string& problem);

  double checked_ = 0;          ///< least (r, r) of what seemed to be solutions; 0 = nothing did
  double largest_ = 0;          ///< (r, r) since the last residual from x
  bool seemed_solved_ = false;  ///< why the residual is computed
  int stagnations_ = 0;         ///< solutions in vain that were hardly better than the last
  int steps_ = 0;               ///< since the last residual from x
  bool has_directions_ = false;
  bool gives_up_ = false, gave_up_ = false;
  double gamma_ = 0;                    ///< (r, D r), or (r*, r), of the last step
  std::vector<double> alphas_, betas_;  ///< of conjugate gradients, until vectors are computed anew
};

}  // namespace lahar
