#include "runtime/patch_set.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <span>
#include <utility>

#include "graph/executor.h"
#include "physics/error.h"
#include "physics/kernels.h"
#include "physics/law.h"
#include "physics/partition_common.h"
#include "physics/support.h"
#include "runtime/initial_particles.h"
#include "runtime/parallel.h"
#include "runtime/patch_filling.h"
#include "runtime/patch_state.h"

namespace lahar {

namespace {

/// Cells per patch so that patches of the initial filling hold about the wanted number of
/// particles.
template <int Dim>
Index cells_per_patch(const Model<Dim>& model, const ParticleCensus& census) {
  if (census.occupied_cells == 0) return model.analysis.patch_particles;
  const double per_cell =
      static_cast<double>(census.particles) / static_cast<double>(census.occupied_cells);
  return std::max<Index>(
      1, std::llround(static_cast<double>(model.analysis.patch_particles) / per_cell));
}

template <int Dim>
ColumnLayout<Dim> layout_for(const Model<Dim>& model, const ParticleCensus& census) {
  ColumnNeeds needs;
  needs.size = !model.tractions.empty();
  needs.natural = !model.mesh->is_cartesian() || model.analysis.scheme == Scheme::musl;
  needs.strain = census.stressed;
  needs.domain = basis_kind(model.analysis) == BasisKind::gimp;
  needs.affine = model.analysis.affine != Affine::none;
  needs.vectors = basis_kind(model.analysis) == BasisKind::cpdi;
  needs.next_domain = model.analysis.functions == ShapeFunctions::gimp;
  for (std::size_t m = 0; m < census.used.size(); ++m) {
    if (!census.used[m]) continue;
    needs.pressure = needs.pressure || has_pressure(model.materials[m].law);
    needs.strain = needs.strain || !strain_follows_from_stress(model.materials[m].law);
  }
  return ColumnLayout<Dim>(needs);
}

/// The entries of a list sorted by node that belong to `node`.
template <class Entry>
std::span<const Entry> entries_of(const std::vector<Entry>& sorted, Index node) {
  const auto before = [](const auto& a, const auto& b) {
    if constexpr (std::is_same_v<std::decay_t<decltype(a)>, Index>)
      return a < b.node;
    else
      return a.node < b;
  };
  const auto first = std::lower_bound(sorted.begin(), sorted.end(), node, before);
  const auto last = std::upper_bound(first, sorted.end(), node, before);
  return {first, last};
}

void sort_by_node(auto& entries) {
  std::stable_sort(entries.begin(), entries.end(),
                   [](const auto& a, const auto& b) { return a.node < b.node; });
}

/// Loads and constraints in the order in which patches look for them. Of several ranks that have
/// the table of all particles each keeps a part, so that every particle is in one share.
template <int Dim>
void prepare(Model<Dim>& model, const Ranks& ranks) {
  set_loads(model);
  if (ranks.several() && !ranks.any(!model.particles.id.empty()))
    keep_share(model.particles, ranks);
  sort_by_node(model.node_velocities);
  sort_by_node(model.node_forces);
}

/// A particle that comes so near to a patch that does not exist is noticed when it has changed its
/// cell. It crosses at most one cell in each of the max_lead steps that may pass before a rebuild.
constexpr Index watch_distance = max_lead + 1;

/// The smallest brick around some cells of a structured mesh.
template <int Dim>
class CellsAround {
 public:
  explicit CellsAround(const Mesh<Dim>& mesh) : counts_(mesh.counts()) {
    brick_.low.fill(std::numeric_limits<Index>::max());
    brick_.high.fill(0);
  }
  void add(Index cell) {
    if (cell == last_) return;
    last_ = cell;
    for (std::size_t d = 0; d < Dim; ++d) {
      const Index at = cell % counts_[d];
      cell /= counts_[d];
      brick_.low[d] = std::min(brick_.low[d], at);
      brick_.high[d] = std::max(brick_.high[d], at + 1);
    }
  }
  const typename Partition<Dim>::Brick& brick() const { return brick_; }

