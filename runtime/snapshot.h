/// \file Copies of a patch's state: frames and the patch's part of a history row.
#pragma once

#include <vector>

#include "io/frame.h"
#include "io/history.h"
#include "physics/patch.h"

namespace lahar {

/// Particles of one patch, those on their way to a neighbour included, in patch order.
template <int Dim>
Frame snapshot(const Patch<Dim>& patch, const Model<Dim>& model);

/// All particles of patches at rest, ascending particle id, read from where they are: besides the
/// patches, which must stay as they are, 8 bytes per particle and a block of values are in memory.
/// Step and time are for the caller to fill in.
template <int Dim>
FrameStream stream(const std::vector<const Patch<Dim>*>& patches, const Model<Dim>& model);

/// Size of a frame in memory [bytes].
template <int Dim>
std::size_t frame_bytes(const ColumnLayout<Dim>& layout, const Model<Dim>& model, Index particles);

/// One frame of all pieces, ascending particle id.
Frame merge(std::vector<Frame> pieces);

/// Sums over one patch's particles; work since the last row is moved out of the patch.
template <int Dim>
HistoryRow sums(Patch<Dim>& patch);

/// Add a patch's sums to a row (patch order keeps the bits).
void add(HistoryRow& row, const HistoryRow& part);

}  // namespace lahar
