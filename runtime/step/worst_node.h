/// \file The node at which something is largest, for messages.
#pragma once

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <string>

#include "runtime/exchange/failure.h"
#include "runtime/patches/patch_set.h"

namespace lahar {

/// "node 5 (0.1, 0.2), 3.4", with the largest size(patch, local node) of all patches of all ranks;
/// empty where none is above -1. Collective.
template <int Dim, class Size>
std::string describe_worst_node(const PatchSet<Dim>& patches, const Mesh<Dim>& mesh,
                                const Communicator& ranks, Size size) {
  double worst = -1;
  std::string text;
  for (int p = 0; p < patches.size(); ++p)
    for (std::size_t i = 0; i < patches[p].topology.nodes.size(); ++i) {
      const double found = size(patches[p], i);
      if (!(found > worst)) continue;
      worst = found;
      const Index node = patches[p].topology.nodes[i] % mesh.n_nodes();
      const Vec<Dim> x = mesh.node(node);
      text = fmt::format("node {} ({:.6g}), {:.3g}", node, fmt::join(x, ", "), worst);
    }
  if (ranks.several()) take_first_text(ranks, worst == ranks.max(worst), text);
  return text;
}

}  // namespace lahar
