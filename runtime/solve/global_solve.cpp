#include "runtime/solve/global_solve.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "physics/kernels/solver.h"
#include "runtime/base/parallel.h"
#include "runtime/solve/direct_solve.h"

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
               .take =
                   [this](Step, std::span<const double> sums) {
                     if (is_done_) return false;  // the round that had begun
                     is_done_ = !krylov_->take(sums);
                     order_ = krylov_->order();
                     return !is_done_;
                   }}) {}

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
SolveResult GlobalSolve<Dim>::iterate(const SolveOptions& options, bool bicgstab) {
  krylov_ = std::make_unique<Krylov>(bicgstab, options.limits);
  order_ = krylov_->order();
  is_done_ = false;
  parallel_for(threads_, patches_.size(), [&](int p) {
    begin_solver(patches_[p], order_, rounds_.next_round(), options.from_solution);
  });
  rounds_taken_ += rounds_.run(std::numeric_limits<int>::max());
  return krylov_->result();
}

template std::vector<TimestepStage<2>> solver_stages<2>();
template std::vector<TimestepStage<3>> solver_stages<3>();
template class GlobalSolve<2>;
template class GlobalSolve<3>;

}  // namespace lahar
