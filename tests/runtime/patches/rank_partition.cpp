// Which rank owns which patch.
#include "runtime/patches/rank_partition.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <limits>
#include <numeric>
#include <random>

#include "runtime/patches/patch_set.h"
#include "tests/runtime/step/models.h"

using namespace lahar;
using namespace lahar::test;

namespace {

std::vector<Index> loads_of(const std::vector<Index>& weight, const std::vector<int>& owner,
                            int ranks) {
  std::vector<Index> loads(static_cast<std::size_t>(ranks), 0);
  for (std::size_t p = 0; p < weight.size(); ++p)
    loads[static_cast<std::size_t>(owner[p])] += weight[p];
  return loads;
}

/// The least weight of the heaviest rank over all ways to cut a row of patches, by trying them.
Index best_heaviest(const std::vector<Index>& weight, std::size_t from, int ranks) {
  Index total = 0;
  for (std::size_t p = from; p < weight.size(); ++p) total += weight[p];
  if (ranks == 1) return total;
  Index best = std::numeric_limits<Index>::max(), own = 0;
  for (std::size_t end = from; end <= weight.size(); ++end) {
    best = std::min(best, std::max(own, best_heaviest(weight, end, ranks - 1)));
    if (end < weight.size()) own += weight[end];
  }
  return best;
}

}  // namespace

TEST_CASE("chunks of the curve are consecutive, and no other chunks have a lighter heaviest rank") {
  std::mt19937 random(71);
  for (int trial = 0; trial < 300; ++trial) {
    std::vector<Index> weight(random() % 9);
    for (Index& w : weight) w = random() % 3 == 0 ? 0 : static_cast<Index>(random() % 50);
    const int ranks = 1 + static_cast<int>(random() % 5);
    const std::vector<int> owner = curve_partition(weight, ranks);
    REQUIRE(owner.size() == weight.size());
    CHECK(std::is_sorted(owner.begin(), owner.end()));
    if (weight.empty()) continue;
    CHECK(owner.front() >= 0);
    CHECK(owner.back() < ranks);
    const auto loads = loads_of(weight, owner, ranks);
    CHECK(*std::max_element(loads.begin(), loads.end()) == best_heaviest(weight, 0, ranks));
  }
  CHECK_THROWS_AS(curve_partition(std::vector<Index>{1}, 0), std::invalid_argument);
}

TEST_CASE("patches of equal weight are dealt out evenly: no rank is left empty") {
  for (const int ranks : {1, 2, 3, 4, 7, 16}) {
    CAPTURE(ranks);
    for (const std::size_t patches : {16, 17, 30, 100}) {
      CAPTURE(patches);
      const std::vector<Index> weight(patches, 4096);
      const auto loads = loads_of(weight, curve_partition(weight, ranks), ranks);
      const auto [least, most] = std::minmax_element(loads.begin(), loads.end());
      CHECK(*least > 0);
      CHECK(*most - *least <= 4096);
    }
  }
}

TEST_CASE("the shares of ranks hold every patch and all work, and every cut edge from both sides") {
  Model<3> model = dam_break_3d();
  const PatchSet<3> patches(model, 0, {{2, 0}});
  const PatchGraph graph = patches.graph();
  REQUIRE(graph.size() == patches.size());
  for (const int ranks : {1, 2, 5}) {
    CAPTURE(ranks);
    const std::vector<int> owner = curve_partition(graph.weight, ranks);
    const RankShares shares = shares_of(graph, owner, ranks);
    // Nodes on which two ranks meet, counted from the meshes of the patches.
    Index cut = 0;
    for (int p = 0; p < patches.size(); ++p)
      for (int q = 0; q < p; ++q) {
        if (owner[static_cast<std::size_t>(p)] == owner[static_cast<std::size_t>(q)]) continue;
        const auto &a = patches[p].topology.nodes, &b = patches[q].topology.nodes;
        std::vector<Index> both;
        std::set_intersection(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(both));
        cut += static_cast<Index>(both.size());
      }
    CHECK(shares.edge_cut == cut);
    CHECK((cut > 0) == (ranks > 1));
    Index work = 0, sent = 0;
    int owned = 0;
    for (const RankShare& rank : shares.ranks) {
      work += rank.weight;
      sent += rank.shared_nodes;
      owned += rank.patches;
      CHECK((rank.neighbours > 0) == (rank.shared_nodes > 0));
      CHECK(rank.neighbours < ranks);
    }
    CHECK(work == std::accumulate(graph.weight.begin(), graph.weight.end(), Index{0}));
    CHECK(owned == patches.size());
    CHECK(sent == 2 * cut);
    CHECK(shares.imbalance() >= 1.0);
    if (ranks == 1) CHECK(shares.imbalance() == 1.0);
  }
}
