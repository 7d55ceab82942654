/// \file A model made ready to run, and what is said about it: for `lahar run` and `lahar check`.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "io/run/body_shapes.h"
#include "runtime/program/run_arguments.h"
#include "runtime/step/restart.h"
#include "runtime/terminal/console.h"

namespace lahar {

const char* scheme_name(Scheme scheme);

/// What is said about a model, kept when the simulation takes the model itself.
struct ModelOutline {
  int dim = 0;
  std::string title;
  std::string_view mesh;  ///< its kind, in words
  std::vector<Material> materials;
  Analysis analysis;
  OutputPlan output;
  std::vector<std::uint16_t> new_materials = {};  ///< of StageChanges, in their order
  std::vector<double> removal_times = {};         ///< [s] of StageChanges; 0 = at once
  double curved_cell = 0;               ///< [m] mean edge of cells that are of second order; else 0
  std::vector<std::string> sides = {};  ///< of the mesh that hold free rigid bodies
};

/// Those of the scenario: bodies in contact and fields of materials have several entries of one.
std::size_t count_materials(std::span<const Material> materials);

ModelOutline outline_of(const AnyModel& model);

/// Surfaces of rigid bodies within the mesh.
std::vector<BodyShape> shapes_of_bodies(const AnyModel& model);

void describe(Console& console, const ModelOutline& model, const SimulationInfo& info,
              int ranks = 1);

/// Scenario::loads, the first of them; nothing where there are none.
void describe_loads(Console& console, std::span<const std::string> loads);

/// How many frames to expect and how large, with the first and the last; an adaptive step is taken
/// not to change.
void describe_frames(Console& console, const OutputPlan& plan, const Analysis& analysis,
                     const SimulationInfo& info);

/// How long a run takes with the threads that there are [s]: what particles cost in a step on usual
/// machines, times both. Infinite where nobody can tell, as of steps with solves.
double estimated_seconds(const ModelOutline& model, const SimulationInfo& info);

/// Say it, with a warning where it is more than a day.
void describe_duration(Console& console, const ModelOutline& model, const SimulationInfo& info);

/// The partition over ranks that a run would begin with; `particles` of each patch.
void describe_ranks(Console& console, const PatchGraph& graph, std::span<const Index> particles,
                    int ranks, Partitioner partitioner);

/// What the stage did to particles when it began, in sentences; empty where it did nothing.
std::vector<std::string> describe_changes(const ChangedParticles& changed,
                                          std::span<const Material> materials,
                                          std::span<const std::uint16_t> given,
                                          std::span<const double> removal_times);

/// The simulation takes the model of the scenario, and begins with a state if there is one. What
/// only it can find out about the input gets its place in the file.
Simulation make_simulation(Scenario& scenario, const ExecutionOptions& options,
                           Observer observer = {}, const SimulationState* state = nullptr);

}  // namespace lahar
