/// \file Which blocks the matrix of a patch has (nodal_system.h).
#pragma once

#include <algorithm>
#include <vector>

#include "physics/particles/patch.h"

namespace lahar {

/// Rows of the nodes that particles of this patch touch have the nodes of all cells with particles
/// around them, and of those that `also` marks; other rows have none.
template <int Dim>
void find_pattern(Patch<Dim>& patch, const std::vector<char>& also = {});

/// Number of a block that there is.
template <int Dim>
std::size_t find_block(const NodalSystem<Dim>& system, Local row, Local column) {
  const auto r = static_cast<std::size_t>(row);
  const auto begin = system.column.begin() + static_cast<std::ptrdiff_t>(system.first[r]);
  const auto end = system.column.begin() + static_cast<std::ptrdiff_t>(system.first[r + 1]);
  return static_cast<std::size_t>(std::lower_bound(begin, end, column) - system.column.begin());
}

}  // namespace lahar
