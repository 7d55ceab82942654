/// \file Copies of a patch's state: frames and the patch's part of a history row.
#pragma once

#include <vector>

#include "io/frames/frame.h"
#include "io/run/history.h"
#include "physics/particles/patch.h"

namespace lahar {

/// Particles of one patch that frames have (OutputPlan::frame_particles), those on their way to a
/// neighbour included, in patch order; in the memory of a snapshot of the same model that is done
/// with, if there is one.
template <int Dim>
Frame snapshot(const Patch<Dim>& patch, const Model<Dim>& model, Frame spare = {});

/// How many particles that is.
template <int Dim>
Index particles_of(const Patch<Dim>& patch, const Model<Dim>& model);

/// What all snapshots of a model have in common. Step and time are for the caller to fill in.
template <int Dim>
FrameHeader frame_header(const ColumnLayout<Dim>& layout, const Model<Dim>& model);

/// Patches at rest as a frame; they must outlive it and stay as they are.
template <int Dim>
FrameSource frame_source(const std::vector<const Patch<Dim>*>& patches, FrameHeader header,
                         const Model<Dim>& model);

/// Size of a frame in memory [bytes].
template <int Dim>
std::size_t frame_bytes(const ColumnLayout<Dim>& layout, const Model<Dim>& model, Index particles);

/// Sums over one patch's particles; work since the last row is moved out of the patch.
template <int Dim>
HistoryRow sums(Patch<Dim>& patch, const Model<Dim>& model);

}  // namespace lahar
