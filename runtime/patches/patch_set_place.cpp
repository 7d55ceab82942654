/// \file Particles that come into a set of patches that exists, at the beginning of a stage.
#include <algorithm>
#include <array>
#include <map>

#include "physics/base/error.h"
#include "physics/base/nodal_limits.h"
#include "physics/mesh/partition_common.h"
#include "runtime/patches/patch_set.h"
#include "runtime/patches/stage_changes.h"

namespace lahar {

namespace {

/// Cells of a patch in which particles are placed beside others, so that they hold too much. One
/// particle that has moved across the border of a cell, as beside a pit, is not too much.
template <int Dim>
void add_occupied(const Patch<Dim>& there, const Patch<Dim>& placed, const Model<Dim>& model,
                  OccupiedCells& found) {
  constexpr double most = 1.15;  // of the cell's volume
  struct Content {
    double before = 0, placed = 0;  // [m^3]
    double largest = 0;             // [m^3] of one particle before
    Index particles = 0;
    std::array<double, 3> place{};
  };
  std::map<Index, Content> cells;
  const auto for_each = [&](const Patch<Dim>& patch, auto&& visit) {
    for (const ParticleBin& bin : patch.bins)
      for (Local p = bin.begin; p < bin.end; ++p)
        visit(patch.topology.cells[static_cast<std::size_t>(bin.cell)], p,
              patch.particles.row(Column::volume)[p] /
                  depth_at(model.analysis, patch.particles.row(Column::x, 0)[p]));
  };
  for_each(placed, [&](Index cell, Local p, double volume) {
    Content& content = cells[cell];
    content.placed += volume;
    ++content.particles;
    for (int d = 0; d < Dim; ++d)
      content.place[static_cast<std::size_t>(d)] = placed.particles.row(Column::x, d)[p];
  });
  for_each(there, [&](Index cell, Local, double volume) {
    const auto at = cells.find(cell);
    if (at == cells.end()) return;
    at->second.before += volume;
    at->second.largest = std::max(at->second.largest, volume);
  });
  for (const auto& [cell, content] : cells) {
    const double ratio = (content.before + content.placed) / model.mesh->cell_volume(cell);
    const double one = content.largest / model.mesh->cell_volume(cell);
    if (content.before == 0 || !(ratio > most + one)) continue;
    ++found.cells;
    found.particles += content.particles;
    if (ratio > found.most) found.most = ratio, found.place = content.place;
  }
}

/// Those of all ranks.
OccupiedCells sum_up(const OccupiedCells& own, const Communicator& ranks) {
  OccupiedCells all;
  for (const OccupiedCells& one : ranks.gather_all(std::span<const OccupiedCells>(&own, 1))) {
    all.cells += one.cells;
    all.particles += one.particles;
    if (one.most > all.most) all.most = one.most, all.place = one.place;
  }
  return all;
}

}  // namespace

template <int Dim>
void PatchSet<Dim>::place_rows(Model<Dim>& model, int threads) {
  changed_.placed.particles = ranks_.sum(model.particles.size());
  if (changed_.placed.particles == 0) return;
  if (shares_mesh())
    throw InputError(
        {Problem{.where = "/at_start",
                 .message = "in a mesh from tables, particles are placed on one rank only",
                 .hint = "run on one rank, with threads; or take a structured mesh"}});
  RowsByPatch rows(model.particles.cell, partition_);
  std::vector<Index> ids = all_;
  const std::vector<Index> around = needed(filled_bricks(rows, threads));
  ids.insert(ids.end(), around.begin(), around.end());
  sort_unique(ids);
  arrange(of_all_ranks(ids));
  if (ranks_.several()) {
    send_to_owners<Dim>(
        model.particles,
        [&](std::size_t row) { return owner_of(partition_.patch_of(model.particles.cell[row])); },
        ranks_);
    rows = RowsByPatch(model.particles.cell, partition_);
  }
  Patches fresh;
  for (const Index id : rows.occupied()) fresh.push_back(make_patch(id));
  const double lightest = ranks_.min(fill_patches<Dim>(fresh, rows, model, threads));
  least_mass_ = std::min(least_mass_, least_nodal_mass_share * lightest);
  std::vector<ParticleTally> tallies;
  for (const auto& from : fresh) {
    ParticleTally& tally = tallies.emplace_back(ParticleTally{from->topology.patch, 0});
    from->for_each_particle([&](Local p) {
      const auto material = from->particles.material[static_cast<std::size_t>(p)];
      ++tally.particles;
      tally.mass += total_mass(from->particles, p, model_->materials[material]);
    });
    const auto own =
        std::lower_bound(patches_.begin(), patches_.end(), from->topology.patch,
                         [](const auto& patch, Index id) { return patch->topology.patch < id; });
    add_occupied(**own, *from, *model_, changed_.occupied);
    add_particles(**own, *from);
  }
  changed_.occupied = sum_up(changed_.occupied, ranks_);
  changed_.placed = sum_up(tallies, 1, ranks_).front();
}

}  // namespace lahar

#include "runtime/patches/patch_set_instances.h"