 private:
  std::array<Index, Dim> counts_;
  typename Partition<Dim>::Brick brick_;
  Index last_ = -1;
};

/// The bricks around the cells of each patch that have particles of any rank: those of some of the
/// patches on each rank. `patch` and `brick` are what this rank knows.
template <int Dim>
std::vector<typename Partition<Dim>::Brick> bricks_of_all(
    const std::vector<Index>& patch, const std::vector<typename Partition<Dim>::Brick>& brick,
    const Ranks& ranks) {
  struct Known {
    Index patch;
    typename Partition<Dim>::Brick brick;
  };
  const auto size = static_cast<std::size_t>(ranks.size());
  std::vector<std::vector<Known>> to(size);
  for (std::size_t i = 0; i < patch.size(); ++i)
    to[static_cast<std::size_t>(patch[i]) % size].push_back({patch[i], brick[i]});
  std::map<Index, typename Partition<Dim>::Brick> all;
  for (const auto& part : ranks.exchange(to))
    for (const Known& known : part) {
      auto& around = all.emplace(known.patch, known.brick).first->second;
      for (std::size_t d = 0; d < Dim; ++d) {
        around.low[d] = std::min(around.low[d], known.brick.low[d]);
        around.high[d] = std::max(around.high[d], known.brick.high[d]);
      }
    }
  std::vector<typename Partition<Dim>::Brick> bricks;
  for (const auto& [id, around] : all) bricks.push_back(around);
  return bricks;
}

}  // namespace

template <int Dim>
PatchSet<Dim>::PatchSet(Model<Dim>& model, int support_rings, NodeSumCopies copies, int threads,
                        Ranks ranks, SumMessages messages)
    : model_(&model),
      census_((prepare(model, ranks), take_census(model, ranks))),
      target_cells_(cells_per_patch(model, census_)),
      partition_(*model.mesh, target_cells_),
      rings_(std::max(support_rings, lahar::support_rings(model.analysis.functions))),
      copies_(copies),
      layout_(layout_for(model, census_)),
      ranks_(ranks),
      messages_(messages) {
  distribute(model, threads);
  keep_own_mesh();
  link();
}

template <int Dim>
PatchSet<Dim>::PatchSet(Model<Dim>& model, int support_rings, NodeSumCopies copies,
                        const SimulationState& state, int threads, Ranks ranks,
                        SumMessages messages)
    : model_(&model),
      census_((prepare(model, ranks), take_census(model, ranks))),
      target_cells_(state.run.cells_per_patch),
      partition_(*model.mesh, target_cells_),
      rings_(std::max(support_rings, lahar::support_rings(model.analysis.functions))),
      copies_(copies),
      layout_(layout_for(model, census_)),
      least_mass_(state.run.least_mass),
      ranks_(ranks),
      messages_(messages) {
  restore(model, state, threads);
}

template <int Dim>
std::unique_ptr<Patch<Dim>> PatchSet<Dim>::make_patch(Index id) const {
  auto patch = std::make_unique<Patch<Dim>>();
  const Mesh<Dim>& mesh = *model_->mesh;
  patch->topology = make_topology(mesh, partition_, id, rings_);
  set_basis(mesh, model_->analysis, *patch);
  patch->particles = Particles<Dim>(layout_);
  patch->cartesian = mesh.is_cartesian();
  const auto& cells = patch->topology.cells;
  const auto& nodes = patch->topology.nodes;
  patch->local_cell.reserve(cells.size());
  for (std::size_t c = 0; c < cells.size(); ++c) {
    patch->local_cell[cells[c]] = static_cast<Local>(c);
    patch->cell_size.push_back(mesh.cell_size(cells[c]));
    if (!patch->cartesian) continue;
    const CellGeometry<Dim> geometry = mesh.geometry(cells[c]);
    auto& box = patch->box.emplace_back();
    for (int d = 0; d < Dim; ++d) {
      box[static_cast<std::size_t>(d)] = geometry.centre[d];
      box[static_cast<std::size_t>(Dim + d)] = 2.0 / geometry.length[d];
    }
  }
  patch->smallest_cell = *std::min_element(patch->cell_size.begin(), patch->cell_size.end());
  const std::size_t size = nodes.size() * node_width;
  if (!patch->cartesian) {
    patch->node_position.assign(size, 0.0);
    for (std::size_t i = 0; i < nodes.size(); ++i)
      Eigen::Map<Vec<Dim>>(&patch->node_position[i * node_width]) = mesh.node(nodes[i]);
  }

  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const auto node = static_cast<Local>(i);
    bool taken[Dim] = {};
    for (const NodeVelocity& v : entries_of(model_->node_velocities, nodes[i]))
      if (!std::exchange(taken[v.dir], true)) patch->fixed.push_back({node, v.dir, v.velocity});
    for (const NodeForce& f : entries_of(model_->node_forces, nodes[i]))
      patch->forces.push_back({node, f.dir, f.force, f.function});
  }

  for (std::size_t k = 0; k < n_sum_arrays; ++k)
    patch->sums[k].resize(static_cast<std::size_t>(copies_.of[k]));
  patch->idle = true;  // until particles come
  patch->clear_sums = 2;
  if (model_->analysis.damping > 0.0) patch->damping.assign(size, 0.0);
  if (model_->analysis.pressure_smoothing) patch->pressure.assign(nodes.size(), 0.0);
  return patch;
}

