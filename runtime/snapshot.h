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

/// One frame of all pieces, ascending particle id.
Frame merge(std::vector<Frame> pieces);

/// Sums over one patch's particles; work since the last row is moved out of the patch.
template <int Dim>
HistoryRow sums(Patch<Dim>& patch);

/// Add a patch's sums to a row (patch order keeps the bits).
void add(HistoryRow& row, const HistoryRow& part);

}  // namespace lahar
