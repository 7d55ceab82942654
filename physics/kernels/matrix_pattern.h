/// \file Which blocks the matrix of a patch has (nodal_system.h).
#pragma once

#include <algorithm>
#include <array>
#include <numeric>
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

/// Call add(i, j, k) for all pairs of nodes of a cell, k being the number of the block in the row
/// of nodes[i] and the column of nodes[j]. Rows are walked through in the order of nodes.
template <int Nodes, int Dim, class Add>
void for_each_block(const NodalSystem<Dim>& system, const Local* nodes, Add add) {
  std::array<int, Nodes> order;
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](int a, int b) { return nodes[a] < nodes[b]; });
  for (int i = 0; i < Nodes; ++i) {
    std::size_t k = system.first[static_cast<std::size_t>(nodes[i])];
    for (const int j : order) {
      while (system.column[k] < nodes[j]) ++k;
      add(i, j, k);
    }
  }
}

}  // namespace lahar
