/// \file Lists of stages that a run executes, each as a graph of its own: the time step, and what
/// a solver does before it. For traces and pictures.
#pragma once

#include <string>
#include <vector>

#include "graph/stage.h"

namespace lahar {

/// The stages of a loop are done again and again: once per step, or once per round of a solver.
struct StageLoop {
  std::string name = {};
  std::string taken = {};  ///< how often in a step, in words
  std::vector<Stage> stages = {};
  std::vector<Phase> phases = {};  ///< of the stages
};

/// How loops are called in traces, tables and pictures.
inline constexpr const char* time_step_loop = "time step";

}  // namespace lahar
