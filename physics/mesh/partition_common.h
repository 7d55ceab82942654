/// \file Pieces of the partition that several sources share.
#pragma once

#include <cstdint>
#include <vector>

#include "physics/base/sort_unique.h"
#include "physics/mesh/mesh.h"

namespace lahar {

/// Nodes of the given cells plus `rings` layers of cells around them, ascending.
template <int Dim>
std::vector<Index> nodes_around(const Mesh<Dim>& mesh, const std::vector<Index>& cells, int rings) {
  std::vector<Index> nodes;
  const auto add_nodes_of = [&](const std::vector<Index>& some) {
    for (Index c : some)
      for (Index n : mesh.element_nodes(c)) nodes.push_back(n);
    sort_unique(nodes);
  };
  add_nodes_of(cells);
  std::vector<Index> layer;
  for (int ring = 0; ring < rings; ++ring) {
    layer.clear();
    for (Index n : nodes)
      for (Index c : mesh.node_cells(n)) layer.push_back(c);
    sort_unique(layer);
    add_nodes_of(layer);
  }
  return nodes;
}

/// Position along the Hilbert curve of a point with Dim coordinates of `bits` bits each.
/// J. Skilling, "Programming the Hilbert curve", AIP Conf. Proc. 707 (2004).
template <int Dim>
std::uint64_t hilbert_position(std::array<std::uint64_t, Dim> x, int bits) {
  if (bits == 0) return 0;
  const std::uint64_t top = std::uint64_t{1} << (bits - 1);
  // Undo the rotations and reflections from the coarsest level to the finest.
  for (std::uint64_t bit = top; bit > 1; bit >>= 1) {
    const std::uint64_t below = bit - 1;
    for (int d = 0; d < Dim; ++d) {
      if (x[d] & bit) {
        x[0] ^= below;
      } else {
        const std::uint64_t swapped = (x[0] ^ x[d]) & below;
        x[0] ^= swapped;
        x[d] ^= swapped;
      }
    }
  }
  // Gray code across the axes.
  for (int d = 1; d < Dim; ++d) x[d] ^= x[d - 1];
  std::uint64_t flip = 0;
  for (std::uint64_t bit = top; bit > 1; bit >>= 1)
    if (x[Dim - 1] & bit) flip ^= bit - 1;
  for (int d = 0; d < Dim; ++d) x[d] ^= flip;
  // Interleave, axis 0 first.
  std::uint64_t position = 0;
  for (int level = bits - 1; level >= 0; --level)
    for (int d = 0; d < Dim; ++d) position = position << 1 | (x[d] >> level & 1);
  return position;
}

}  // namespace lahar
