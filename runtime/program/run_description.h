/// \file A model made ready to run, and what is said about it: for `lahar run` and `lahar check`.
#pragma once

#include <memory>
#include <span>

#include "runtime/program/run_arguments.h"
#include "runtime/step/restart.h"
#include "runtime/terminal/console.h"

namespace lahar {

const char* scheme_name(Scheme scheme);

/// What is said about a model, kept when the simulation takes the model itself.
template <int Dim>
Model<Dim> without_particles(const Model<Dim>& model);

template <int Dim>
void describe(Console& console, const Model<Dim>& model, const SimulationInfo& info,
              const TimeStep& plan, int ranks = 1);

/// How many frames to expect and how large, with the first and the last; an adaptive step is taken
/// not to change.
void describe_frames(Console& console, const OutputPlan& plan, const Analysis& analysis,
                     const SimulationInfo& info);

/// The partition over ranks that a run would begin with; `particles` of each patch.
void describe_ranks(Console& console, const PatchGraph& graph, std::span<const Index> particles,
                    int ranks, Partitioner partitioner);

/// What only the simulation can find out about the input gets its place in the file.
template <int Dim>
std::unique_ptr<Simulation<Dim>> make_simulation(const Scenario& scenario, Model<Dim> model,
                                                 const ExecutionOptions& options,
                                                 Observer observer = {},
                                                 const CheckpointReader* checkpoint = nullptr);

}  // namespace lahar
