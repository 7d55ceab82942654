/// \file What steps particles allow.
#pragma once

#include <string>
#include <vector>

#include "runtime/patches/patch_set.h"
#include "runtime/step/time_control.h"

namespace lahar {

template <int Dim>
class StepLimits {
 public:
  /// Both must outlive it.
  StepLimits(const Model<Dim>& model, const PatchSet<Dim>& patches);

  /// [s] that this rank's patches found in the last step.
  double of_last_step() const;
  /// [s] of all ranks at present; `where` receives a description of the limiting particle.
  /// Collective.
  double present(const Communicator& ranks, std::string* where = nullptr) const;
  /// For each generator. Collective.
  std::vector<InjectionLimit> of_injections(const Communicator& ranks) const;

  /// With a fixed step, a patch that has done `step` of `nsteps`: why the run cannot go on; empty
  /// if it can.
  std::string problem(const Patch<Dim>& patch, Step step, Step nsteps) const;

 private:
  bool may_be_unstable(const Patch<Dim>& patch, Step step, Step nsteps) const;

  const Model<Dim>& model_;
  const PatchSet<Dim>& patches_;
  double wave_speed_bound_ = 0;  ///< [m/s] of all materials
};

}  // namespace lahar
