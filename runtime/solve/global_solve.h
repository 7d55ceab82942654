/// \file Linear systems of all patches of all ranks (NodalSystem).
#pragma once

#include <memory>
#include <vector>

#include "runtime/solve/coarse_grid.h"
#include "runtime/solve/iterative_method.h"
#include "runtime/solve/rounds.h"
#include "runtime/solve/solve_result.h"

namespace lahar {

enum class SolveMethod {
  automatic,            ///< conjugate gradients for symmetric matrices, else BiCGStab
  conjugate_gradients,  ///< symmetric positive definite matrices only
  bicgstab,
  direct  ///< small systems
};

/// Of iterations. The diagonal is tried first: it suffices where masses outweigh stiffness.
enum class Preconditioner { automatic, diagonal, multigrid };

struct SolveOptions {
  SolveMethod method = SolveMethod::automatic;
  Preconditioner preconditioner = Preconditioner::automatic;
  IterationLimits limits = {};
  bool from_solution = false;  ///< NodalSystem::solution is where iterations begin, else zero
};

/// The stages of a round of iterative solvers, for message_of_sums().
template <int Dim>
std::vector<TimestepStage<Dim>> solver_stages();

/// How often a step takes rounds of a solver (StageLoop::taken).
inline constexpr const char* rounds_of_a_solve = "round after round, until all have the solution";

/// For the patches as they are linked now; with several ranks, all functions are collective.
/// Nothing is allocated between iterations.
template <int Dim>
class GlobalSolve {
 public:
  /// `rounds`: how iterations are executed; RoundOptions::sums is set here.
  GlobalSolve(PatchSet<Dim>& patches, RoundOptions rounds);

  /// From Patch::system to its solution. Whatever goes wrong is in the result, the same on all
  /// ranks; the solution is then the last one that was found.
  SolveResult solve(const SolveOptions& options);
  /// Rounds that all calls have taken.
  Step rounds_taken() const { return rounds_taken_; }
  StageLoop loop() const { return rounds_.loop(); }

 private:
  SolveResult iterate(const SolveOptions& options, bool bicgstab);
  SolveResult iterate_with_cycles(const SolveOptions& options, bool bicgstab, double eigenvalue);
  double scale() const;
  SolveResult run(std::unique_ptr<IterativeMethod> method, bool from_solution);

  PatchSet<Dim>& patches_;
  Communicator ranks_;
  int threads_;
  SolverOrder order_;     ///< that patches read
  bool is_done_ = false;  ///< nothing is left to be done
  std::unique_ptr<IterativeMethod> method_;
  CoarseGrid<Dim> coarse_;
  Rounds<Dim> rounds_;
  Step rounds_taken_ = 0;
};

extern template class GlobalSolve<2>;
extern template class GlobalSolve<3>;

}  // namespace lahar
