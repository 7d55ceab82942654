/// \file Patches that come to hold far too many particles are cut in two until they do not.
#pragma once

#include <span>
#include <vector>

#include "physics/particles/patch.h"

namespace lahar {

/// A patch is split when it holds more than so many times the wanted number of particles
/// (Analysis::patch_particles). Below that, more even tasks are not worth that the graph drains and
/// that more nodes are shared; above, all threads may have to wait for one patch. Part of the
/// result's identity.
inline constexpr Index split_factor = 4;

/// Whether a patch holds more than `most` particles, in more than one cell: only then
/// choose_splits() finds a cut.
template <int Dim>
bool is_crowded(const Patch<Dim>& patch, Index most);

/// The cuts that bring a patch, and then its parts, to at most `most` particles each, in the order
/// in which Partition::split() is to make them. `particles` are those in each of the patch's cells.
/// A cut halves the particles as well as any plane across an axis does; where several axes do it
/// equally well, up to a tenth of the particles, it goes across the longest of them. No part is
/// without particles, so that a single cell with too many stays a patch. Follows from the mesh, the
/// patch and the numbers alone.
template <int Dim>
std::vector<PatchSplit> choose_splits(const Mesh<Dim>& mesh, const Partition<Dim>& partition,
                                      Index patch, std::span<const Index> particles, Index most);

extern template bool is_crowded(const Patch<2>&, Index);
extern template bool is_crowded(const Patch<3>&, Index);
extern template std::vector<PatchSplit> choose_splits(const Mesh<2>&, const Partition<2>&, Index,
                                                      std::span<const Index>, Index);
extern template std::vector<PatchSplit> choose_splits(const Mesh<3>&, const Partition<3>&, Index,
                                                      std::span<const Index>, Index);

}  // namespace lahar
