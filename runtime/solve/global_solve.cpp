#include "runtime/solve/global_solve.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "physics/kernels/solver.h"
#include "runtime/base/parallel.h"
#include "runtime/solve/cycle_krylov.h"
#include "runtime/solve/direct_solve.h"
#include "runtime/solve/krylov.h"

namespace lahar {

template <int Dim>
std::vector<TimestepStage<Dim>> solver_stages() {
  const TimestepStage<Dim> multiply{.stage = {.name = "multiply"}, .begin = add_product<Dim>};
  const TimestepStage<Dim> advance{
      .stage = {.name = "advance", .exchange = "product", .gives_dt = true, .needs_dt = true},
      .takes = {NodeSum::product, NodeSum::diagonal},
      .begin = advance_solver<Dim>};
  return {multiply, advance};
}

namespace {

/// Iterations with the diagonal after which it is known how large eigenvalues are, and whether the
/// diagonal suffices: where it has reached this power of the tolerance, the whole takes some three
/// times as many.
constexpr int trial_iterations = 12;
constexpr double share_of_trial = 0.3;
/// More iterations with multigrid are in vain, as a few dozen are usual.
constexpr int most_cycles = 100;

constexpr std::size_t multiply_stage = 0;

/// ProductCost::bytes of one.
template <int Dim>
double bytes_of_product(const PatchSet<Dim>& patches) {
  constexpr double node = 2 * node_width * sizeof(double) + sizeof(std::size_t);
  double bytes = 0;
  for (int p = 0; p < patches.size(); ++p) {
    const NodalSystem<Dim>& system = patches[p].system;
    const double block = system.width() * system.width() * sizeof(double) + sizeof(Local);
    bytes += static_cast<double>(system.column.size()) * block;
    for (const NodeRange& range : patches[p].active_nodes)
      bytes += (range.end - range.begin) * node;
  }
  return bytes;
}

RoundOptions with_sums(RoundOptions options) {
  options.sums = n_solver_sums;
  return options;
}

int threads_of(const ExecutorOptions& options) {
  const bool parallel =
      options.mode == ExecutionMode::flow_graph || options.mode == ExecutionMode::bulk;
  return parallel ? options.threads : 1;
}

}  // namespace

template <int Dim>
GlobalSolve<Dim>::GlobalSolve(PatchSet<Dim>& patches, RoundOptions rounds)
    : patches_(patches),
      ranks_(rounds.groups ? rounds.groups->patches : Communicator{}),
      threads_(threads_of(rounds.executor)),
      coarse_(patches, ranks_, threads_),
      rounds_(patches, solver_stages<Dim>(), with_sums(std::move(rounds)),
              {.context =
                   [](Step round) {
                     StepContext<Dim> context;
                     context.step = round;
                     return context;
                   },
               .give =
                   [this](int p, Step, std::span<double> own) {
                     std::copy_n(patches_[p].system.solver.sums.begin(), own.size(), own.begin());
                   },
               .give_integers = [this]() -> std::span<const Index> {
                 if (order_.product != SolverOrder::Product::restrict) return {};
                 return coarse_.give(scale());
               },
               .take_integers =
                   [this](std::span<const Index> sums) {
                     if (!sums.empty()) coarse_.take(sums, scale());
                   },
               .take =
                   [this](Step, std::span<const double> sums) {
                     if (is_done_) return false;  // the round that had begun
                     is_done_ = !method_->take(sums);
                     order_ = method_->order();
                     return !is_done_;
                   }}) {}

/// Of the cycle of this round.
template <int Dim>
double GlobalSolve<Dim>::scale() const {
  return static_cast<const CycleKrylov&>(*method_).scale();
}

template <int Dim>
SolveResult GlobalSolve<Dim>::solve(const SolveOptions& options) {
  bool symmetric = true;
  for (int p = 0; p < patches_.size(); ++p) symmetric &= patches_[p].system.symmetric;
  symmetric = !ranks_.any(!symmetric);
  switch (options.method) {
    case SolveMethod::direct:
      return solve_directly(patches_, ranks_, symmetric, options.limits.tolerance);
    case SolveMethod::conjugate_gradients:
      return iterate(options, false);
    case SolveMethod::bicgstab:
      return iterate(options, true);
    case SolveMethod::automatic:
      break;
  }
  return iterate(options, !symmetric);
}

template <int Dim>
SolveResult GlobalSolve<Dim>::run(std::unique_ptr<IterativeMethod> method, bool from_solution) {
  method_ = std::move(method);
  order_ = method_->order();
  is_done_ = false;
  parallel_for(threads_, patches_.size(), [&](int p) {
    begin_solver(patches_[p], order_, rounds_.next_round(), from_solution);
  });
  const double before = rounds_.stage_seconds(multiply_stage);
  const Step taken = rounds_.run(std::numeric_limits<int>::max());
  rounds_taken_ += taken;
  SolveResult result = method_->result();
  if (order_.multigrid) return result;  // not all of its rounds have a product
  result.products = {.count = taken,
                     .seconds = rounds_.stage_seconds(multiply_stage) - before,
                     .bytes = static_cast<double>(taken) * bytes_of_product(patches_)};
  return result;
}

template <int Dim>
SolveResult GlobalSolve<Dim>::iterate(const SolveOptions& options, bool bicgstab) {
  IterationLimits limits = options.limits;
  if (options.preconditioner != Preconditioner::diagonal) limits.trial = trial_iterations;
  if (options.preconditioner == Preconditioner::automatic)
    limits.trial_residual = std::pow(limits.tolerance, share_of_trial);
  auto krylov = std::make_unique<Krylov>(bicgstab, limits);
  const Krylov& diagonal = *krylov;
  const SolveResult tried = run(std::move(krylov), options.from_solution);
  if (!diagonal.gave_up()) return tried;
  SolveOptions rest = options;
  rest.limits.most_iterations -= tried.iterations;
  SolveResult result = iterate_with_cycles(rest, bicgstab, diagonal.largest_eigenvalue());
  result.iterations += tried.iterations;
  result.products += tried.products;
  return result;
}

template <int Dim>
SolveResult GlobalSolve<Dim>::iterate_with_cycles(const SolveOptions& options, bool bicgstab,
                                                  double eigenvalue) {
  if (bicgstab) {
    auto power = std::make_unique<PowerMethod>();
    const PowerMethod& found = *power;
    run(std::move(power), true);
    eigenvalue = found.largest_eigenvalue();
  }
  bool is_scalar = false;
  for (int p = 0; p < patches_.size(); ++p) is_scalar |= patches_[p].system.is_scalar;
  SolveResult result;
  if (coarse_.set_up(ranks_.any(is_scalar)) && eigenvalue > 0) {
    IterationLimits limits = options.limits;
    limits.most_iterations = std::min(limits.most_iterations, most_cycles);
    result =
        run(std::make_unique<CycleKrylov>(bicgstab, limits, eigenvalue, coarse_.solution()), true);
    if (result.converged || result.iterations >= options.limits.most_iterations) return result;
  }
  // The matrix is not what cycles are made for: all over again, as they may have led astray.
  IterationLimits rest = options.limits;
  rest.most_iterations -= result.iterations;
  SolveResult last = run(std::make_unique<Krylov>(bicgstab, rest), false);
  last.iterations += result.iterations;
  return last;
}

template std::vector<TimestepStage<2>> solver_stages<2>();
template std::vector<TimestepStage<3>> solver_stages<3>();
template class GlobalSolve<2>;
template class GlobalSolve<3>;

}  // namespace lahar
