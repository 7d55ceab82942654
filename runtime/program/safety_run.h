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
#include <vector>

#include "io/run/checkpoint.h"
#include "physics/model/model_strength.h"
#include "runtime/program/failure_bounds.h"
#include "runtime/program/run_arguments.h"

namespace lahar {

/// What bounds the search.
struct SafetyBounds {
  double most = 16;         ///< a factor beyond which nobody asks
  double tolerance = 0.01;  ///< of the bracket, as a share of the factor
};

/// A factor by which strength was divided, and what came of it.
struct SafetyTrial {
  enum class End {
    rest,      ///< the body has an equilibrium
    settles,   ///< still moves after FailureBounds::time, but as bodies do that settle
    moved,     ///< beyond FailureBounds::displacement
    restless,  ///< still moves after FailureBounds::time
    broke      ///< a step could not be taken
  };
  double factor;
  End end = End::rest;
  Index steps = 0;
  double displacement = 0;   ///< [m] largest of a particle, from full strength on
  std::string problem = {};  ///< why a step could not be taken
  bool stable() const { return end == End::rest || end == End::settles; }
};
const char* name_of(SafetyTrial::End end);

struct SafetyResult {
  double stable = 1;            ///< largest factor with an equilibrium
  std::optional<double> fails;  ///< least without one; nothing: none up to SafetyBounds::most
  std::vector<SafetyTrial> trials;
  /// The middle of the bracket.
  double factor() const { return fails ? 0.5 * (stable + *fails) : stable; }
  /// That of the least factor that fails; null where there is none.
  const SafetyTrial* failure() const;
};

/// Doubles the factor until a trial fails, then halves the bracket.
SafetyResult find_factor(const SafetyBounds& bounds,
                         const std::function<SafetyTrial(double factor)>& trial);

/// A signal has ended the search.
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
  void write_run(const SafetyTrial& trial, const std::filesystem::path& folder) const;

 private:
  Scenario scenario_of(double factor) const;
  SafetyTrial made(double factor) const;
  /// Whether a body that does not come to rest moves hardly more than with full strength.
  bool moves_as_whole(const SafetyTrial& trial) const;

  const RunArguments& arguments_;
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
