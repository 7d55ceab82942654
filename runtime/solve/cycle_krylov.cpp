#include "runtime/solve/cycle_krylov.h"

#include <algorithm>
#include <cmath>

namespace lahar {

namespace {

/// Smoothing acts on eigenvalues of D A from this share of the largest one; the coarse nodes know
/// the vectors of those below.
constexpr double least_smoothed = 0.1;
/// What is found of the largest eigenvalue is less than it is.
constexpr double margin = 1.1;
constexpr double margin_of_power_method = 1.2;
constexpr int rounds_of_power_method = 16;
constexpr double least_progress = 0.25;
constexpr int most_stagnations = 3;

}  // namespace

CycleKrylov::CycleKrylov(bool bicgstab, IterationLimits limits, double largest_eigenvalue,
                         const double* of_coarse_nodes)
    : IterativeMethod(bicgstab ? "BiCGStab with multigrid" : "conjugate gradients with multigrid",
                      limits),
      bicgstab_(bicgstab) {
  result_.multigrid = true;
  order_.multigrid = true;
  order_.factor = Factor::none;
  order_.of_coarse_nodes = of_coarse_nodes;
  const double most = margin * largest_eigenvalue, least = least_smoothed * most;
  const double middle = 0.5 * (most + least), half = 0.5 * (most - least);
  const double sigma = middle / half, rho = 1 / (2 * sigma - 1 / sigma);
  first_ = 1 / middle;
  second_previous_ = rho / sigma;
  second_latest_ = 2 * rho / half;
}

bool CycleKrylov::check() {
  phase_ = -1;
  order_.cycle = Cycle::none;
  return go_on(Product::none, Factor::x);
}

bool CycleKrylov::seems_solved(double rr) const {
  return rr <= limits_.tolerance * limits_.tolerance * reference_ ||
         result_.iterations >= limits_.most_iterations;
}

bool CycleKrylov::begin_cycle(Product after, Cycle of) {
  phase_ = 0;
  order_.cycle = of_ = of;
  order_.latest = first_;
  return go_on(after, Factor::d);
}

bool CycleKrylov::take(std::span<const double> sums) {
  if (!are_finite(sums)) return fail("numbers are not finite");
  if (phase_ >= 0) return take_cycle(sums);
  switch (order_.product) {
    case Product::none:  // m = x was made ready
      return go_on(Product::residual, Factor::none);
    case Product::residual:
      return take_residual(sums);
    case Product::direction: {
      const double ps = of(sums, SolverSum::ps);
      if (!(ps > 0)) return fail("the matrix is not positive definite");
      order_.alpha = gamma_ / ps;
      ++result_.iterations;
      return begin_cycle(Product::descend, Cycle::of_r);
    }
    case Product::first_product:
      order_.alpha = gamma_ / of(sums, SolverSum::r_product);
      if (!std::isfinite(order_.alpha)) return check();
      return begin_cycle(Product::first_half, Cycle::of_r);
    case Product::second_product: {
      const double ww = of(sums, SolverSum::half_ww);
      order_.omega = ww > 0 ? of(sums, SolverSum::half_rw) / ww : 0.0;
      ++result_.iterations;
      return go_on(Product::second_half, Factor::none);
    }
    default:
      break;
  }
  const double gamma = of(sums, SolverSum::r_r);  // after the second half
  order_.beta = order_.alpha / order_.omega * (gamma / gamma_);
  if (seems_solved(of(sums, SolverSum::rr)) || !std::isfinite(order_.beta)) return check();
  gamma_ = gamma;
  return begin_cycle(Product::bi_direction, Cycle::of_p);
}

bool CycleKrylov::take_residual(std::span<const double> sums) {
  const double rr = of(sums, SolverSum::rr);
  if (!take_true_residual(sums)) return false;
  if (checked_ > 0 && rr > least_progress * checked_ && ++stagnations_ > most_stagnations)
    return fail("the residual does not become smaller");
  checked_ = checked_ > 0 ? std::min(checked_, rr) : rr;
  has_directions_ = false;
  if (!bicgstab_) return begin_cycle(Product::none, Cycle::of_r);
  gamma_ = rr;
  order_.beta = order_.omega = 0;
  return begin_cycle(Product::bi_direction, Cycle::of_p);
}

bool CycleKrylov::take_cycle(std::span<const double> sums) {
  order_.cycle = Cycle::none;
  switch (phase_++) {
    case 0:
      scale_ = std::sqrt(of(sums, of_ == Cycle::of_p ? SolverSum::pp : SolverSum::rr));
      if (of_ == Cycle::of_r && seems_solved(of(sums, SolverSum::rr))) return check();
      order_.previous = second_previous_;
      order_.latest = second_latest_;
      return go_on(Product::smooth, Factor::d);
    case 1:
      return go_on(Product::restrict, Factor::none);
    case 2:
      return go_on(Product::prolong, Factor::d);
    case 3:
      order_.previous = 0;
      order_.latest = first_;
      return go_on(Product::smooth, Factor::d);
    case 4:
      order_.previous = second_previous_;
      order_.latest = second_latest_;
      return go_on(Product::smooth, Factor::z);
    default:
      phase_ = -1;
      return after_cycle(sums);
  }
}

bool CycleKrylov::after_cycle(std::span<const double> sums) {
  if (bicgstab_)
    return go_on(of_ == Cycle::of_p ? Product::first_product : Product::second_product,
                 Factor::none);
  const double gamma = of(sums, SolverSum::rz);
  if (!(gamma > 0)) return fail("the preconditioner is not positive definite");
  order_.beta = has_directions_ ? gamma / gamma_ : 0.0;
  gamma_ = gamma;
  has_directions_ = true;
  return go_on(Product::direction, Factor::none);
}

bool PowerMethod::take(std::span<const double> sums) {
  if (!are_finite(sums)) return fail("numbers are not finite");
  if (order_.product == Product::residual) return go_on(Product::w, SolverOrder::Factor::Dw);
  const double now = of(sums, SolverSum::wDr);
  if (2 * rounds_ >= rounds_of_power_method && last_ != 0)  // the largest: a sum may cancel
    found_ = std::max(found_, margin_of_power_method * std::abs(now / last_));
  last_ = now;
  if (++rounds_ < rounds_of_power_method) return go_on(Product::w, SolverOrder::Factor::Dw);
  order_.product = Product::none;
  return false;
}

}  // namespace lahar
