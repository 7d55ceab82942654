/// \file What patches know of each other: neighbours, shared nodes, where they find what others
/// give.
#include <algorithm>
#include <iterator>
#include <utility>

#include "physics/kernels/kernels.h"
#include "physics/mesh/partition_common.h"
#include "runtime/patches/patch_cost.h"
#include "runtime/patches/patch_positions.h"
#include "runtime/patches/patch_set.h"

namespace lahar {

/// What patches share, and those of other ranks that they share it with. Patches that have the same
/// neighbours as before keep what they know of them, whatever rank those are on; returns which do
/// not.
template <int Dim>
std::vector<char> PatchSet<Dim>::connect_changed() {
  if (!renumbered_)
    for_each_share_elsewhere([&](std::size_t r, auto& share) {
      share.node = elsewhere_[r].nodes[static_cast<std::size_t>(share.node) - 1];
    });
  elsewhere_.clear();
  std::vector<char> changed;
  std::vector<Index> remote, around;
  for (auto& patch : patches_) {
    const Index id = patch->topology.patch;
    std::vector<Index> present = partition_.neighbours(id, rings_);
    std::erase_if(present, [&](Index other) { return position_of(all_, other) < 0; });
    std::copy_if(present.begin(), present.end(), std::back_inserter(remote),
                 [&](Index other) { return owner_of(other) != ranks_.rank(); });
    const bool is_new = patch->topology.first.empty();
    changed.push_back(is_new || renumbered_ || patch->topology.neighbours != present);
    if (!changed.back()) continue;
    if (!is_new) patch->topology = topology_of(id);
    around.insert(around.end(), present.begin(), present.end());
  }
  sort_unique(remote);
  sort_unique(around);
  for (const Index id : remote) {
    elsewhere_.emplace_back();
    elsewhere_.back().patch = id;
    elsewhere_.back().rank = owner_of(id);
  }
  std::vector<PatchTopology<Dim>> of_others;
  for (const Index id : around)
    if (position_of(remote, id) >= 0) of_others.push_back(topology_of(id));
  std::vector<std::pair<PatchTopology<Dim>*, char>> near;
  for (std::size_t p = 0; p < patches_.size(); ++p)
    if (changed[p] || position_of(around, patches_[p]->topology.patch) >= 0)
      near.emplace_back(&patches_[p]->topology, changed[p]);
  for (auto& topology : of_others) near.emplace_back(&topology, 0);
  std::sort(near.begin(), near.end(),
            [](const auto& a, const auto& b) { return a.first->patch < b.first->patch; });
  std::vector<PatchTopology<Dim>*> topologies;
  std::vector<char> fill;
  for (const auto& [topology, is_changed] : near) {
    topologies.push_back(topology);
    fill.push_back(is_changed);
  }
  connect(topologies, fill);
  return changed;
}

template <int Dim>
void PatchSet<Dim>::link() {
  const std::vector<char> changed = connect_changed();
  for (std::size_t p = 0; p < patches_.size(); ++p) {
    auto& patch = patches_[p];
    const auto& neighbours = patch->topology.neighbours;
    if (changed[p] || all_changed_) patch->halo_edge_cells = find_halo_edge_cells(*patch);
    patch->needs_surroundings = false;
    patch->inbox.clear();
    patch->arrived.assign(neighbours.size(), 0);
    patch->filled_outboxes.clear();
    patch->neighbour_contributes.clear();
    patch->least_mass = least_mass_;
    find_active_nodes(*patch);
    for (auto& of_kind : patch->neighbour_sums)
      for (auto& of_parity : of_kind) of_parity.clear();
    if (!changed[p]) continue;  // outboxes are empty between steps
    patch->movers = Particles<Dim>(layout_);
    patch->outbox.clear();
    patch->outbox.resize(neighbours.size());
    for (auto& out : patch->outbox) out.particles = Particles<Dim>(layout_);
  }
  renumbered_ = all_changed_ = false;
  mirror_nodes();
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
        patch.neighbour_sums[kind][parity].push_back({&copies[parity % copies.size()]});
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
          {&other.sums[static_cast<std::size_t>(messages_[kind].number)][parity],
           messages_[kind].array * static_cast<std::ptrdiff_t>(other.nodes.size()) * sum_stride});
  patch.neighbour_contributes.push_back(&other.contributes);
  patch.outbox[patch.inbox.size()].filled = &patch.left_rank;
  const int slot = position_of(other.outbox_patch, patch.topology.patch);
  auto& from = other.outbox[static_cast<std::size_t>(slot)];
  from.particles = Particles<Dim>(layout_);
  from.filled = &patch.arrived[patch.inbox.size()];
  patch.inbox.push_back(&from);
}