/// Where particles are, by patch: bricks of a structured mesh, none of others.
template <int Dim>
std::vector<typename Partition<Dim>::Brick> PatchSet<Dim>::filled_bricks(const RowsByPatch& rows,
                                                                         int threads) const {
  std::vector<Brick> filled;
  if (!model_->mesh->is_structured()) return filled;
  const std::vector<Index> occupied = rows.occupied();
  filled.resize(occupied.size());
  parallel_for(threads, static_cast<int>(occupied.size()), [&](int i) {
    const auto at = static_cast<std::size_t>(i);
    CellsAround<Dim> cells(*model_->mesh);
    for (const auto& span : rows[occupied[at]])
      for (Index row = span.begin; row < span.end; ++row)
        cells.add(model_->particles.cell[static_cast<std::size_t>(row)]);
    filled[at] = cells.brick();
  });
  return ranks_.several() ? bricks_of_all<Dim>(occupied, filled, ranks_) : filled;
}

template <int Dim>
void PatchSet<Dim>::distribute(Model<Dim>& model, int threads) {
  const auto by_patch = [&] { return RowsByPatch(model.particles.cell, partition_); };
  RowsByPatch rows = by_patch();
  all_ = needed(filled_bricks(rows, threads));
  const std::vector<Index> particles = particles_of_patches(model.particles, partition_, ranks_);
  std::vector<Index> weight;
  for (const Index id : all_) weight.push_back(particles[static_cast<std::size_t>(id)]);
  owner_ = curve_chunks(weight, ranks_.size());
  if (ranks_.several()) {
    send_to_owners<Dim>(
        model.particles,
        [&](std::size_t row) { return owner_of(partition_.patch_of(model.particles.cell[row])); },
        ranks_);
    rows = by_patch();
  }
  const std::vector<Index> ids = own_patches();
  patches_.resize(ids.size());
  parallel_for(threads, static_cast<int>(ids.size()), [&](int i) {
    const auto at = static_cast<std::size_t>(i);
    patches_[at] = make_patch(ids[at]);
  });
  const double lightest = ranks_.min(fill_patches<Dim>(patches_, rows, model, threads));
  least_mass_ = std::min(least_nodal_mass, least_nodal_mass_share * lightest);
}

/// Of a mesh from tables, what lies around the patches of this rank.
template <int Dim>
void PatchSet<Dim>::keep_own_mesh() {
  if (!ranks_.several() || model_->mesh->is_structured()) return;
  const std::vector<Index> own = own_patches();
  const std::vector<Index> around = surrounding_patches(partition_, own, rings_);
  auto mesh = std::make_shared<const Mesh<Dim>>(
      model_->mesh->part(surrounding_cells(*model_->mesh, partition_, own, rings_)));
  partition_ = partition_.part(*mesh, around);
  model_->mesh = std::move(mesh);
}

/// The same when patches have changed their ranks: those that had a patch send its surroundings.
template <int Dim>
void PatchSet<Dim>::exchange_mesh(const std::vector<int>& owner) {
  if (!ranks_.several() || model_->mesh->is_structured()) return;
  std::vector<std::vector<Index>> given(static_cast<std::size_t>(ranks_.size()));
  std::vector<Index> kept;
  for (std::size_t i = 0; i < all_.size(); ++i)
    if (owner_[i] == ranks_.rank())
      (owner[i] == ranks_.rank() ? kept : given[static_cast<std::size_t>(owner[i])])
          .push_back(all_[i]);
  const Mesh<Dim>& whole = *model_->mesh;
  std::vector<std::vector<std::byte>> cells(given.size()), cuts(given.size());
  for (std::size_t r = 0; r < given.size(); ++r) {
    if (given[r].empty()) continue;
    cells[r] = whole.pack(surrounding_cells(whole, partition_, given[r], rings_));
    cuts[r] = partition_.pack(surrounding_patches(partition_, given[r], rings_));
  }
  const auto some = [](std::vector<std::vector<std::byte>> pieces) {
    std::erase_if(pieces, [](const auto& piece) { return piece.empty(); });
    return pieces;
  };
  const auto new_cells = some(ranks_.exchange(cells)), new_cuts = some(ranks_.exchange(cuts));
  auto mesh = std::make_shared<const Mesh<Dim>>(
      whole.part(surrounding_cells(whole, partition_, kept, rings_), new_cells));
  partition_ = partition_.part(*mesh, surrounding_patches(partition_, kept, rings_), new_cuts);
  model_->mesh = std::move(mesh);
}

