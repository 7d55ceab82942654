/// \file Patches given away one by one by ranks that have too much to do.
#pragma once

#include <span>
#include <vector>

#include "runtime/patches/rank_partition.h"

namespace lahar {

/// Owner of every patch such that no rank weighs more than (1 + slack) times the mean, as far as
/// giving away patches one by one reaches that without moving more than `most_bytes`: the heaviest
/// rank gives a patch to one with room, the patch that costs the fewest additional shared nodes per
/// weight, next to the receiver's own or on its own. Little more than the excess moves. Patches
/// without bytes then follow the rank they share most nodes with.
/// `owner` is the present one, 0 to ranks - 1, `bytes` what moving a patch moves. O(patches) and,
/// per transfer, O(patches of a rank). Throws std::invalid_argument unless slack >= 0 and every
/// patch has an owner and bytes.
std::vector<int> transfer_patches(const PatchGraph& graph, std::span<const int> owner,
                                  std::span<const Index> bytes, int ranks, double slack,
                                  Index most_bytes);

}  // namespace lahar
