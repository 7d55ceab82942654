/// \file What patches know of each other: neighbours, shared nodes, where they find what others
/// give.
#include <algorithm>
#include <utility>

#include "physics/kernels.h"
#include "physics/partition_common.h"
#include "runtime/patch_positions.h"
#include "runtime/patch_set.h"

namespace lahar {

template <int Dim>
std::vector<PatchTopology<Dim>> PatchSet<Dim>::connect_all() {
  std::vector<Index> ids;
  for (const auto& patch : patches_)
    for (const Index id : patch->topology.neighbours)
      if (const int owner = owner_of(id); owner >= 0 && owner != ranks_.rank()) ids.push_back(id);
  sort_unique(ids);
  std::vector<PatchTopology<Dim>> remote;
  elsewhere_.clear();
  for (const Index id : ids) {
    remote.push_back(topology_of(id));
    elsewhere_.emplace_back();
    elsewhere_.back().patch = id;
    elsewhere_.back().rank = owner_of(id);
  }
  std::vector<PatchTopology<Dim>*> topologies;
  for (auto& patch : patches_) topologies.push_back(&patch->topology);
  for (auto& topology : remote) topologies.push_back(&topology);
  std::sort(topologies.begin(), topologies.end(),
            [](const auto* a, const auto* b) { return a->patch < b->patch; });
  connect(topologies);
  return remote;
}

template <int Dim>
void PatchSet<Dim>::link() {
  std::vector<PatchTopology<Dim>> remote = connect_all();
  for (auto& patch : patches_) {
    const auto& neighbours = patch->topology.neighbours;
    patch->watched = watched_cells(*patch);
    patch->needs_surroundings = false;
    patch->outbox.clear();
    patch->inbox.clear();
    patch->arrived.assign(neighbours.size(), 0);
    patch->filled_outboxes.clear();
    patch->neighbour_contributes.clear();
    patch->least_mass = least_mass_;
    find_active_nodes(*patch);
    patch->movers = Particles<Dim>(layout_);
    for (auto& of_kind : patch->neighbour_sums)
      for (auto& of_parity : of_kind) of_parity.clear();
    patch->outbox.resize(neighbours.size());
    for (auto& out : patch->outbox) out.particles = Particles<Dim>(layout_);
  }
  mirror_nodes(remote);
  for (auto& patch : patches_) link_own(*patch);
  find_sends();
}

/// Where a patch finds what its neighbours give.
template <int Dim>
void PatchSet<Dim>::link_own(Patch<Dim>& patch) {
  for (const Index id : patch.topology.neighbours) {
    const int at = position_of(patches_, id);
    if (at < 0) {
      link_elsewhere(patch, elsewhere_[static_cast<std::size_t>(position_of(elsewhere_, id))]);
      continue;
    }
    Patch<Dim>& other = *patches_[static_cast<std::size_t>(at)];
    for (std::size_t kind = 0; kind < n_node_sums; ++kind) {
      auto& copies = other.sums[sum_array(static_cast<NodeSum>(kind))];
      for (std::size_t parity = 0; parity < 2 && !copies.empty(); ++parity)
        patch.neighbour_sums[kind][parity].push_back(&copies[parity % copies.size()]);
    }
    patch.neighbour_contributes.push_back(&other.contributes);
    const int slot = position_of(other.topology.neighbours, patch.topology.patch);
    auto& from = other.outbox[static_cast<std::size_t>(slot)];
    from.filled = &patch.arrived[patch.inbox.size()];
    patch.inbox.push_back(&from);
  }
}

template <int Dim>
void PatchSet<Dim>::link_elsewhere(Patch<Dim>& patch, RemotePatch<Dim>& other) {
  for (std::size_t kind = 0; kind < n_node_sums; ++kind)
    for (std::size_t parity = 0; parity < 2; ++parity)
      patch.neighbour_sums[kind][parity].push_back(
          &other.sums[static_cast<std::size_t>(messages_[kind])][parity]);
  patch.neighbour_contributes.push_back(&other.contributes);
  patch.outbox[patch.inbox.size()].filled = &patch.left_rank;
  const int slot = position_of(other.outbox_patch, patch.topology.patch);
  auto& from = other.outbox[static_cast<std::size_t>(slot)];
  from.particles = Particles<Dim>(layout_);
  from.filled = &patch.arrived[patch.inbox.size()];
  patch.inbox.push_back(&from);
}

/// A message holds the nodes that its patch shares with any of this rank, in ascending order: give
/// the shares the places there instead of those in the patch itself.
template <int Dim>
void PatchSet<Dim>::mirror_nodes(std::vector<PatchTopology<Dim>>& remote) {
  std::vector<std::vector<Local>> mirrored(remote.size());
  const auto for_each_share = [&](auto body) {
    for (auto& patch : patches_) {
      std::vector<int> at;
      for (const Index id : patch->topology.neighbours) at.push_back(position_of(elsewhere_, id));
      for (auto& share : patch->topology.shares)
        if (share.neighbour >= 0)
          if (const int r = at[static_cast<std::size_t>(share.neighbour)]; r >= 0)
            body(static_cast<std::size_t>(r), share);
    }
  };
  for_each_share([&](std::size_t r, const auto& share) { mirrored[r].push_back(share.node); });
  for (std::size_t r = 0; r < remote.size(); ++r) {
    sort_unique(mirrored[r]);
    elsewhere_[r].mirrored = static_cast<Local>(mirrored[r].size());
    for (const Index id : remote[r].neighbours)
      if (position_of(patches_, id) >= 0) elsewhere_[r].outbox_patch.push_back(id);
    elsewhere_[r].outbox.resize(elsewhere_[r].outbox_patch.size());
  }
  for_each_share([&](std::size_t r, auto& share) {
    const auto& nodes = mirrored[r];
    const auto at = std::lower_bound(nodes.begin(), nodes.end(), share.node) - nodes.begin();
    share.node = static_cast<Local>(at) + 1;  // after the line of the header
  });
}

/// The same nodes as the receiver finds in mirror_nodes().
template <int Dim>
void PatchSet<Dim>::find_sends() {
  sends_.assign(patches_.size(), {});
  for (std::size_t p = 0; p < patches_.size(); ++p) {
    const auto& topology = patches_[p]->topology;
    std::vector<int> rank_of;  // of each neighbour; -1 = this one
    for (const Index id : topology.neighbours) {
      const int at = position_of(elsewhere_, id);
      rank_of.push_back(at < 0 ? -1 : elsewhere_[static_cast<std::size_t>(at)].rank);
    }
    std::vector<int> ranks = rank_of;
    sort_unique(ranks);
    std::erase(ranks, -1);
    for (const int rank : ranks) {
      RemoteNeighbour& to = sends_[p].emplace_back();
      to.rank = rank;
      for (std::size_t k = 0; k < rank_of.size(); ++k)
        if (rank_of[k] == rank) to.neighbours.push_back(static_cast<Local>(k));
      for (std::size_t s = 0; s < topology.shared_node.size(); ++s) {
        const auto first = topology.shares.begin() + topology.first[s];
        const auto last = topology.shares.begin() + topology.first[s + 1];
        if (std::any_of(first, last, [&](const auto& share) {
              return share.neighbour >= 0 &&
                     rank_of[static_cast<std::size_t>(share.neighbour)] == rank;
            }))
          to.nodes.push_back(topology.shared_node[s]);
      }
    }
  }
}

template <int Dim>
std::vector<std::vector<int>> PatchSet<Dim>::neighbours() const {
  std::vector<std::vector<int>> result;
  for (const auto& patch : patches_) {
    auto& list = result.emplace_back();
    for (const Index id : patch->topology.neighbours) {
      const int own = position_of(patches_, id);
      list.push_back(own >= 0 ? own : size() + position_of(elsewhere_, id));
    }
  }
  result.resize(patches_.size() + elsewhere_.size());
  return result;
}

template <int Dim>
std::vector<char> PatchSet<Dim>::watched_cells(const Patch<Dim>& patch) const {
  std::vector<char> watched;
  if (!model_->mesh->is_structured()) return watched;
  const Brick own = partition_.brick(patch.topology.patch);
  for (const Index near : partition_.patches_near(own, watch_distance)) {
    if (std::binary_search(all_.begin(), all_.end(), near)) continue;
    watched.resize(patch.topology.cells.size(), 0);
    Brick within = partition_.brick(near);
    for (std::size_t d = 0; d < Dim; ++d) {
      within.low[d] = std::max(own.low[d], within.low[d] - watch_distance);
      within.high[d] = std::min(own.high[d], within.high[d] + watch_distance);
    }
    const std::size_t bodies = patch.bodies(), body_cells = watched.size() / bodies;
    for (const Index cell : partition_.cells_in(within))
      for (std::size_t b = 0; b < bodies; ++b)
        watched[static_cast<std::size_t>(patch.local_cell.at(cell)) + b * body_cells] = 1;
  }
  return watched;
}

template <int Dim>
std::vector<Index> shared_nodes(const PatchTopology<Dim>& topology) {
  std::vector<Index> nodes(topology.neighbours.size(), 0);
  for (const auto& share : topology.shares)
    if (share.neighbour >= 0) ++nodes[static_cast<std::size_t>(share.neighbour)];
  return nodes;
}

template <int Dim>
PatchGraph PatchSet<Dim>::graph() const {
  PatchGraph graph;
  const std::vector<std::vector<int>> adjacent = neighbours();
  for (std::size_t p = 0; p < patches_.size(); ++p) {
    graph.weight.push_back(patches_[p]->count);
    const std::vector<Index> nodes = shared_nodes(patches_[p]->topology);
    auto& edges = graph.edges.emplace_back();
    for (std::size_t k = 0; k < nodes.size(); ++k) edges.push_back({adjacent[p][k], nodes[k]});
  }
  return graph;
}

#define LAHAR_INSTANTIATE(Dim)                                                      \
  template std::vector<PatchTopology<Dim>> PatchSet<Dim>::connect_all();            \
  template void PatchSet<Dim>::link();                                              \
  template void PatchSet<Dim>::link_own(Patch<Dim>&);                               \
  template void PatchSet<Dim>::link_elsewhere(Patch<Dim>&, RemotePatch<Dim>&);      \
  template void PatchSet<Dim>::mirror_nodes(std::vector<PatchTopology<Dim>>&);      \
  template void PatchSet<Dim>::find_sends();                                        \
  template std::vector<std::vector<int>> PatchSet<Dim>::neighbours() const;         \
  template std::vector<char> PatchSet<Dim>::watched_cells(const Patch<Dim>&) const; \
  template PatchGraph PatchSet<Dim>::graph() const;                                 \
  template std::vector<Index> shared_nodes(const PatchTopology<Dim>&);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