template <int Dim>
std::vector<Index> PatchSet<Dim>::needed(std::span<const Brick> filled) const {
  std::vector<Index> all;
  if (model_->mesh->is_structured()) {
    for (const Brick& cells : filled) {
      const std::vector<Index> near = partition_.patches_near(cells, watch_distance);
      all.insert(all.end(), near.begin(), near.end());
    }
    sort_unique(all);
  } else {  // cells of table meshes are stored anyway
    all.resize(static_cast<std::size_t>(partition_.n_patches()));
    std::iota(all.begin(), all.end(), Index{0});
  }
  return of_all_ranks(all);
}

template <int Dim>
std::vector<Index> PatchSet<Dim>::of_all_ranks(const std::vector<Index>& ids) const {
  std::vector<Index> all = ranks_.gather_all(std::span(ids));
  sort_unique(all);
  if (all.empty()) all = {0};  // a graph needs a patch
  return all;
}

template <int Dim>
int PatchSet<Dim>::owner_of(Index id) const {
  const auto at = std::lower_bound(all_.begin(), all_.end(), id);
  return at != all_.end() && *at == id ? owner_[static_cast<std::size_t>(at - all_.begin())] : -1;
}

template <int Dim>
std::vector<Index> PatchSet<Dim>::own_patches() const {
  std::vector<Index> own;
  for (std::size_t i = 0; i < all_.size(); ++i)
    if (owner_[i] == ranks_.rank()) own.push_back(all_[i]);
  return own;
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
    for (const Index cell : partition_.cells_in(within))
      watched[static_cast<std::size_t>(patch.local_cell.at(cell))] = 1;
  }
  return watched;
}

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
    remote.push_back(make_topology(*model_->mesh, partition_, id, rings_));
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

namespace {

/// Position of a patch in a list that is sorted by id; -1 = not there.
template <class List>
int position_of(const List& list, Index id, auto id_of) {
  const auto at = std::lower_bound(list.begin(), list.end(), id,
                                   [&](const auto& entry, Index i) { return id_of(entry) < i; });
  return at != list.end() && id_of(*at) == id ? static_cast<int>(at - list.begin()) : -1;
}
template <int Dim>
int position_of(const std::vector<std::unique_ptr<Patch<Dim>>>& patches, Index id) {
  return position_of(patches, id, [](const auto& patch) { return patch->topology.patch; });
}
template <int Dim>
int position_of(const std::vector<RemotePatch<Dim>>& patches, Index id) {
  return position_of(patches, id, [](const auto& patch) { return patch.patch; });
}
int position_of(const std::vector<Index>& ids, Index id) {
  return position_of(ids, id, [](Index i) { return i; });
}

}  // namespace

