/// \file The factor of safety of a body at rest: by how much its strength may fall until it has no
/// equilibrium any more (strength reduction; Zienkiewicz, Humpheson and Lewis 1975).
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <vector>

#include "io/frames/frame.h"
#include "io/run/checkpoint.h"
#include "physics/materials/material.h"
#include "runtime/program/run_arguments.h"
#include "runtime/terminal/console.h"

namespace lahar {

/// What bounds the search.
struct SafetyBounds {
  double most = 16;         ///< a factor beyond which nobody asks
  double tolerance = 0.01;  ///< of the bracket, as a share of the factor
};

/// A factor by which strength was divided.
struct SafetyTrial {
  double factor;
  bool stable;
  Index iterations = 0;      ///< of Newton's method
  double displacement = -1;  ///< [m] largest of a particle, from full strength on; -1 = no end
};

/// A displacement that means that a body has failed, though it found an equilibrium elsewhere:
/// rho g L^2 / (2.5 G), about the settlement of a layer as thick as the body by its weight.
/// L is its volume over its area across gravity, G the least shear modulus.
double failure_displacement(const Frame& frame, const std::vector<Material>& materials,
                            const std::vector<double>& gravity);

struct SafetyResult {
  double stable = 1;            ///< largest factor with an equilibrium
  std::optional<double> fails;  ///< least without one; nothing: none up to SafetyBounds::most
  std::vector<SafetyTrial> trials;
  /// The middle of the bracket.
  double factor() const { return fails ? 0.5 * (stable + *fails) : stable; }
};

/// Doubles the factor until a trial fails, then halves the bracket.
SafetyResult find_factor(const SafetyBounds& bounds,
                         const std::function<SafetyTrial(double factor)>& trial);

/// The trials of a scenario, each of which begins with the state at the end of its own run.
class SafetyTrials {
 public:
  using Read = std::function<Scenario()>;  ///< the scenario, or its last stage

  SafetyTrials(const RunArguments& arguments, Read read,
               std::unique_ptr<CheckpointReader> equilibrium);
  SafetyTrial operator()(double factor) const;
  /// The trial as a run with frames, in a folder of its own.
  void write_run(double factor, const std::filesystem::path& folder) const;

 private:
  Scenario scenario_of(double factor) const;

  const RunArguments& arguments_;
  Read read_;
  std::unique_ptr<CheckpointReader> equilibrium_;
};

/// Throws InputError where a scenario is not one whose factor of safety can be looked for.
void check_safety(const Scenario& scenario);

}  // namespace lahar
