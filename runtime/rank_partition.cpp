#include "runtime/rank_partition.h"

#include <algorithm>
#include <numeric>
#include <set>
#include <stdexcept>

namespace lahar {

namespace {

/// Sums of consecutive weights; positions lie between patches, 0 to n.
class Prefix {
 public:
  explicit Prefix(std::span<const Index> weight) : sum_(weight.size() + 1, 0) {
    std::partial_sum(weight.begin(), weight.end(), sum_.begin() + 1);
  }
  int size() const { return static_cast<int>(sum_.size()) - 1; }
  Index total() const { return sum_.back(); }
  Index at(int position) const { return sum_[static_cast<std::size_t>(position)]; }
  /// Last position whose patches since `from` weigh at most `most`.
  int furthest(int from, Index most) const {
    return static_cast<int>(std::upper_bound(sum_.begin() + from, sum_.end(), at(from) + most) -
                            sum_.begin()) -
           1;
  }
  /// First position from which the patches up to `to` weigh at most `most`.
  int nearest(int to, Index most) const {
    return static_cast<int>(std::lower_bound(sum_.begin(), sum_.begin() + to, at(to) - most) -
                            sum_.begin());
  }
  /// The position whose weight before it is nearest to a share of the total, the lower of two.
  int nearest_to(double share) const {
    const double wanted = share * static_cast<double>(total());
    const auto above = std::lower_bound(sum_.begin(), sum_.end(), wanted);
    if (above == sum_.begin()) return 0;
    if (above == sum_.end()) return size();
    const auto i = static_cast<int>(above - sum_.begin());
    return wanted - static_cast<double>(at(i - 1)) <= static_cast<double>(at(i)) - wanted ? i - 1
                                                                                          : i;
  }

 private:
  std::vector<Index> sum_;
};

bool fits(const Prefix& prefix, int ranks, Index most) {
  int position = 0;
  for (int r = 0; r < ranks && position < prefix.size(); ++r)
    position = prefix.furthest(position, most);
  return position == prefix.size();
}

/// The least weight of the heaviest of `ranks` runs of consecutive patches.
Index least_heaviest(const Prefix& prefix, std::span<const Index> weight, int ranks) {
  const Index heaviest = weight.empty() ? 0 : *std::max_element(weight.begin(), weight.end());
  Index low = std::max(heaviest, (prefix.total() + ranks - 1) / ranks), high = prefix.total();
  while (low < high) {
    const Index middle = low + (high - low) / 2;
    if (fits(prefix, ranks, middle))
      high = middle;
    else
      low = middle + 1;
  }
  return low;
}

}  // namespace

std::vector<int> curve_chunks(std::span<const Index> weight, int ranks) {
  if (ranks <= 0) throw std::invalid_argument("a partition needs at least one rank");
  const Prefix prefix(weight);
  const Index most = least_heaviest(prefix, weight, ranks);
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
