/// \file The pressure of a projection (physics/kernels/projection.h): one linear system per step,
/// over all patches of all ranks.
#pragma once

#include <array>
#include <string>

#include "runtime/patches/patch_set.h"
#include "runtime/solve/system_solver.h"
#include "runtime/step/schemes.h"

namespace lahar {

/// How the pressure of a step was found.
struct PressureReport {
  bool converged = false;
  int iterations = 0;  ///< direct solves have none
  double assemble_seconds = 0, solve_seconds = 0;
  ProductCost products;
  std::string problem;  ///< where it was not found
};

/// For each graph of a projection: several ranks only.
struct PressureGroups {
  ExchangeGroups system, solve;
  PressureGroups(const Communicator& ranks, int threads)
      : system(ranks, threads), solve(ranks, threads) {}
};

/// Finds ProjectionNodes::change. With several ranks, functions are collective. For the patches as
/// they are linked now.
template <int Dim>
class PressureSolver {
 public:
  /// `rounds`: how graphs are executed; its groups are those of `groups`.
  PressureSolver(const Model<Dim>& model, PatchSet<Dim>& patches, const Communicator& ranks,
                 RoundOptions rounds, const PressureGroups* groups);
  PressureSolver(const PressureSolver&) = delete;
  PressureSolver& operator=(const PressureSolver&) = delete;

  /// For a step of `dt` from `time` on; all particles are in their patches. `first`: of the run.
  PressureReport solve(double time, double dt, bool first);
  /// In the order of their numbers in traces.
  std::vector<StageLoop> loops() const { return {system_.loop(), linear_.loop()}; }

 private:
  static constexpr int n_sums = 4;
  StepContext<Dim> context(Step round) const;
  /// Where the divergence is that was not removed, too; collective.
  std::string describe(const SolveResult& unsolved) const;

  const Model<Dim>& model_;
  PatchSet<Dim>& patches_;
  Communicator ranks_;
  double time_ = 0, dt_ = 0;
  bool first_ = false;
  std::array<double, n_sums> sums_{};
  Step last_round_ = 0;
  Rounds<Dim> system_;
  SystemSolver<Dim> linear_;
};

extern template class PressureSolver<2>;
extern template class PressureSolver<3>;

}  // namespace lahar