template <int Dim>
void PatchSet<Dim>::restore(Model<Dim>& model, const SimulationState& state, int threads) {
  if (state.run.dim != Dim || state.run.columns != column_text(layout_))
    throw InputError("the state is one of another model: its particles have " + state.run.columns +
                     " in " + std::to_string(state.run.dim) + "D, the model's have " +
                     column_text(layout_) + " in " + std::to_string(Dim) + "D.");
  for (const Index id : state.patches)
    if (id < 0 || id >= partition_.n_patches())
      throw InputError("the state is one of another model: it has a patch " + std::to_string(id) +
                       ", the mesh is cut into " + std::to_string(partition_.n_patches()) + ".");
  model.particles = {};
  all_ = state.patches;
  if (all_.empty()) all_ = {0};  // a graph needs a patch
  owner_ = curve_chunks(state.patches.empty() ? std::vector<Index>{1} : state.sizes, ranks_.size());
  const std::vector<Index> ids = own_patches();
  patches_.resize(ids.size());
  parallel_for(threads, static_cast<int>(ids.size()), [&](int i) {
    const auto at = static_cast<std::size_t>(i);
    patches_[at] = make_patch(ids[at]);
    if (const int stored = position_of(state.patches, ids[at]); stored >= 0)
      unpack<Dim>(state.bytes(static_cast<std::size_t>(stored)), *patches_[at], state.run.step);
  });
  keep_own_mesh();
  rebuild();
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
void PatchSet<Dim>::rebuild() {
  std::vector<Brick> filled;
  std::vector<Index> ids;
  for (const auto& patch : patches_) {
    if (patch->work != PatchWork{}) ids.push_back(patch->topology.patch);
    if (!model_->mesh->is_structured() || patch->count == 0) continue;
    CellsAround<Dim> cells(*model_->mesh);
    for (const Run& run : patch->runs)
      if (run.begin < run.end) cells.add(patch->topology.cells[static_cast<std::size_t>(run.cell)]);
    filled.push_back(cells.brick());
  }
  const std::vector<Index> around = needed(filled);
  ids.insert(ids.end(), around.begin(), around.end());
  arrange(of_all_ranks(ids));
  link();
}

/// These patches instead of those before, still to be linked. New ones belong to who has the one
/// before them.
template <int Dim>
void PatchSet<Dim>::arrange(std::vector<Index> ids) {
  std::vector<int> owner;
  for (const Index id : ids) {
    const auto after = std::upper_bound(all_.begin(), all_.end(), id) - all_.begin();
    owner.push_back(owner_[static_cast<std::size_t>(std::max<std::ptrdiff_t>(after, 1) - 1)]);
  }
  all_ = std::move(ids);
  owner_ = std::move(owner);
  Patches old = std::move(patches_);
  patches_.clear();
  std::size_t next = 0;
  for (const Index id : own_patches()) {
    while (next < old.size() && old[next]->topology.patch < id) ++next;
    if (next < old.size() && old[next]->topology.patch == id) {
      patches_.push_back(std::move(old[next++]));
      patches_.back()->topology = make_topology(*model_->mesh, partition_, id, rings_);
      set_basis(*model_->mesh, model_->analysis, *patches_.back());
    } else {
      patches_.push_back(make_patch(id));
    }
  }
}

template <int Dim>
void PatchSet<Dim>::give_to(const std::vector<int>& owner, Index step) {
  struct Parcel {
    Index patch, bytes;
  };
  std::vector<std::vector<Parcel>> parcels(static_cast<std::size_t>(ranks_.size()));
  std::vector<std::vector<std::byte>> states(parcels.size());
  std::erase_if(patches_, [&](const auto& patch) {
    const int at = position_of(all_, patch->topology.patch);
    const auto to = static_cast<std::size_t>(owner[static_cast<std::size_t>(at)]);
    if (static_cast<int>(to) == ranks_.rank()) return false;
    if (has_state(*patch)) {
      const std::vector<std::byte> state = pack(*patch, step);
      parcels[to].push_back({patch->topology.patch, static_cast<Index>(state.size())});
      states[to].insert(states[to].end(), state.begin(), state.end());
    }
    return true;
  });
  exchange_mesh(owner);
  owner_ = owner;
  arrange(all_);  // new patches are made empty
  const auto parcels_come = ranks_.exchange(parcels);
  const auto states_come = ranks_.exchange(states);
  for (std::size_t r = 0; r < parcels_come.size(); ++r) {
    std::span<const std::byte> rest(states_come[r]);
    for (const Parcel& parcel : parcels_come[r]) {
      const auto size = static_cast<std::size_t>(parcel.bytes);
      const int at = position_of(patches_, parcel.patch);
      unpack<Dim>(rest.first(size), *patches_[static_cast<std::size_t>(at)], step);
      rest = rest.subspan(size);
    }
  }
  link();
}

template <int Dim>
PatchGraph PatchSet<Dim>::graph() const {
  PatchGraph graph;
  const std::vector<std::vector<int>> adjacent = neighbours();
  for (std::size_t p = 0; p < patches_.size(); ++p) {
    graph.weight.push_back(patches_[p]->count);
    auto& edges = graph.edges.emplace_back();
    for (const int q : adjacent[p]) edges.push_back({q, 0});
    for (const auto& share : patches_[p]->topology.shares)
      if (share.neighbour >= 0) ++edges[static_cast<std::size_t>(share.neighbour)].shared_nodes;
  }
  return graph;
}

template <int Dim>
Index PatchSet<Dim>::particles() const {
  Index n = 0;
  for (const auto& patch : patches_) n += patch->count;
  return n;
}

template <int Dim>
std::size_t PatchSet<Dim>::bytes() const {
  std::size_t bytes = 0;
  for (const auto& patch : patches_) {
    bytes += patch->particles.bytes() + patch->runs.capacity() * sizeof(Run) +
             patch->box.capacity() * sizeof(patch->box[0]) +
             patch->topology.corner_nodes.capacity() * sizeof(patch->topology.corner_nodes[0]) +
             patch->local_cell.bucket_count() * (sizeof(Index) + 2 * sizeof(Local));
    for (const auto& copies : patch->sums)
      for (const NodeArray& values : copies) bytes += values.capacity() * sizeof(double);
    bytes += 2 * patch->velocity.capacity() * sizeof(double);
  }
  return bytes;
}

template class PatchSet<2>;
template class PatchSet<3>;

}  // namespace lahar
