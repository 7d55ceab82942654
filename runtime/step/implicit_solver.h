/// \file The displacement of an implicit step: Newton's method over all patches of all ranks.
#pragma once

#include <string>

#include "runtime/patches/patch_set.h"
#include "runtime/step/schemes.h"

namespace lahar {

/// How a step was solved.
struct ImplicitReport {
  bool converged = false;
  int iterations = 0;         ///< of Newton's method, in all parts
  int parts = 0;              ///< in which the loads were reached
  int linear_iterations = 0;  ///< of the linear solver; 0 = direct
  double residual = 0;        ///< [N] unbalanced force at the end
  std::string problem;        ///< where it did not converge
};

/// Finds Patch::system.increment. The loads are reached in parts where Newton's method fails on all
/// at once: each part is solved from where the one before ended, as far as the history of materials
/// goes the step is one increment.
template <int Dim>
class ImplicitSolver {
 public:
  ImplicitSolver(const Model<Dim>& model, PatchSet<Dim>& patches);
  /// For the step from `time` on; all particles are at rest in their patches. Collective.
  ImplicitReport solve(double time, double dt);

 private:
  struct Norms {
    double residual = 0, forces = 0, change = 0, unknowns = 0;
    bool good = true;  ///< every particle has a stress
  };
  void run(const Stages<Dim>& stages);
  Norms evaluate();
  bool solve_linear();
  bool is_converged(const Norms& norms, double first, bool full) const;
  /// Newton's method from the present increment; false where it fails, with the reason in report_.
  bool iterate();
  void for_each_patch(auto action);

  const Model<Dim>& model_;
  PatchSet<Dim>& patches_;
  ImplicitStages<Dim> stages_;
  StepContext<Dim> context_;
  Step round_ = 0;
  double first_residual_ = 0;
  ImplicitReport report_;
};

}  // namespace lahar
