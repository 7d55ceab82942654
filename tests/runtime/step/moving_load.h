/// \file A body that slides through a box of patches, for partitions and load balance.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <utility>
#include <vector>

#include "physics/mesh/partition_common.h"
#include "runtime/patches/balance.h"
#include "runtime/patches/patch_cost.h"

namespace lahar::test {

/// A box of patches in curve order, and a round body in it: a disc, or in 3D a ball, whose patches
/// hold as many particles as their share of it.
template <int Dim>
class MovingLoad {
 public:
  using Place = std::array<int, Dim>;
  static constexpr Index particles_per_patch = 4000, bytes_per_particle = 200;

  /// `size` patches along each axis, the body as wide as `share` of the second axis.
  MovingLoad(Place size, double share) : size_(size), radius_(0.5 * share * size[1]) {
    int bits = 1, n = 1;
    for (const int s : size) n *= s;
    while ((1 << bits) < size[0]) ++bits;
    std::vector<std::pair<std::uint64_t, Place>> order;
    for (int i = 0; i < n; ++i) {
      Place place;
      std::array<std::uint64_t, Dim> x;
      for (std::size_t d = 0, rest = static_cast<std::size_t>(i); d < Dim; ++d) {
        place[d] = static_cast<int>(rest % static_cast<std::size_t>(size[d]));
        x[d] = static_cast<std::uint64_t>(place[d]);
        rest /= static_cast<std::size_t>(size[d]);
      }
      order.emplace_back(hilbert_position<Dim>(x, bits), place);
    }
    std::sort(order.begin(), order.end());
    position_.resize(order.size());
    for (std::size_t p = 0; p < order.size(); ++p) {
      places_.push_back(order[p].second);
      position_[cell(order[p].second)] = static_cast<int>(p);
    }
    link();
  }

  int size() const { return graph_.size(); }

  /// Particles of every patch when the body has gone the share `way` of its way, 0 to 1.
  std::vector<Index> particles(double way) const {
    std::array<double, Dim> centre;
    for (std::size_t d = 0; d < Dim; ++d) centre[d] = 0.5 * size_[d];
    centre[0] = radius_ + way * (size_[0] - 2 * radius_);
    std::vector<Index> count;
    for (const Place& place : places_) count.push_back(inside(place, centre));
    return count;
  }

  /// The patches with these weights.
  PatchGraph graph(std::vector<Index> weight) const {
    PatchGraph graph = graph_;
    graph.weight = std::move(weight);
    return graph;
  }

 private:
  std::size_t cell(const Place& place) const {
    std::size_t i = 0;
    for (std::size_t d = Dim; d-- > 0;)
      i = i * static_cast<std::size_t>(size_[d]) + static_cast<std::size_t>(place[d]);
    return i;
  }

  /// Particles of a patch whose points are in the body: 6 points along each axis.
  Index inside(const Place& place, const std::array<double, Dim>& centre) const {
    constexpr int points = 6;
    int all = 1, in = 0;
    for (int d = 0; d < Dim; ++d) all *= points;
    for (int i = 0; i < all; ++i) {
      double r2 = 0;
      for (std::size_t d = 0, rest = static_cast<std::size_t>(i); d < Dim; ++d, rest /= points) {
        const double x = place[d] + (static_cast<double>(rest % points) + 0.5) / points - centre[d];
        r2 += x * x;
      }
      in += r2 < radius_ * radius_;
    }
    return particles_per_patch * in / all;
  }

  /// Neighbours share faces, edges and corners of 17 nodes a side in 2D, 9 in 3D.
  void link() {
    constexpr Index side = Dim == 2 ? 17 : 9;
    graph_.weight.assign(places_.size(), 0);
    int around = 1;
    for (int d = 0; d < Dim; ++d) around *= 3;
    for (const Place& place : places_) {
      auto& edges = graph_.edges.emplace_back();
      for (int i = 0; i < around; ++i) {
        Place other = place;
        Index shared = 1;
        bool there = true, same = true;
        for (std::size_t d = 0, rest = static_cast<std::size_t>(i); d < Dim; ++d, rest /= 3) {
          const int step = static_cast<int>(rest % 3) - 1;
          other[d] += step;
          if (step == 0) shared *= side;
          same &= step == 0;
          there &= other[d] >= 0 && other[d] < size_[d];
        }
        if (there && !same) edges.push_back({position_[cell(other)], shared});
      }
    }
  }

  Place size_;
  double radius_;
  std::vector<Place> places_;
  std::vector<int> position_;
  PatchGraph graph_;
};

/// What balancing did along the way.
struct BalanceHistory {
  int remaps = 0, transfers = 0;
  double worst_imbalance = 1, mean_imbalance = 1;  ///< of what the ranks then worked with
  double most_moved = 0, moved = 0;  ///< share of all bytes, of one remap and of all together
  double mean_cut = 0;               ///< [shared nodes]
};

/// Let the body slide, with a chance to remap after each of `chances` pieces of its way.
template <int Dim>
BalanceHistory slide(const MovingLoad<Dim>& load, int ranks, int chances,
                     const BalanceTerms& terms) {
  BalanceHistory history;
  std::vector<int> owner = partition(terms.partitioner, load.graph(load.particles(0)), ranks);
  history.mean_imbalance = 0;
  for (int i = 1; i <= chances; ++i) {
    const std::vector<Index> particles = load.particles(static_cast<double>(i) / chances);
    const PatchGraph graph = load.graph(work_of(particles));
    std::vector<Index> bytes;
    for (const Index n : particles) bytes.push_back(n * MovingLoad<Dim>::bytes_per_particle);
    const Index total = std::accumulate(bytes.begin(), bytes.end(), Index{0});
    if (const auto plan = decide(graph, owner, bytes, ranks, terms)) {
      const double share = static_cast<double>(plan->moved) / static_cast<double>(total);
      owner = plan->owner;
      ++history.remaps;
      history.transfers += plan->transferred;
      history.moved += share;
      history.most_moved = std::max(history.most_moved, share);
    }
    const RankShares shares = shares_of(graph, owner, ranks);
    history.worst_imbalance = std::max(history.worst_imbalance, shares.imbalance());
    history.mean_imbalance += shares.imbalance() / chances;
    history.mean_cut += static_cast<double>(shares.edge_cut) / chances;
  }
  return history;
}

}  // namespace lahar::test
