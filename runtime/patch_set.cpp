#include "runtime/patch_set.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <span>
#include <utility>

#include "graph/executor.h"
#include "physics/error.h"
#include "physics/kernels.h"
#include "physics/law.h"
#include "physics/partition_common.h"
#include "runtime/initial_particles.h"
#include "runtime/parallel.h"
#include "runtime/patch_filling.h"

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

}  // namespace

template <int Dim>
PatchSet<Dim>::PatchSet(Model<Dim>& model, int support_rings, NodeSumCopies copies, int threads)
    : PatchSet(model, take_census(model, Ranks()), support_rings, copies, threads) {}

template <int Dim>
PatchSet<Dim>::PatchSet(Model<Dim>& model, const ParticleCensus& census, int support_rings,
                        NodeSumCopies copies, int threads)
    : model_(&model),
      target_cells_(cells_per_patch(model, census)),
      partition_(*model.mesh, target_cells_),
      rings_(support_rings),
      copies_(copies),
      layout_(layout_for(model, census)) {
  sort_by_node(model.node_velocities);
  sort_by_node(model.node_forces);
  distribute(model, threads);
  link();
}

template <int Dim>
std::unique_ptr<Patch<Dim>> PatchSet<Dim>::make_patch(Index id) const {
  auto patch = std::make_unique<Patch<Dim>>();
  const Mesh<Dim>& mesh = *model_->mesh;
  patch->topology = make_topology(mesh, partition_, id, rings_);
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

template <int Dim>
void PatchSet<Dim>::distribute(Model<Dim>& model, int threads) {
  const RowsByPatch rows(model.particles.cell, partition_);
  const std::vector<Index> occupied = rows.occupied();
  std::vector<Brick> filled;
  if (model.mesh->is_structured()) {
    filled.resize(occupied.size());
    parallel_for(threads, static_cast<int>(occupied.size()), [&](int i) {
      const auto at = static_cast<std::size_t>(i);
      CellsAround<Dim> cells(*model.mesh);
      for (const auto& span : rows[occupied[at]])
        for (Index row = span.begin; row < span.end; ++row)
          cells.add(model.particles.cell[static_cast<std::size_t>(row)]);
      filled[at] = cells.brick();
    });
  }
  const std::vector<Index> ids = needed(filled);
  patches_.resize(ids.size());
  parallel_for(threads, static_cast<int>(ids.size()), [&](int i) {
    const auto at = static_cast<std::size_t>(i);
    patches_[at] = make_patch(ids[at]);
  });
  const double lightest = fill_patches<Dim>(patches_, rows, model, threads);
  least_mass_ = std::min(least_nodal_mass, least_nodal_mass_share * lightest);
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
  if (all.empty()) all = {0};  // a graph needs a patch
  return all;
}

template <int Dim>
std::vector<char> PatchSet<Dim>::watched_cells(const Patch<Dim>& patch,
                                               std::span<const Index> existing) const {
  std::vector<char> watched;
  if (!model_->mesh->is_structured()) return watched;
  const Brick own = partition_.brick(patch.topology.patch);
  for (const Index near : partition_.patches_near(own, watch_distance)) {
    if (std::binary_search(existing.begin(), existing.end(), near)) continue;
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
void PatchSet<Dim>::link() {
  std::vector<PatchTopology<Dim>*> topologies;
  std::vector<Index> ids;
  for (std::size_t i = 0; i < patches_.size(); ++i) {
    topologies.push_back(&patches_[i]->topology);
    ids.push_back(patches_[i]->topology.patch);
  }
  connect(topologies);
  for (std::size_t i = 0; i < patches_.size(); ++i) {
    Patch<Dim>& patch = *patches_[i];
    const auto& neighbours = patch.topology.neighbours;
    patch.watched = watched_cells(patch, ids);
    patch.needs_surroundings = false;
    patch.outbox.clear();
    patch.inbox.clear();
    patch.arrived.assign(neighbours.size(), 0);
    patch.filled_outboxes.clear();
    patch.neighbour_contributes.clear();
    find_active_nodes(patch);
    patch.movers = Particles<Dim>(layout_);
    for (std::size_t k = 0; k < n_sum_arrays; ++k)
      patch.neighbour_sums[k].assign(static_cast<std::size_t>(copies_.of[k]), {});
    patch.outbox.resize(neighbours.size());
    for (auto& out : patch.outbox) out.particles = Particles<Dim>(layout_);
  }
  for (auto& patch : patches_) {
    patch->least_mass = least_mass_;
    for (const Index id : patch->topology.neighbours) {
      const auto at = std::lower_bound(ids.begin(), ids.end(), id) - ids.begin();
      Patch<Dim>& other = *patches_[static_cast<std::size_t>(at)];
      for (std::size_t k = 0; k < n_sum_arrays; ++k)
        for (std::size_t copy = 0; copy < other.sums[k].size(); ++copy)
          patch->neighbour_sums[k][copy].push_back(&other.sums[k][copy]);
      patch->neighbour_contributes.push_back(&other.contributes);
      const auto& back = other.topology.neighbours;
      const auto slot =
          std::lower_bound(back.begin(), back.end(), patch->topology.patch) - back.begin();
      auto& from = other.outbox[static_cast<std::size_t>(slot)];
      from.filled = &patch->arrived[patch->inbox.size()];
      patch->inbox.push_back(&from);
    }
  }
}

template <int Dim>
std::vector<std::vector<int>> PatchSet<Dim>::neighbours() const {
  std::vector<Index> ids;
  for (const auto& patch : patches_) ids.push_back(patch->topology.patch);
  std::vector<std::vector<int>> result;
  for (const auto& patch : patches_) {
    auto& list = result.emplace_back();
    for (const Index id : patch->topology.neighbours)
      list.push_back(static_cast<int>(std::lower_bound(ids.begin(), ids.end(), id) - ids.begin()));
  }
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
  sort_unique(ids);
  Patches old = std::move(patches_);
  patches_.clear();
  std::size_t next = 0;
  for (const Index id : ids) {
    while (next < old.size() && old[next]->topology.patch < id) ++next;
    if (next < old.size() && old[next]->topology.patch == id) {
      patches_.push_back(std::move(old[next++]));
      patches_.back()->topology = make_topology(*model_->mesh, partition_, id, rings_);
    } else {
      patches_.push_back(make_patch(id));
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
