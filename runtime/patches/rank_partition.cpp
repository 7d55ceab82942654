#include "runtime/patches/rank_partition.h"

#include <algorithm>
#include <set>
#include <stdexcept>

#include "runtime/patches/weight_prefix.h"

namespace lahar {

std::vector<int> curve_partition(std::span<const Index> weight, int ranks) {
  if (ranks <= 0) throw std::invalid_argument("a partition needs at least one rank");
  const WeightPrefix prefix(weight);
  const Index most = prefix.least_heaviest(ranks);
  // The earliest position at which the ranks from r on can take what is left.
  std::vector<int> earliest(static_cast<std::size_t>(ranks) + 1, prefix.size());
  for (auto r = static_cast<std::size_t>(ranks); r-- > 0;)
    earliest[r] = prefix.nearest(earliest[r + 1], most);
  std::vector<int> owner(weight.size(), 0);
  int begin = 0;
  for (int r = 0; r < ranks; ++r) {
    const double share = static_cast<double>(r + 1) / ranks;
    const int low = std::max(begin, earliest[static_cast<std::size_t>(r) + 1]);
    const int end = r + 1 == ranks ? prefix.size()
                                   : std::clamp(prefix.nearest_to(share), low,
                                                std::max(low, prefix.furthest(begin, most)));
    std::fill(owner.begin() + begin, owner.begin() + end, r);
    begin = end;
  }
  return owner;
}

double RankShares::imbalance() const {
  Index total = 0, heaviest = 0;
  for (const RankShare& rank : ranks) {
    total += rank.weight;
    heaviest = std::max(heaviest, rank.weight);
  }
  if (total == 0) return 1.0;
  return static_cast<double>(heaviest) * static_cast<double>(ranks.size()) /
         static_cast<double>(total);
}

RankShares shares_of(const PatchGraph& graph, std::span<const int> owner, int ranks) {
  RankShares shares;
  shares.ranks.resize(static_cast<std::size_t>(ranks));
  std::vector<std::set<int>> neighbours(static_cast<std::size_t>(ranks));
  for (std::size_t p = 0; p < graph.weight.size(); ++p) {
    const auto own = static_cast<std::size_t>(owner[p]);
    RankShare& rank = shares.ranks[own];
    ++rank.patches;
    rank.weight += graph.weight[p];
    for (const PatchGraph::Edge& edge : graph.edges[p]) {
      const int other = owner[static_cast<std::size_t>(edge.patch)];
      if (other == owner[p]) continue;
      neighbours[own].insert(other);
      rank.shared_nodes += edge.shared_nodes;
      shares.edge_cut += edge.shared_nodes;
    }
  }
  shares.edge_cut /= 2;  // every pair was counted from both sides
  for (std::size_t r = 0; r < neighbours.size(); ++r)
    shares.ranks[r].neighbours = static_cast<int>(neighbours[r].size());
  return shares;
}

}  // namespace lahar
