/// \file New chunks of the curve near the old ones.
#pragma once

#include <span>
#include <vector>

#include "physics/base/types.h"

namespace lahar {

/// Owner of every patch such that each rank has consecutive patches, the heaviest rank weighs at
/// most (1 + slack) times what the best chunks allow, and the patches that change their owner hold
/// as few bytes as these two permit: nothing moves where the present owners are already such.
/// `owner` is the present one, in any order; -1 = a patch that is new and free to place.
/// The minimum is exact: O(sum over ranks of the positions at which a rank may end), which is about
/// slack x ranks x patches, in time and memory. Throws std::invalid_argument unless ranks > 0,
/// slack >= 0 and all three describe the same patches.
std::vector<int> shift_chunks(std::span<const Index> weight, std::span<const int> owner,
                              std::span<const Index> bytes, int ranks, double slack);

}  // namespace lahar
