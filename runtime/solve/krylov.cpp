#include "runtime/solve/krylov.h"

#include <fmt/format.h>

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

double of(std::span<const double> sums, SolverSum which) {
  return sums[static_cast<std::size_t>(which)];
}

}  // namespace

Krylov::Krylov(bool bicgstab, Limits limits) : limits_(limits) {
  order_.bicgstab = bicgstab;
}

bool Krylov::go_on(Product product, Factor factor) {
  order_.product = product;
  order_.factor = factor;
  return true;
}

bool Krylov::fail(const std::string& problem) {
  result_.problem = fmt::format("{}: {} (iteration {}, relative residual {:.3g})",
                                order_.bicgstab ? "BiCGStab" : "conjugate gradients", problem,
                                result_.iterations, result_.residual);
  order_.product = Product::none;
  return false;
}

bool Krylov::check(bool restarts) {
  order_.restarts = restarts;
  has_directions_ = !restarts;
  return go_on(Product::none, Factor::x);
}

bool Krylov::seems_solved(double rr) {
  const double tolerance = limits_.tolerance * limits_.tolerance * reference_;
  seemed_solved_ = rr <= share_of_tolerance * tolerance;
  return seemed_solved_ || result_.iterations >= limits_.most_iterations;
}

/// Where nothing was gained since vectors were computed from x, beginning again would not help.
bool Krylov::breaks_down(const std::string& problem) {
  return steps_ == 0 ? fail(problem) : check(true);
}

bool Krylov::take(std::span<const double> sums) {
  for (const double sum : sums)
    if (!std::isfinite(sum)) return fail("numbers are not finite");
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
    case Product::full_step:
      break;
  }
  if (seems_solved(of(sums, SolverSum::rr)) || steps_ >= most_steps_of_bicgstab) return check(true);
  return next_half_step(sums);
}

bool Krylov::take_residual(std::span<const double> sums) {
  const double rr = of(sums, SolverSum::rr);
  if (const double rows = of(sums, SolverSum::unsolvable); rows > 0)
    return fail(fmt::format("{} unknowns have a right side, but no entry on the diagonal", rows));
  if (!has_reference_) reference_ = of(sums, SolverSum::bb) > 0 ? of(sums, SolverSum::bb) : rr;
  has_reference_ = true;
  result_.residual = rr == 0 ? 0 : std::sqrt(rr / reference_);
  result_.converged = result_.residual <= limits_.tolerance;
  if (result_.converged) {
    order_.product = Product::none;
    return false;
  }
  if (result_.iterations >= limits_.most_iterations) return fail("too many iterations");
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
  ++result_.iterations;
  ++steps_;
  const bool anew = of(sums, SolverSum::rr) < fall_of_residual * largest_ || steps_ >= most_steps;
  return go_on(Product::step, anew ? Factor::x : Factor::Dw);
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
