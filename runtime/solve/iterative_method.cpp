#include "runtime/solve/iterative_method.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace lahar {

bool IterativeMethod::fail(const std::string& problem) {
  result_.problem = name_ + ": " + problem;
  order_.product = SolverOrder::Product::none;
  order_.cycle = SolverOrder::Cycle::none;
  return false;
}

bool IterativeMethod::are_finite(std::span<const double> sums) const {
  return std::all_of(sums.begin(), sums.end(), [](double sum) { return std::isfinite(sum); });
}

bool IterativeMethod::take_true_residual(std::span<const double> sums) {
  const double rr = of(sums, SolverSum::rr);
  if (const double rows = of(sums, SolverSum::unsolvable); rows > 0)
    return fail(fmt::format("{} unknowns have a right side, but no entry on the diagonal", rows));
  if (!has_reference_) reference_ = of(sums, SolverSum::bb) > 0 ? of(sums, SolverSum::bb) : rr;
  has_reference_ = true;
  result_.residual = rr == 0 ? 0 : std::sqrt(rr / reference_);
  result_.converged = result_.residual <= limits_.tolerance;
  if (result_.converged) {
    order_.product = SolverOrder::Product::none;
    return false;
  }
  if (result_.iterations >= limits_.most_iterations) return fail("too many iterations");
  return true;
}

}  // namespace lahar
