/// \file The linear systems of steps, by the method that suits their size.
#pragma once

#include "physics/model/model.h"
#include "runtime/solve/global_solve.h"

namespace lahar {

/// Small systems are solved directly, large ones by iterations, unless the scenario says otherwise.
/// Where iterations do not converge, systems of medium size are solved directly for the rest of the
/// step. With several ranks, all functions are collective.
template <int Dim>
class SystemSolver {
 public:
  SystemSolver(const LinearSolver& options, PatchSet<Dim>& patches, RoundOptions rounds);

  void begin_step() { hard_ = false; }
  struct Wishes {
    double tolerance = 0;  ///< that suffices, where the scenario says nothing
    /// The matrix is, with a right side that it can give: for iterations alone.
    bool singular = false;
  };
  /// From Patch::system to its solution; SolveResult::iterations are all that were taken.
  SolveResult solve(bool symmetric, double unknowns, Wishes wishes);
  StageLoop loop() const { return solve_.loop(); }

 private:
  bool begins_with_iterations(double unknowns) const;

  const LinearSolver& options_;
  GlobalSolve<Dim> solve_;
  bool hard_ = false;  ///< iterations did not converge in this step
};

extern template class SystemSolver<2>;
extern template class SystemSolver<3>;

}  // namespace lahar
