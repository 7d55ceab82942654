#include "runtime/patches/patch_transfer.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <set>
#include <stdexcept>
#include <utility>

namespace lahar {

namespace {

struct Transfer {
  int patch = -1, to = -1;
  double price = 0;  ///< [additional shared nodes per weight]
};

class Transfers {
 public:
  Transfers(const PatchGraph& graph, std::span<const int> owner, std::span<const Index> bytes,
            int ranks, double slack)
      : graph_(graph),
        bytes_(bytes),
        owner_(owner.begin(), owner.end()),
        load_(static_cast<std::size_t>(ranks), 0),
        patches_(static_cast<std::size_t>(ranks)) {
    for (int p = 0; p < graph.size(); ++p) {
      if (rank_of(p) < 0 || rank_of(p) >= ranks)
        throw std::invalid_argument("a patch has no rank of this run");
      load_[index(rank_of(p))] += weight(p);
      if (!empty(p)) patches_[index(rank_of(p))].push_back(p);
    }
    for (int r = 0; r < ranks; ++r) by_load_.insert({load_[index(r)], r});
    const double mean =
        static_cast<double>(std::accumulate(load_.begin(), load_.end(), Index{0})) / ranks;
    most_ = static_cast<Index>(std::ceil(mean * (1 + slack)));
  }

  /// Until the heaviest rank is light enough, or has nothing to give away that may still be moved.
  void relieve(Index most_bytes) {
    for (;;) {
      const auto [load, heaviest] = *by_load_.rbegin();
      if (load <= most_) return;
      std::optional<Transfer> transfer = cheapest(heaviest, most_);
      // All others nearly full: the lightest then takes what still leaves it lighter than this one.
      if (!transfer) transfer = cheapest(heaviest, load - 1);
      if (!transfer) return;
      most_bytes -= bytes_[index(transfer->patch)];
      if (most_bytes < 0) return;
      apply(*transfer);
    }
  }

  /// Empty patches follow their neighbours.
  void place_empty() {
    std::vector<std::pair<int, Index>> shared;
    for (int p = 0; p < graph_.size(); ++p) {
      if (!empty(p)) continue;
      shared_with_ranks(p, shared);
      Index most = 0;
      for (const auto& [rank, nodes] : shared)
        if (rank == rank_of(p)) most = nodes;
      for (const auto& [rank, nodes] : shared)
        if (nodes > most) {
          most = nodes;
          owner_[index(p)] = rank;
        }
    }
  }

  std::vector<int> owners() && { return std::move(owner_); }

 private:
  static std::size_t index(int i) { return static_cast<std::size_t>(i); }
  int rank_of(int patch) const { return owner_[index(patch)]; }
  Index weight(int patch) const { return graph_.weight[index(patch)]; }

  bool empty(int patch) const { return bytes_[index(patch)] == 0; }

  /// Nodes that a patch shares with patches that are not empty, by their rank, ascending.
  void shared_with_ranks(int patch, std::vector<std::pair<int, Index>>& shared) const {
    shared.clear();
    for (const PatchGraph::Edge& edge : graph_.edges[index(patch)])
      if (!empty(edge.patch)) shared.emplace_back(rank_of(edge.patch), edge.shared_nodes);
    std::sort(shared.begin(), shared.end());
    std::size_t n = 0;
    for (std::size_t i = 0; i < shared.size(); ++i) {
      if (n > 0 && shared[n - 1].first == shared[i].first)
        shared[n - 1].second += shared[i].second;
      else
        shared[n++] = shared[i];
    }
    shared.resize(n);
  }

  /// The cheapest one after which the receiver weighs at most `limit`; beyond most_ the receiver is
  /// the lightest rank.
  std::optional<Transfer> cheapest(int from, Index limit) const {
    std::optional<Transfer> best;
    std::vector<std::pair<int, Index>> shared;
    const int lightest = by_load_.begin()->second;
    for (const int p : patches_[index(from)]) {
      if (weight(p) <= 0) continue;  // relieves nobody
      shared_with_ranks(p, shared);
      Index own = 0;
      for (const auto& [rank, nodes] : shared)
        if (rank == from) own = nodes;
      const auto offer = [&](int to, Index nodes) {
        if (to == from || load_[index(to)] + weight(p) > limit) return;
        const double price = static_cast<double>(own - nodes) / static_cast<double>(weight(p));
        if (!best || price < best->price) best = Transfer{p, to, price};
      };
      offer(lightest, 0);
      for (const auto& [rank, nodes] : shared)
        if (limit <= most_ || rank == lightest) offer(rank, nodes);
    }
    return best;
  }

  void apply(const Transfer& transfer) {
    const int from = rank_of(transfer.patch), to = transfer.to;
    for (const int r : {from, to}) by_load_.erase({load_[index(r)], r});
    load_[index(from)] -= weight(transfer.patch);
    load_[index(to)] += weight(transfer.patch);
    for (const int r : {from, to}) by_load_.insert({load_[index(r)], r});
    std::erase(patches_[index(from)], transfer.patch);
    patches_[index(to)].push_back(transfer.patch);
    owner_[index(transfer.patch)] = to;
  }

  const PatchGraph& graph_;
  std::span<const Index> bytes_;
  std::vector<int> owner_;
  std::vector<Index> load_;                ///< of every rank
  std::vector<std::vector<int>> patches_;  ///< of every rank, but empty ones
  std::set<std::pair<Index, int>> by_load_;
  Index most_ = 0;
};

}  // namespace

std::vector<int> transfer_patches(const PatchGraph& graph, std::span<const int> owner,
                                  std::span<const Index> bytes, int ranks, double slack,
                                  Index most_bytes) {
  if (ranks <= 0) throw std::invalid_argument("a partition needs at least one rank");
  if (!(slack >= 0)) throw std::invalid_argument("the slack of a partition must not be negative");
  if (owner.size() != graph.weight.size() || bytes.size() != graph.weight.size())
    throw std::invalid_argument("a partition needs one owner and one size for every patch");
  Transfers transfers(graph, owner, bytes, ranks, slack);
  transfers.relieve(most_bytes);
  transfers.place_empty();
  return std::move(transfers).owners();
}

}  // namespace lahar
