#include "runtime/solve/system_solver.h"

#include <algorithm>
#include <utility>

namespace lahar {

namespace {

/// Unknowns of systems that are solved directly, and of those for which it is tried where
/// iterations do not converge.
template <int Dim>
constexpr double small_system = Dim == 2 ? 2'000 : 1'000;
template <int Dim>
constexpr double medium_system = Dim == 2 ? 100'000 : 20'000;
constexpr double direct_tolerance = 1e-6;
constexpr double least_tolerance = 1e-9;
/// So many iterations take as long as a direct solve of a medium system, roughly.
template <int Dim>
constexpr int fair_iterations = Dim == 2 ? 500 : 2000;

}  // namespace

template <int Dim>
SystemSolver<Dim>::SystemSolver(const LinearSolver& options, PatchSet<Dim>& patches,
                                RoundOptions rounds)
    : options_(options), solve_(patches, std::move(rounds)) {}

template <int Dim>
bool SystemSolver<Dim>::begins_with_iterations(double unknowns) const {
  if (options_.method == LinearSolver::Method::automatic) return unknowns > small_system<Dim>;
  return options_.method == LinearSolver::Method::iterative;
}

template <int Dim>
SolveResult SystemSolver<Dim>::solve(bool symmetric, double unknowns, Wishes wishes) {
  const bool singular = wishes.singular;
  SolveOptions direct{.method = SolveMethod::direct};
  direct.limits.tolerance = direct_tolerance;
  if (!singular && (hard_ || !begins_with_iterations(unknowns))) return solve_.solve(direct);

  const bool may_be_direct = !singular && options_.method == LinearSolver::Method::automatic &&
                             unknowns <= medium_system<Dim>;
  SolveOptions iterative;
  iterative.method = symmetric ? SolveMethod::conjugate_gradients : SolveMethod::bicgstab;
  iterative.limits.tolerance =
      options_.tolerance > 0 ? options_.tolerance : std::max(least_tolerance, wishes.tolerance);
  if (may_be_direct) iterative.limits.most_iterations = fair_iterations<Dim>;
  if (options_.most_iterations > 0) iterative.limits.most_iterations = options_.most_iterations;
  SolveResult result = solve_.solve(iterative);
  if (result.converged || !may_be_direct) return result;
  hard_ = true;
  const int iterations = result.iterations;
  const ProductCost products = result.products;
  result = solve_.solve(direct);
  result.iterations = iterations;
  result.products = products;
  return result;
}

template class SystemSolver<2>;
template class SystemSolver<3>;

}  // namespace lahar
