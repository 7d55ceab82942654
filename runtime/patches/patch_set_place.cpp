/// \file Particles that come into a set of patches that exists, at the beginning of a stage.
#include <algorithm>

#include "physics/base/error.h"
#include "physics/base/nodal_limits.h"
#include "physics/mesh/partition_common.h"
#include "runtime/patches/patch_set.h"
#include "runtime/patches/stage_changes.h"

namespace lahar {

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
    add_particles(**own, *from);
  }
  changed_.placed = sum_up(tallies, 1, ranks_).front();
}

}  // namespace lahar

#include "runtime/patches/patch_set_instances.h"
