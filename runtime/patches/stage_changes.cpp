#include "runtime/patches/stage_changes.h"

#include <algorithm>
#include <numeric>
#include <optional>
#include <string>

#include "physics/base/error.h"
#include "physics/kernels/kernels.h"
#include "physics/materials/law.h"
#include "physics/particles/liquid_content.h"
#include "physics/particles/loads.h"
#include "physics/particles/removal_in_time.h"
#include "runtime/patches/initial_particles.h"
#include "runtime/patches/stage_start.h"

namespace lahar {

namespace {

/// Groups of particles, numbered: those that are removed first.
template <int Dim>
std::vector<const ParticleGroup<Dim>*> groups_of(const StageChanges<Dim>& changes) {
  std::vector<const ParticleGroup<Dim>*> groups;
  for (const auto& removal : changes.removed) groups.push_back(&removal.of);
  for (const auto& change : changes.materials) groups.push_back(&change.of);
  return groups;
}

/// Bit k: the particle is a member of group k.
template <int Dim>
std::vector<ParticleLoads> memberships(const std::vector<const ParticleGroup<Dim>*>& groups) {
  std::vector<ParticleLoads> all;
  for (std::size_t k = 0; k < groups.size(); ++k)
    for (const Index id : groups[k]->members) all.push_back({id, std::uint64_t{1} << k, {}});
  std::sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.id < b.id; });
  std::vector<ParticleLoads> merged;
  for (const ParticleLoads& one : all)
    if (!merged.empty() && merged.back().id == one.id)
      merged.back().loads |= one.loads;
    else
      merged.push_back(one);
  return merged;
}

/// A particle of another material keeps its volume, motion and stress; its mass and state are those
/// of the new one.
template <int Dim>
void give_material(Particles<Dim>& particles, Local p, const Material& from, std::uint16_t number,
                   const Material& to) {
  particles.material[static_cast<std::size_t>(p)] = number;
  particles.row(Column::mass)[p] *= to.density / from.density;
  if (!particles.layout().has(Column::state)) return;
  Voigt stress{};
  for (int k = 0; k < stress_components<Dim>; ++k)
    stress[static_cast<std::size_t>(k)] = particles.row(Column::stress, k)[p];
  const int components = particles.layout().components(Column::state);
  std::vector<double> state(static_cast<std::size_t>(components), 0.0);
  initial_state(to.law, stress, state.data());
  for (int k = 0; k < components; ++k)
    particles.row(Column::state, k)[p] = state[static_cast<std::size_t>(k)];
}

template <int Dim>
void give_load(Particles<Dim>& particles, Local p, std::size_t load) {
  if (particles.loads.empty()) particles.loads.resize(static_cast<std::size_t>(particles.size()));
  particles.loads[static_cast<std::size_t>(p)] |= std::uint64_t{1} << load;
}

template <int Dim>
void replace_particles(Patch<Dim>& patch, Particles<Dim> particles) {
  patch.bins.clear();
  patch.first_bin.assign(patch.topology.cells.size(), -1);
  patch.particles = std::move(particles);
  patch.added_bins = 0;
  patch.sorted = false;
  receive(patch);  // sorts; nobody has sent anything
  const bool filled = patch.count > 0;
  patch.moving = patch.moving && filled;  // an empty patch forgets how it was laid out
  patch.idle = !filled;
  patch.clear_sums = filled ? 0 : 2;
  patch.contributes = {};
  patch.contributes[0] = filled;  // for the first step
}

template <int Dim>
void reset(Patch<Dim>& patch, const StageChanges<Dim>& changes) {
  Particles<Dim>& particles = patch.particles;
  const auto clear = [&](bool asked, Column column) {
    if (!asked || !particles.layout().has(column)) return;
    for (int k = 0; k < particles.layout().components(column); ++k)
      patch.for_each_particle([&](Local p) { particles.row(column, k)[p] = 0.0; });
  };
  clear(changes.reset_displacements, Column::u);
  clear(changes.reset_strains, Column::strain);
  clear(changes.reset_strains, Column::strain_across);
}

/// Takes the particles of patches one after the other to where the changes bring them.
template <int Dim>
class Changer {
 public:
  Changer(const Model<Dim>& model, std::span<const std::unique_ptr<Patch<Dim>>> patches,
          const Communicator& ranks)
      : model_(model), groups_(groups_of(model.changes)) {
    if (groups_.size() > max_particle_loads)
      throw InputError("a stage can remove and change at most " +
                       std::to_string(max_particle_loads) + " groups of particles, found " +
                       std::to_string(groups_.size()) + ".");
    members_ = marks_of<Dim>(patches, memberships(groups_), ranks);
  }