/// Calls body(position in elsewhere_, share) for all that own patches share with those.
template <int Dim>
template <class Body>
void PatchSet<Dim>::for_each_share_elsewhere(Body&& body) {
  if (elsewhere_.empty()) return;
  for (auto& patch : patches_) {
    std::vector<int> at;
    for (const Index id : patch->topology.neighbours) at.push_back(position_of(elsewhere_, id));
    for (auto& share : patch->topology.shares)
      if (share.neighbour >= 0)
        if (const int r = at[static_cast<std::size_t>(share.neighbour)]; r >= 0)
          body(static_cast<std::size_t>(r), share);
  }
}

/// A message holds the nodes that its patch shares with any of this rank, in ascending order: give
/// the shares the places there instead of those in the patch itself.
template <int Dim>
void PatchSet<Dim>::mirror_nodes() {
  for_each_share_elsewhere(
      [&](std::size_t r, const auto& share) { elsewhere_[r].nodes.push_back(share.node); });
  for (const auto& patch : patches_)
    for (const Index id : patch->topology.neighbours)
      if (const int r = position_of(elsewhere_, id); r >= 0)
        elsewhere_[static_cast<std::size_t>(r)].outbox_patch.push_back(patch->topology.patch);
  for (auto& from : elsewhere_) {
    sort_unique(from.nodes);
    from.outbox.resize(from.outbox_patch.size());
  }
  for_each_share_elsewhere([&](std::size_t r, auto& share) {
    const auto& nodes = elsewhere_[r].nodes;
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
std::vector<char> PatchSet<Dim>::find_halo_edge_cells(const Patch<Dim>& patch) const {
  std::vector<char> halo_edge_cells;
  if (!model_->mesh->is_structured()) return halo_edge_cells;
  const Brick own = partition_.brick(patch.topology.patch);
  for (const Index near : partition_.patches_near(own, watch_distance)) {
    if (std::binary_search(all_.begin(), all_.end(), near)) continue;
    halo_edge_cells.resize(patch.topology.cells.size(), 0);
    Brick within = partition_.brick(near);
    for (std::size_t d = 0; d < Dim; ++d) {
      within.low[d] = std::max(own.low[d], within.low[d] - watch_distance);
      within.high[d] = std::min(own.high[d], within.high[d] + watch_distance);
    }
    const std::size_t bodies = patch.bodies(), body_cells = halo_edge_cells.size() / bodies;
    for (const Index cell : partition_.cells_in(within))
      for (std::size_t b = 0; b < bodies; ++b)
        halo_edge_cells[static_cast<std::size_t>(patch.local_cell.at(cell)) + b * body_cells] = 1;
  }
  return halo_edge_cells;
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
  std::vector<Index> counts;
  const std::vector<std::vector<int>> adjacent = neighbours();
  for (std::size_t p = 0; p < patches_.size(); ++p) {
    counts.push_back(patches_[p]->count);
    const std::vector<Index> nodes = shared_nodes(patches_[p]->topology);
    auto& edges = graph.edges.emplace_back();
    for (std::size_t k = 0; k < nodes.size(); ++k) edges.push_back({adjacent[p][k], nodes[k]});
  }
  graph.weight = work_of(counts);
  return graph;
}

template std::vector<Index> shared_nodes(const PatchTopology<2>&);
template std::vector<Index> shared_nodes(const PatchTopology<3>&);

}  // namespace lahar

#include "runtime/patches/patch_set_instances.h"
