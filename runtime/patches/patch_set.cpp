#include "runtime/patches/patch_set.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <span>
#include <stdexcept>
#include <utility>

#include "physics/base/error.h"
#include "physics/basis/support.h"
#include "physics/kernels/kernels.h"
#include "physics/mesh/partition_common.h"
#include "runtime/base/parallel.h"
#include "runtime/patches/balance.h"
#include "runtime/patches/initial_particles.h"
#include "runtime/patches/patch_cost.h"
#include "runtime/patches/patch_filling.h"
#include "runtime/patches/patch_positions.h"
#include "runtime/patches/patch_state.h"
#include "runtime/patches/stage_changes.h"
#include "runtime/patches/stage_start.h"

namespace lahar {

namespace {

/// Cells per patch so that patches of the initial filling hold about the wanted number of
/// particles.
template <int Dim>
Index cells_per_patch(const Model<Dim>& model, const ParticleCensus& census) {
  double per_cell = 1;
  if (census.occupied_cells > 0)
    per_cell = static_cast<double>(census.particles) / static_cast<double>(census.occupied_cells);
  else if (!model.injections.empty())
    per_cell = static_cast<double>(count_injections(model.injections).points);
  return std::max<Index>(
      1, std::llround(static_cast<double>(model.analysis.patch_particles) / per_cell));
}

/// Loads and constraints in the order in which patches look for them. Of several ranks that have
/// the table of all particles each keeps a part, so that every particle is in one share.
template <int Dim>
void prepare(Model<Dim>& model, const Communicator& ranks) {
  set_loads(model);
  if (ranks.several() && !ranks.any(!model.particles.id.empty()))
    keep_share(model.particles, ranks);
  keep_directory_lists(model, ranks);
}

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

/// Smallest mass of a particle that is injected [kg].
template <int Dim>
double lightest_injected(const Model<Dim>& model) {
  double lightest = std::numeric_limits<double>::infinity();
  for (const auto& injection : model.injections)
    for (const double volume : injection.volume)
      lightest = std::min(lightest, volume * model.materials[injection.material].density);
  return lightest;
}

/// The cut of a mesh; empty where ranks have shares of it, which are cut later.
template <int Dim>
Partition<Dim> first_partition(const Mesh<Dim>& mesh, Index target_cells, const Communicator& ranks,
                               const MemoryLimit& memory) {
  // In a grid each patch has its place on the curve, both ways, and a row of particles.
  constexpr double bytes_per_patch = 5 * sizeof(Index);
  const double patches = static_cast<double>(mesh.n_cells()) / static_cast<double>(target_cells);
  if (const double bytes = bytes_per_patch * patches; bytes > memory.bytes) {
    Problem problem = too_much_memory(bytes, fmt::format("{:.4g} patches", patches), memory);
    problem.where = "/analysis/patch_particles";
    problem.hint = "raise analysis.patch_particles, or take larger cells or a smaller mesh";
    throw InputError({problem});
  }
  if (ranks.several() && !mesh.is_structured()) return Partition<Dim>(mesh, 0, {});
  return Partition<Dim>(mesh, target_cells);
}

/// The bricks around the cells of each patch that have particles of any rank: those of some of the
/// patches on each rank. `patch` and `brick` are what this rank knows.
template <int Dim>
std::vector<typename Partition<Dim>::Brick> bricks_of_all(
    const std::vector<Index>& patch, const std::vector<typename Partition<Dim>::Brick>& brick,
    const Communicator& ranks) {
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
                        Communicator ranks, SumMessages messages, const MemoryLimit& memory)
    : model_(&model),
      memory_(memory),
      census_((prepare(model, ranks), take_census(model, ranks))),
      target_cells_(cells_per_patch(model, census_)),
      partition_(first_partition(*model.mesh, target_cells_, ranks, memory)),
      injected_(kept_injections(model.injections)),
      rings_(std::max(support_rings, lahar::support_rings(model.analysis.functions))),
      copies_(copies),
      layout_(column_needs(model, census_.used, census_.stressed)),
      ranks_(ranks),
      messages_(messages) {
  distribute(model, threads);
  link();
}

template <int Dim>
PatchSet<Dim>::PatchSet(Model<Dim>& model, int support_rings, NodeSumCopies copies,
                        const SimulationState& state, int threads, Communicator ranks,
                        SumMessages messages, const MemoryLimit& memory)
    : model_(&model),
      memory_(memory),
      census_((prepare(model, ranks), take_census(model, ranks))),
      target_cells_(std::max<Index>(1, state.run.cells_per_patch)),
      partition_(first_partition(*model.mesh, target_cells_, ranks, memory)),
      injected_(kept_injections(model.injections)),
      rings_(std::max(support_rings, lahar::support_rings(model.analysis.functions))),
      copies_(copies),
      layout_(column_needs(model, census_.used, census_.stressed)),
      least_mass_(state.run.least_mass),
      ranks_(ranks),
      messages_(messages) {
  restore(model, state, threads);
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
  RowsByPatch rows({}, partition_);
  if (shares_mesh()) {
    distribute_shared(model);
  } else {
    rows = by_patch();
    all_ = needed(filled_bricks(rows, threads));
    share_patches(particles_of_patches(model.particles, partition_, ranks_));
    if (ranks_.several())
      send_to_owners<Dim>(
          model.particles,
          [&](std::size_t row) { return owner_of(partition_.patch_of(model.particles.cell[row])); },
          ranks_);
  }
  if (ranks_.several()) rows = by_patch();
  const std::vector<Index> ids = own_patches();
  need_memory(ids, rows.occupied(), model.particles.size());
  patches_.resize(ids.size());
  parallel_for(threads, static_cast<int>(ids.size()), [&](int i) {
    const auto at = static_cast<std::size_t>(i);
    patches_[at] = make_patch(ids[at]);
  });
  set_conditions();
  const double lightest = ranks_.min(
      std::min(lightest_injected(model), fill_patches<Dim>(patches_, rows, model, threads)));
  least_mass_ = std::min(least_nodal_mass, least_nodal_mass_share * lightest);
}

/// Give patches to ranks by the work that so many particles in each of the partition mean.
template <int Dim>
void PatchSet<Dim>::share_patches(const std::vector<Index>& particles) {
  std::vector<Index> counts;
  for (const Index id : all_) counts.push_back(particles[static_cast<std::size_t>(id)]);
  owner_ = curve_partition(work_of(counts), ranks_.size());
}

/// The cells of each patch into which particles are injected, as if they were filled; of several
/// ranks each has some. Collective; structured meshes only.
template <int Dim>
std::vector<typename PatchSet<Dim>::Brick> PatchSet<Dim>::injected_bricks() const {
  if (model_->injections.empty()) return {};
  std::map<Index, CellsAround<Dim>> injected;
  for (const auto& into : injected_.cells)
    injected.try_emplace(partition_.patch_of(into.cell), *model_->mesh)
        .first->second.add(into.cell);
  std::vector<Index> patches;
  std::vector<Brick> bricks;
  for (const auto& [patch, cells] : injected) {
    patches.push_back(patch);
    bricks.push_back(cells.brick());
  }
  return ranks_.several() ? bricks_of_all<Dim>(patches, bricks, ranks_) : bricks;
}

template <int Dim>
std::vector<Index> PatchSet<Dim>::needed(std::span<const Brick> filled) const {
  std::vector<Index> all;
  if (model_->mesh->is_structured()) {
    const auto add = [&](const Brick& cells) {
      const std::vector<Index> near = partition_.patches_near(cells, watch_distance);
      all.insert(all.end(), near.begin(), near.end());
    };
    for (const Brick& cells : filled) add(cells);
    for (const Brick& cells : injected_bricks()) add(cells);
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
  const int at = position_of(all_, id);
  return at >= 0 ? owner_[static_cast<std::size_t>(at)] : -1;
}

template <int Dim>
std::vector<Index> PatchSet<Dim>::own_patches() const {
  std::vector<Index> own;
  for (std::size_t i = 0; i < all_.size(); ++i)
    if (owner_[i] == ranks_.rank()) own.push_back(all_[i]);
  return own;
}

template <int Dim>
void PatchSet<Dim>::restore(Model<Dim>& model, const SimulationState& state, int threads) {
  const StateUse use = state.use;
  const bool same_columns = state.run.columns == column_text(layout_);
  if (state.run.dim != Dim || (use != StateUse::other_run && !same_columns))
    throw InputError("the state is one of another model: its particles have " + state.run.columns +
                     " in " + std::to_string(state.run.dim) + "D, the model's have " +
                     column_text(layout_) + " in " + std::to_string(Dim) + "D.");
  splits_ = state.run.splits;
  const std::vector<ParticleLoads> loads =
      use == StateUse::other_run ? loads_in(model.particles) : std::vector<ParticleLoads>{};
  if (use == StateUse::other_run)  // those that are placed
    keep_rows_from(model.particles, state.run.next_id);
  else
    model.particles = {};
  try {
    if (shares_mesh()) {
      restore_shared(state);
    } else {
      partition_.split(splits_);
      choose_owners(state);
    }
  } catch (const std::invalid_argument&) {
    throw InputError(
        "the state is one of another model: its patches were split otherwise than those "
        "of this mesh can be.");
  }
  const std::vector<Index> ids = own_patches();
  need_memory(ids, ids, 0);  // of particles: what the state's file has, which is there
  patches_.resize(ids.size());
  parallel_for(threads, static_cast<int>(ids.size()), [&](int i) {
    patches_[static_cast<std::size_t>(i)] = make_patch(ids[static_cast<std::size_t>(i)]);
  });
  set_conditions();  // what is stored of a patch depends on them
  const StateBounds bounds{model_->materials.size(), memory_.bytes, use != StateUse::other_run};
  // Those of other cells are in a state that had any.
  const bool new_places = use == StateUse::other_run && model_->mesh->is_cartesian() &&
                          layout_.has(Column::xi) && !same_columns;
  parallel_for(threads, static_cast<int>(ids.size()), [&](int i) {
    const auto at = static_cast<std::size_t>(i);
    const int stored = position_of(state.patches, ids[at]);
    if (stored < 0) return;
    const auto bytes =
        state_for(use, state.bytes(static_cast<std::size_t>(stored)), state.run.columns, layout_);
    unpack<Dim>(bytes, *patches_[at], state.run.step, bounds);
    if (new_places) find_natural_coordinates(*patches_[at]);
    if (use != StateUse::go_on) follow_parameters<Dim>(*patches_[at], model_->materials);
  });
  if (use == StateUse::other_run) {
    give_loads<Dim>(patches_, loads, ranks_);
    if (model.changes.any()) changed_ = change_particles<Dim>(patches_, model, ranks_);
    changed_.lost_strains = layout_.has(Column::strain) && !model.changes.reset_strains &&
                            state.run.particles > 0 &&
                            !has_column(state.run.columns, Column::strain);
    place_rows(model, threads);
  }
  rebuild();
}

/// Which patches exist, and whose they are, when the partition has its number of patches.
template <int Dim>
void PatchSet<Dim>::choose_owners(const SimulationState& state) {
  for (const Index id : state.patches)
    if (id < 0 || id >= partition_.n_patches())
      throw InputError("the state is one of another model: it has a patch " + std::to_string(id) +
                       ", the mesh is cut into " + std::to_string(partition_.n_patches()) + ".");
  // In a mesh from tables all patches exist, so that each rank's part of it is around all it has.
  all_ = model_->mesh->is_structured() && !state.patches.empty() ? state.patches : needed({});
  std::vector<Index> weight;
  for (const Index id : all_) {
    const int stored = position_of(state.patches, id);
    weight.push_back(stored >= 0 ? state.sizes[static_cast<std::size_t>(stored)] : 1);
  }
  owner_ = curve_partition(weight, ranks_.size());
}

template <int Dim>
void PatchSet<Dim>::rebuild() {
  std::vector<Brick> filled;
  std::vector<Index> ids;
  for (const auto& patch : patches_) {
    if (patch->work != PatchWork{}) ids.push_back(patch->topology.patch);
    if (!model_->mesh->is_structured() || patch->count == 0) continue;
    CellsAround<Dim> cells(*model_->mesh);
    for (const ParticleBin& bin : patch->bins)
      if (bin.begin < bin.end) cells.add(patch->topology.cells[static_cast<std::size_t>(bin.cell)]);
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
  for (const Index id : ids) owner.push_back(owner_of(id));
  all_changed_ = all_changed_ || ids != all_;
  all_ = std::move(ids);
  owner_ = owners_with_new(owner);
  Patches old = std::move(patches_);
  patches_.clear();
  std::size_t next = 0;
  for (const Index id : own_patches()) {
    while (next < old.size() && old[next]->topology.patch < id) ++next;
    if (next < old.size() && old[next]->topology.patch == id) {
      patches_.push_back(std::move(old[next++]));
    } else {
      patches_.push_back(make_patch(id));
    }
  }
  set_conditions();
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
    bytes += patch->particles.bytes() + patch->bins.capacity() * sizeof(ParticleBin) +
             patch->box.capacity() * sizeof(patch->box[0]) +
             patch->topology.corner_nodes.capacity() * sizeof(patch->topology.corner_nodes[0]) +
             patch->local_cell.bucket_count() * (sizeof(Index) + 2 * sizeof(Local));
    for (const auto& copies : patch->sums)
      for (const NodeArray& values : copies) bytes += values.capacity() * sizeof(double);
    bytes += 2 * patch->velocity.capacity() * sizeof(double);
  }
  return bytes;
}

}  // namespace lahar

#include "runtime/patches/patch_set_instances.h"
