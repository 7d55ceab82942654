/// \file Which rank owns which patch.
#pragma once

#include <span>
#include <vector>

#include "physics/base/types.h"

namespace lahar {

/// Patches as a graph: vertices weigh what the work on a patch costs, edges the nodes that two
/// patches share. Patches are in the order of the space-filling curve.
struct PatchGraph {
  struct Edge {
    int patch;
    Index shared_nodes;
  };
  std::vector<Index> weight;             ///< [ns] of work per step (patch_cost.h)
  std::vector<std::vector<Edge>> edges;  ///< symmetric

  int size() const { return static_cast<int>(weight.size()); }
};

/// Owner of every patch such that each rank has consecutive patches and the heaviest rank is as
/// light as that allows; boundaries are as near to an even share as that allows. O(n log W) for n
/// patches of total weight W. Throws std::invalid_argument unless ranks > 0.
std::vector<int> curve_partition(std::span<const Index> weight, int ranks);

/// What a partition means for each rank.
struct RankShare {
  int patches = 0;         ///< the rank's own
  Index weight = 0;        ///< of its patches
  Index shared_nodes = 0;  ///< sums that it sends in an exchange, by patch, node and receiver
  int neighbours = 0;      ///< ranks that it exchanges with
};
struct RankShares {
  std::vector<RankShare> ranks;
  Index edge_cut = 0;  ///< shared nodes of all pairs of patches on different ranks

  /// Heaviest rank over the mean; 1 = even.
  double imbalance() const;
};
RankShares shares_of(const PatchGraph& graph, std::span<const int> owner, int ranks);

}  // namespace lahar
