/// \file A timestep as a list of stages. The list is the one source of the flow graph, of the
/// serial loop and of the picture of the graph.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace lahar {

/// Number of a step; the first is 0.
using Step = std::int64_t;

/// One stage of the work on a patch. A stage always follows the stage before it in the list on its
/// own patch (the first follows the last one of the step before). What else it waits for:
struct Stage {
  std::string name = {};      ///< as in graphs, traces and tables
  std::string exchange = {};  ///< what it takes from neighbours, that is, from their stage before
                              ///< this one: "mass, momentum"; empty = nothing
  /// Contributes to what all patches together find for the next step, "dt": the least limit of the
  /// time step, or sums of a solver (runtime/solve/rounds.h), of whose kind graphs know nothing.
  bool gives_dt = false;
  bool needs_dt = false;  ///< the first use of that in a step
  bool is_rest = false;   ///< of the stage before, which alone it waits for: is done with it,
                          ///< or deferred until there is nothing else to do

  bool operator==(const Stage&) const = default;
};

/// Consecutive stages that a patch does without waiting for anybody: one task of the graph. They
/// are done piece by piece of the patch, so that a particle is fetched from memory once per phase.
struct Phase {
  Stage task;               ///< what the stages are together, as a stage of the graph
  std::size_t first, last;  ///< stages [first, last)
  /// Where a phase was cut, what is done once for the patch is not: before anything of the phase
  /// for stages [first, begins), after everything for [ends, last).
  std::size_t begins = last, ends = first;

  bool operator==(const Phase&) const = default;
};

/// The phases of a list of stages: a new one begins where something is taken from neighbours, and
/// where the time step is needed. `cut`: the time step takes time to be agreed on. What follows the
/// stage that gives it is a phase of its own then, the rest, some of which can be done meanwhile.
std::vector<Phase> phases_of(const std::vector<Stage>& stages, bool cut = false);
/// A phase and its rest as one.
Phase joined(const Phase& phase, const Phase& rest);
/// The stages of the graph.
std::vector<Stage> tasks_of(const std::vector<Phase>& phases);

}  // namespace lahar
