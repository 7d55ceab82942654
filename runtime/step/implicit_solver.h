/// \file The displacement of an implicit step: Newton's method over all patches of all ranks.
#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "physics/kernels/implicit.h"
#include "runtime/patches/patch_set.h"
#include "runtime/solve/system_solver.h"
#include "runtime/step/schemes.h"

namespace lahar {

/// How a step was solved.
struct ImplicitReport {
  bool converged = false;
  int iterations = 0;         ///< of Newton's method, in all parts
  int parts = 0;              ///< in which the loads were reached
  LongestMove longest_move;   ///< of nodes with a hundredth of the heaviest one's mass
  int linear_iterations = 0;  ///< of the linear solver; direct solves have none
  /// [N] of the last part: at its beginning, and after each iteration.
  std::vector<double> residuals;
  double linearize_seconds = 0, linear_seconds = 0;
  ProductCost products;
  std::string problem;    ///< where it did not converge
  double least_part = 1;  ///< of the loads, for which it did not
};

/// What is to be solved; all particles are in their patches.
struct ImplicitStep {
  double time = 0, dt = 0;  ///< [s] when it begins; how long it is
  bool first = false;       ///< particles have no accelerations yet
  bool in_parts = true;     ///< loads may be reached in parts
};

/// For each graph of an implicit step: several ranks only.
struct ImplicitGroups {
  ExchangeGroups begin, linearize, solve;
  ImplicitGroups(const Communicator& ranks, int threads)
      : begin(ranks, threads), linearize(ranks, threads), solve(ranks, threads) {}
};

/// Finds Patch::system.increment (physics/kernels/implicit.h). Where Newton's method fails on all
/// loads at once, they are reached in parts: each is solved from where the one before ended. For
/// the materials the step is one increment all the same. With several ranks, functions are
/// collective. For the patches as they are linked now.
template <int Dim>
class ImplicitSolver {
 public:
  /// `rounds`: how graphs are executed; its groups are those of `groups`.
  ImplicitSolver(const Model<Dim>& model, PatchSet<Dim>& patches, const Communicator& ranks,
                 RoundOptions rounds, const ImplicitGroups* groups);
  ImplicitSolver(const ImplicitSolver&) = delete;
  ImplicitSolver& operator=(const ImplicitSolver&) = delete;

  /// Particles and what nodes have of earlier steps stay as they are: a step that was not solved
  /// can be solved again with another length.
  ImplicitReport solve(const ImplicitStep& step);
  /// Unbalanced forces of the step from `time` on, before it is solved: by how much it is not in
  /// equilibrium without any displacement [N]. All particles are in their patches.
  double unbalanced(double time, double dt);
  /// In the order of their numbers in traces.
  std::vector<StageLoop> loops() const {
    return {begin_.loop(), linearize_.loop(), linear_.loop()};
  }

 private:
  /// Of all patches.
  struct Balance {
    double residual = 0;  ///< [N] unbalanced force
    double forces = 0;    ///< [N] what is in balance
    double change = 0;    ///< [m] of the last iteration
    double unknowns = 0;
    bool solved = true;     ///< every particle has a stress
    bool symmetric = true;  ///< the matrix is
    bool settled = true;    ///< what walls hold has not changed
    bool is_good() const;
  };
  static constexpr int n_sums = 7;
  StepContext<Dim> context(Step round) const;
  void give(int patch, Step round, std::span<double> own) const;
  Balance linearize();
  void find_problem();
  /// "the largest is ... N at node ... (x, y)"; collective.
  std::string worst_node() const;
  bool solve_linear(const Balance& balance, double first);
  /// Collective.
  std::string describe(const SolveResult& unsolved) const;
  double most_residual(const Balance& balance, double first) const;
  bool is_converged(const Balance& balance, double first, bool whole) const;
  /// Newton's method from the present increment; false where it fails, report_ says why.
  bool iterate();
  bool turn_slips();
  void restore();
  LongestMove longest_move() const;
  /// What nodes have at the beginning of a step of `dt` from `time` on.
  void begin_step(double time, double dt);
  void for_each_patch(auto action) const;

  const Model<Dim>& model_;
  PatchSet<Dim>& patches_;
  Communicator ranks_;
  double time_ = 0, dt_ = 0;  ///< [s] of loads; of the step
  std::array<double, n_sums> sums_{};
  Rounds<Dim> begin_, linearize_;
  SystemSolver<Dim> linear_;
  double unloaded_ = 0;  ///< [N] unbalanced force without any displacement, where it is known
  ImplicitReport report_;
};

extern template class ImplicitSolver<2>;
extern template class ImplicitSolver<3>;

}  // namespace lahar
