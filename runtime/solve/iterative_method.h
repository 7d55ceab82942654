/// \file Iterations towards the solution of a linear system, as far as all patches do them alike.
#pragma once

#include <span>
#include <string>
#include <utility>

#include "physics/particles/solver_vectors.h"
#include "runtime/solve/solve_result.h"

namespace lahar {

struct IterationLimits {
  double tolerance = 1e-10;  ///< of SolveResult::residual
  int most_iterations = 10000;
  /// A method gives up if its residual is larger than `trial_residual` after so many iterations.
  int trial = 0;  ///< 0 = it does not
  double trial_residual = 0;
};

/// What is done next, from the sums of all patches: the same on all ranks.
class IterativeMethod {
 public:
  IterativeMethod(std::string name, IterationLimits limits)
      : limits_(limits), name_(std::move(name)) {}
  virtual ~IterativeMethod() = default;

  /// What patches do in the next round.
  const SolverOrder& order() const { return order_; }
  /// The sums after a round that followed order(). False = nothing is left to be done.
  virtual bool take(std::span<const double> sums) = 0;
  const SolveResult& result() const { return result_; }

 protected:
  static double of(std::span<const double> sums, SolverSum which) {
    return sums[static_cast<std::size_t>(which)];
  }
  bool go_on(SolverOrder::Product product, SolverOrder::Factor factor) {
    order_.product = product;
    order_.factor = factor;
    return true;
  }
  bool fail(const std::string& problem);
  bool are_finite(std::span<const double> sums) const;
  /// After Product::residual: SolveResult::residual, and whether that is a solution. Fails where it
  /// cannot be one, or where there may be no more iterations. True = go on.
  bool take_true_residual(std::span<const double> sums);

  IterationLimits limits_;
  SolverOrder order_;
  SolveResult result_;
  double reference_ = 0;  ///< the square of |b|

 private:
  std::string name_;
  bool has_reference_ = false;
};

}  // namespace lahar
