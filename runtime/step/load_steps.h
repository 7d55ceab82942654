/// \file How long adaptive implicit steps are: as Newton's method converges.
#pragma once

#include "physics/model/model.h"
#include "runtime/step/implicit_solver.h"

namespace lahar {

/// A step is longer than the one before where Newton's method took at most a share of the
/// iterations that it may take, TimeStep::safety, and shorter where it took more than three
/// quarters of them. In no step are nodes to move by more than a cell. A step that is not solved,
/// or moves them further, is cut, down to the share Watchdog::time_step of the largest one. All
/// ranks have the same numbers, and find the same.
class LoadSteps {
 public:
  LoadSteps(const Analysis& analysis, const Watchdog& watchdog);

  /// A step that may be shorter need not be cut.
  bool accepts(const ImplicitReport& report) const;
  /// Of a step that was `dt` [s].
  double cut(double dt) const;
  /// A step of `dt` [s] is not cut.
  bool is_smallest(double dt) const;

  struct Length {
    double planned;  ///< [s] before output and cuts made it shorter
    double dt;       ///< [s]
  };
  /// Of the step after one that was solved [s], before output makes it shorter. It is not longer
  /// than one that was cut.
  double next(const Length& last, bool was_cut, const ImplicitReport& report) const;

 private:
  double largest_, smallest_;  ///< [s]
  int few_, many_;             ///< iterations
};

}  // namespace lahar
