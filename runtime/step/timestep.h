/// \file The whole timestep of every scheme, on one screen.
#pragma once

#include <vector>

#include "runtime/exchange/timestep_stage.h"

namespace lahar {

/// Names of stages that the driver looks for.
inline constexpr const char* output_stage = "output";
inline constexpr const char* locate_stage = "locate";

/// The stages of one timestep in order. The flow graph, the serial loop and the picture of the
/// graph are all made from this list.
///
/// The mapping of a step to the nodes is done at the end of the step before, while the particles
/// are in cache; the first stage adds what came from other cells and patches. Before the first
/// step, map_first() does what the step before would have done. `injects`: particles may come in
/// during the run.
template <int Dim>
std::vector<TimestepStage<Dim>> timestep(const Analysis& analysis, bool injects = false);

/// Nodal sums of which a patch may begin those of the next step while neighbours read these.
NodeSumCopies node_sum_copies(const Analysis& analysis);

/// Whether a phase needs the state of nodes (Patch::velocity and so on) that one before it
/// computed.
bool keeps_nodal_state(const Analysis& analysis);

}  // namespace lahar