  void change(Patch<Dim>& patch) {
    const std::size_t removals = model_.changes.removed.size();
    Particles<Dim> kept(patch.particles.layout());
    kept.reserve(patch.count);
    const std::size_t cells = patch.topology.cells.size() / patch.bodies();
    bool same = true;
    const std::size_t before = tallies_.size();
    for (std::size_t k = 0; k < groups_.size(); ++k)
      tallies_.push_back({.patch = patch.topology.patch, .group = static_cast<Index>(k)});
    const auto count = [&](std::size_t k, double mass) {
      ++tallies_[before + k].particles;
      tallies_[before + k].mass += mass;
      same = false;
    };
    for (const ParticleBin& bin : patch.bins)
      for (Local p = bin.begin; p < bin.end; ++p) {
        std::optional<std::size_t> last;  // group of a new material
        std::size_t k = 0;
        const std::uint64_t groups = groups_at(patch.particles, p);
        while (k < removals && !(groups >> k & 1)) ++k;
        const bool goes = k < removals;
        if (goes) {
          count(k, total_mass(patch.particles, p, model_.materials[bin.material]));
          if (!model_.changes.removed[k].takes_time()) continue;
        }
        for (std::size_t change = removals; change < groups_.size() && !goes; ++change)
          if (groups >> change & 1) last = change;
        kept.append(patch.particles, p);
        const Local to = kept.size() - 1;
        if (goes) give_load(kept, to, first_removal_load(model_) + k);
        kept.cell[static_cast<std::size_t>(to)] = bin.cell;
        if (!last) continue;
        const std::uint16_t number = model_.changes.materials[*last - removals].material;
        const Material &from = model_.materials[bin.material], &now = model_.materials[number];
        give_material(kept, to, from, number, now);
        const auto first = static_cast<Local>(static_cast<std::size_t>(bin.cell) % cells);
        kept.cell[static_cast<std::size_t>(to)] = patch.cell_of(first, number);
        count(*last, total_mass(kept, to, now));
      }
    if (!same) replace_particles(patch, std::move(kept));
  }

  ChangedParticles counts(const Communicator& ranks) const {
    ChangedParticles all;
    const auto of_groups = sum_up(tallies_, groups_.size(), ranks);
    for (std::size_t k = 0; k < groups_.size(); ++k)
      (k < model_.changes.removed.size() ? all.removed : all.materials).push_back(of_groups[k]);
    return all;
  }

 private:
  std::uint64_t groups_at(const Particles<Dim>& particles, Local p) const {
    std::uint64_t groups = 0;
    if (const auto at = members_.find(particles.id[static_cast<std::size_t>(p)]);
        at != members_.end())
      groups = at->second.loads;
    Vec<Dim> x;
    for (int d = 0; d < Dim; ++d) x[d] = particles.row(Column::x, d)[p];
    for (std::size_t k = 0; k < groups_.size(); ++k)
      if (groups_[k]->region && groups_[k]->region(x)) groups |= std::uint64_t{1} << k;
    return groups;
  }

  const Model<Dim>& model_;
  std::vector<const ParticleGroup<Dim>*> groups_;
  std::vector<ParticleTally> tallies_;
  ParticleMarks members_;
};

}  // namespace

std::vector<ParticleCount> sum_up(const std::vector<ParticleTally>& own, std::size_t groups,
                                  const Communicator& ranks) {
  std::vector<ParticleTally> all = ranks.gather_all(std::span<const ParticleTally>(own));
  std::stable_sort(all.begin(), all.end(),
                   [](const auto& a, const auto& b) { return a.patch < b.patch; });
  std::vector<ParticleCount> counts(groups);
  for (const ParticleTally& one : all) {
    ParticleCount& count = counts[static_cast<std::size_t>(one.group)];
    count.particles += one.particles;
    count.mass += one.mass;
  }
  return counts;
}

template <int Dim>
double total_mass(const Particles<Dim>& particles, Local p, const Material& material) {
  return particles.row(Column::mass)[p] + compressed_mass_of(material.liquid, particles, p);
}

template <int Dim>
ChangedParticles change_particles(std::span<const std::unique_ptr<Patch<Dim>>> patches,
                                  const Model<Dim>& model, const Communicator& ranks) {
  Changer<Dim> changer(model, patches, ranks);
  const bool grouped = !model.changes.removed.empty() || !model.changes.materials.empty();
  for (const auto& patch : patches) {
    if (grouped && patch->count > 0) changer.change(*patch);
    reset(*patch, model.changes);
  }
  return changer.counts(ranks);
}

template <int Dim>
void add_particles(Patch<Dim>& patch, const Patch<Dim>& from) {
  Particles<Dim> all(patch.particles.layout());
  all.reserve(patch.count + from.count);
  const auto append = [&](const Patch<Dim>& some) {
    for (const ParticleBin& bin : some.bins)
      for (Local p = bin.begin; p < bin.end; ++p) {
        all.append(some.particles, p);
        all.cell.back() = bin.cell;
      }
  };
  append(patch);
  append(from);
  replace_particles(patch, std::move(all));
}

template <int Dim>
void keep_rows_from(ParticleTable<Dim>& particles, Index first) {
  if (particles.id.empty()) {
    particles.id.resize(static_cast<std::size_t>(particles.size()));
    std::iota(particles.id.begin(), particles.id.end(), Index{0});
  }
  const auto n =
      std::lower_bound(particles.id.begin(), particles.id.end(), first) - particles.id.begin();
  const auto cut = [&](auto& column) {
    if (!column.empty()) column.erase(column.begin(), column.begin() + n);
  };
  cut(particles.id);
  particles.each_column(cut);
  if (particles.x.empty()) particles = {};  // the memory, too
}

#define LAHAR_INSTANTIATE(Dim)                                                             \
  template ChangedParticles change_particles(std::span<const std::unique_ptr<Patch<Dim>>>, \
                                             const Model<Dim>&, const Communicator&);      \
  template void add_particles(Patch<Dim>&, const Patch<Dim>&);                             \
  template double total_mass(const Particles<Dim>&, Local, const Material&);               \
  template void keep_rows_from(ParticleTable<Dim>&, Index);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
