/// \file What an iterative solver does next, from the sums of all patches: the same on all ranks.
#pragma once

#include <span>
#include <string>

#include "physics/particles/solver_vectors.h"
#include "runtime/solve/solve_result.h"

namespace lahar {

/// Decides after each round what patches do in the next one (physics/kernels/solver.h). Recurrences
/// of pipelined methods drift away from what they stand for. Therefore a residual is computed from
/// x itself before a solution is accepted. Conjugate gradients go on with all vectors computed anew
/// from x and p, which costs four rounds (S. Cools, E. F. Yetkin, E. Agullo, L. Giraud and
/// W. Vanroose, "Analyzing the effect of local rounding error propagation on the maximal attainable
/// accuracy of the pipelined conjugate gradient method", SIAM J. Matrix Anal. Appl. 39, 2018);
/// BiCGStab begins again.
class Krylov {
 public:
  struct Limits {
    double tolerance = 1e-10;  ///< of SolveResult::residual
    int most_iterations = 10000;
  };
  Krylov(bool bicgstab, Limits limits);

  /// What patches do in the next round.
  const SolverOrder& order() const { return order_; }
  /// The sums after a round that followed order(). False = nothing is left to be done.
  bool take(std::span<const double> sums);
  const SolveResult& result() const { return result_; }

 private:
  using Product = SolverOrder::Product;
  using Factor = SolverOrder::Factor;
  bool go_on(Product product, Factor factor);
  bool fail(const std::string& problem);
  /// Compute the residual from x: with no directions after that, or with the present ones.
  bool check(bool restarts);
  bool take_residual(std::span<const double> sums);
  bool step(std::span<const double> sums);
  bool first_half_step(std::span<const double> sums);
  bool next_half_step(std::span<const double> sums);
  bool full_step(std::span<const double> sums);
  bool seems_solved(double rr);
  bool breaks_down(const std::string& problem);

  Limits limits_;
  SolverOrder order_;
  SolveResult result_;
  bool has_reference_ = false;
  double reference_ = 0;        ///< the square of |b|
  double checked_ = 0;          ///< least (r, r) of what seemed to be solutions; 0 = nothing did
  double largest_ = 0;          ///< (r, r) since the last residual from x
  bool seemed_solved_ = false;  ///< why the residual is computed
  int stagnations_ = 0;         ///< solutions in vain that were hardly better than the last
  int steps_ = 0;               ///< since the last residual from x
  bool has_directions_ = false;
  double gamma_ = 0;  ///< (r, D r), or (r*, r), of the last step
};

}  // namespace lahar
