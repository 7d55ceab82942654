/// \file The factor of safety of a body at rest: by how much its strength may fall until it has no
/// equilibrium any more (strength reduction; Zienkiewicz, Humpheson and Lewis 1975). Strength is
/// that of materials and that of what they touch (reduce_strength()).
///
/// A trial divides the strength and lets the body move in explicit steps with local damping until
/// it is at rest again, or has failed (FailureBounds). It has no system to solve, so it works where
/// soil has no stiffness: where it yields, and where it has no stress.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "io/run/checkpoint.h"
#include "io/run/safety_record.h"
#include "physics/model/model_strength.h"
#include "runtime/program/failure_bounds.h"
#include "runtime/program/run_arguments.h"

namespace lahar {

/// Doubles the factor until a trial fails, then halves the bracket. Goes on from `known` trials, as
/// if it had made them.
SafetyResult find_factor(const SafetyBounds& bounds,
                         const std::function<SafetyTrial(double factor)>& trial,
                         SafetyResult known = {});

/// About how many trials are still to be made.
double trials_left(const SafetyBounds& bounds, const SafetyResult& known);

/// A signal, or RunArguments::on_step, has ended the search.
struct SafetyStopped {};

/// The trials of a scenario, each of which begins with the state at the end of its own run. All
/// ranks call its functions together.
class SafetyTrials {
 public:
  using Read = std::function<Scenario()>;  ///< the scenario, or its last stage

  SafetyTrials(const RunArguments& arguments, Read read,
               std::unique_ptr<CheckpointReader> equilibrium);
  /// Throws SafetyStopped.
  SafetyTrial operator()(double factor) const;
  /// A trial again, as a run with a folder of its own, whose frame shows the body at its end.
  /// Returns the exit status.
  int write_run(const SafetyTrial& trial, const std::filesystem::path& folder) const;

 private:
  Scenario scenario_of(double factor) const;
  SafetyTrial made(double factor) const;
  /// Whether a body that does not come to rest moves hardly more than with full strength.
  bool moves_as_whole(const SafetyTrial& trial) const;

  const RunArguments& arguments_;  ///< on_step: share is that of the time that a trial has at most
  Read read_;
  std::unique_ptr<CheckpointReader> equilibrium_;
  mutable std::optional<SafetyTrial> whole_;  ///< with full strength, when it was needed
};

/// Throws InputError where a scenario is not one whose factor of safety can be looked for. True:
/// its run must come to rest by itself (Analysis::until); else each step is an equilibrium.
/// Collective.
bool check_safety(const Scenario& scenario, const Communicator& ranks);

/// What trials divide. Each rank knows walls of its own nodes alone: collective.
StrengthOfModel strength_of(const AnyModel& model, const Communicator& ranks);

/// The same in words, with the names of materials and rigid bodies.
std::string describe_strength(const AnyModel& model, const StrengthOfModel& has);

}  // namespace lahar
