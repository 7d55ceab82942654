/// \file Iterative methods whose preconditioner is a multigrid cycle.
#pragma once

#include <span>

#include "runtime/solve/iterative_method.h"

namespace lahar {

/// Conjugate gradients or BiCGStab. A cycle is, on the nodes of the mesh, two steps of Chebyshev's
/// smoothing with the diagonal (M. Adams, M. Brezina, J. Hu and R. Tuminaro, "Parallel multigrid
/// smoothing: polynomial versus Gauss-Seidel", J. Comput. Phys. 188, 2003), what the coarse nodes
/// find (CoarseGrid), and the same smoothing again. It takes five rounds, four of them with a
/// product.
class CycleKrylov : public IterativeMethod {
 public:
  /// `largest_eigenvalue` of D A, or somewhat more. `of_coarse_nodes`: SolverOrder.
  CycleKrylov(bool bicgstab, IterationLimits limits, double largest_eigenvalue,
              const double* of_coarse_nodes);

  bool take(std::span<const double> sums) override;
  /// The norm of what the present cycle began with: residuals in it are not much larger.
  double scale() const { return scale_; }

 private:
  using Product = SolverOrder::Product;
  using Factor = SolverOrder::Factor;
  using Cycle = SolverOrder::Cycle;
  bool begin_cycle(Product after, Cycle of);
  bool take_cycle(std::span<const double> sums);
  bool after_cycle(std::span<const double> sums);
  bool take_residual(std::span<const double> sums);
  bool check();
  bool seems_solved(double rr) const;

  bool bicgstab_;
  double first_ = 0;                                ///< coefficient of the first step of smoothing
  double second_previous_ = 0, second_latest_ = 0;  ///< and those of the second
  int phase_ = -1;  ///< rounds of the cycle that are done; -1 = not in one
  Cycle of_ = Cycle::none;
  double scale_ = 0;
  double checked_ = 0;  ///< least (r, r) of what seemed to be solutions; 0 = nothing did
  int stagnations_ = 0;
  bool has_directions_ = false;
  double gamma_ = 0;  ///< (r, z), or (r*, r), of the last step
};

/// The largest eigenvalue of D A, by the power method: it is a little more than what is found.
class PowerMethod : public IterativeMethod {
 public:
  PowerMethod() : IterativeMethod("power method", {}) { order_.multigrid = true; }
  bool take(std::span<const double> sums) override;
  double largest_eigenvalue() const { return found_; }

 private:
  using Product = SolverOrder::Product;
  int rounds_ = 0;
  double last_ = 0, found_ = 0;
};

}  // namespace lahar
