/// \file The whole timestep of every scheme, on one screen.
#pragma once

#include <vector>

#include "graph/stage.h"
#include "physics/patch.h"

namespace lahar {

/// A stage and what it does to a patch.
template <int Dim>
struct TimestepStage {
  Stage stage;
  void (*kernel)(Patch<Dim>& patch, const StepContext<Dim>& step);  ///< null: the driver's own
};

/// Names of stages that the driver looks for.
inline constexpr const char* output_stage = "output";
inline constexpr const char* locate_stage = "locate";

/// The stages of one timestep in order. The flow graph, the serial loop and the picture of the
/// graph are all made from this list.
template <int Dim>
std::vector<TimestepStage<Dim>> timestep(const Analysis& analysis);

}  // namespace lahar
