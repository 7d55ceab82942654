/// \file A model made ready to run, and what is said about it: for `lahar run` and `lahar check`.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

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
};

ModelOutline outline_of(const AnyModel& model);

void describe(Console& console, const ModelOutline& model, const SimulationInfo& info,
              int ranks = 1);

/// How many frames to expect and how large, with the first and the last; an adaptive step is taken
/// not to change.
void describe_frames(Console& console, const OutputPlan& plan, const Analysis& analysis,
                     const SimulationInfo& info);

/// The partition over ranks that a run would begin with; `particles` of each patch.
void describe_ranks(Console& console, const PatchGraph& graph, std::span<const Index> particles,
                    int ranks, Partitioner partitioner);

/// The simulation takes the model of the scenario, and begins with a state if there is one. What
/// only it can find out about the input gets its place in the file.
Simulation make_simulation(Scenario& scenario, const ExecutionOptions& options,
                           Observer observer = {}, const SimulationState* state = nullptr);

}  // namespace lahar
