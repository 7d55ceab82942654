#include "runtime/solve/krylov.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace lahar {

namespace {

/// Share of the tolerance at which recurrences must be, as a square: they are not exact.
constexpr double share_of_tolerance = 0.5;
/// When (r, r) has fallen by this factor, or after so many steps, vectors of conjugate gradients
/// are computed anew: before what recurrences have lost is as large as the residual.
constexpr double fall_of_residual = 1e-9;
constexpr int most_steps = 100;
/// BiCGStab then begins again, which it should not do often.
constexpr int most_steps_of_bicgstab = 400;
/// Where x seemed to be a solution and was not: if (r, r) is not below this part of that of the
/// last time, nothing was gained; so often that is borne.
constexpr double least_progress = 0.25;
constexpr int most_stagnations = 3;

}  // namespace

Krylov::Krylov(bool bicgstab, IterationLimits limits)
    : IterativeMethod(bicgstab ? "BiCGStab" : "conjugate gradients", limits) {
  order_.bicgstab = bicgstab;
}

bool Krylov::check(bool restarts) {
  order_.restarts = restarts;
  has_directions_ = !restarts;
  return go_on(Product::none, Factor::x);
}

bool Krylov::seems_solved(double rr) {
  const double tolerance = limits_.tolerance * limits_.tolerance * reference_;
  seemed_solved_ = rr <= share_of_tolerance * tolerance;
  gives_up_ = limits_.trial > 0 && result_.iterations == limits_.trial &&
              rr > limits_.trial_residual * limits_.trial_residual * reference_;
  return seemed_solved_ || gives_up_ || result_.iterations >= limits_.most_iterations;
}

/// Where nothing was gained since vectors were computed from x, beginning again would not help.
bool Krylov::breaks_down(const std::string& problem) {
  return steps_ == 0 ? fail(problem) : check(true);
}

bool Krylov::take(std::span<const double> sums) {
  if (!are_finite(sums)) return fail("numbers are not finite");
  largest_ = std::max(largest_, of(sums, SolverSum::rr));
  switch (order_.product) {
    case Product::none:  // m = x was made ready
      return go_on(Product::residual, Factor::Dr);
    case Product::residual:
      return take_residual(sums);
    case Product::w:
      if (order_.bicgstab) return first_half_step(sums);
      return has_directions_ ? go_on(Product::s, Factor::Ds) : step(sums);
    case Product::s:
      return go_on(Product::z, Factor::Dw);
    case Product::z:
      return step(sums);
    case Product::step:
      if (order_.factor == Factor::x) {  // to be computed anew, with these directions
        order_.restarts = false;
        return go_on(Product::residual, Factor::Dr);
      }
      return seems_solved(of(sums, SolverSum::rr)) ? check(false) : step(sums);
    case Product::half_step:
      return full_step(sums);
    default:  // full_step
      break;
  }
  if (seems_solved(of(sums, SolverSum::rr)) || steps_ >= most_steps_of_bicgstab) return check(true);
  return next_half_step(sums);
}

bool Krylov::take_residual(std::span<const double> sums) {
  const double rr = of(sums, SolverSum::rr);
  if (!take_true_residual(sums)) return false;
  if (gives_up_) {
    gave_up_ = true;
    return fail("too slow");
  }
  if (seemed_solved_) {
    if (checked_ > 0 && rr > least_progress * checked_ && ++stagnations_ > most_stagnations)
      return fail("the residual does not become smaller");
    checked_ = checked_ > 0 ? std::min(checked_, rr) : rr;
  }
  seemed_solved_ = false;
  largest_ = rr;
  steps_ = 0;
  return go_on(Product::w, has_directions_ ? Factor::p : Factor::Dw);
}

// --- conjugate gradients -------------------------------------------------------------------------

bool Krylov::step(std::span<const double> sums) {
  const double gamma = of(sums, SolverSum::rDr), delta = of(sums, SolverSum::wDr);
  const double beta = has_directions_ ? gamma / gamma_ : 0.0;
  const double pAp = has_directions_ ? delta - beta * gamma / order_.alpha : delta;
  if (!(gamma > 0) || !(pAp > 0)) return breaks_down("the matrix is not positive definite");
  order_.beta = beta;
  order_.alpha = gamma / pAp;
  gamma_ = gamma;
  has_directions_ = true;
  if (result_.iterations < limits_.trial) {
    alphas_.push_back(order_.alpha);
    betas_.push_back(beta);
  }
  ++result_.iterations;
  ++steps_;
  const bool anew = of(sums, SolverSum::rr) < fall_of_residual * largest_ || steps_ >= most_steps;
  return go_on(Product::step, anew ? Factor::x : Factor::Dw);
}

double Krylov::largest_eigenvalue() const {
  const auto n = static_cast<Eigen::Index>(alphas_.size());
  if (n == 0) return 0;
  Eigen::VectorXd diagonal(n), beside(n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const auto i = static_cast<std::size_t>(k);
    diagonal[k] = 1 / alphas_[i] + (k > 0 ? betas_[i] / alphas_[i - 1] : 0.0);
    beside[k] = k + 1 < n ? std::sqrt(betas_[i + 1]) / alphas_[i] : 0.0;
  }
  Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver;
  solver.computeFromTridiagonal(diagonal, beside.head(n - 1), Eigen::EigenvaluesOnly);
  return solver.eigenvalues().maxCoeff();
}

// --- BiCGStab ------------------------------------------------------------------------------------

bool Krylov::first_half_step(std::span<const double> sums) {
  gamma_ = of(sums, SolverSum::r_r);
  const double rw = of(sums, SolverSum::r_w);
  if (rw == 0 || !std::isfinite(gamma_ / rw))
    return breaks_down("the search direction is undefined");
  order_.alpha = gamma_ / rw;
  order_.beta = order_.omega = 0;
  return go_on(Product::half_step, Factor::Dz);
}

bool Krylov::full_step(std::span<const double> sums) {
  const double ww = of(sums, SolverSum::half_ww);
  order_.omega = ww > 0 ? of(sums, SolverSum::half_rw) / ww : 0.0;
  ++result_.iterations;
  ++steps_;
  return go_on(Product::full_step, Factor::Dw);
}

bool Krylov::next_half_step(std::span<const double> sums) {
  const double gamma = of(sums, SolverSum::r_r), omega = order_.omega;
  const double beta = order_.alpha / omega * (gamma / gamma_);
  const double divisor = of(sums, SolverSum::r_w) + beta * of(sums, SolverSum::r_s) -
                         beta * omega * of(sums, SolverSum::r_z);
  const double alpha = gamma / divisor;
  if (!std::isfinite(beta) || !std::isfinite(alpha) || alpha == 0)
    return breaks_down("the search direction is undefined");
  order_.alpha = alpha;
  order_.beta = beta;
  gamma_ = gamma;
  return go_on(Product::half_step, Factor::Dz);
}

}  // namespace lahar
