/// \file Patches with far too many particles, split between two steps.
#include <algorithm>
#include <span>
#include <utility>

#include "physics/kernels/kernels.h"
#include "physics/particles/patch_split.h"
#include "runtime/patches/patch_set.h"

namespace lahar {

namespace {

/// Particles in each cell of a patch, of all bodies.
template <int Dim>
std::vector<Index> particles_by_cell(const Patch<Dim>& patch) {
  const std::size_t n = patch.topology.cells.size() / patch.bodies();
  std::vector<Index> particles(n, 0);
  for (const ParticleBin& bin : patch.bins)
    particles[static_cast<std::size_t>(bin.cell) % n] += bin.end - bin.begin;
  return particles;
}

/// A cut, and the patch that it belongs to before all cuts.
struct Cut {
  Index patch;
  PatchSplit split;
};

template <int Dim>
std::vector<Cut> cuts_of(const Patch<Dim>& patch, const Mesh<Dim>& mesh,
                         const Partition<Dim>& partition, Index most) {
  std::vector<Cut> cuts;
  if (patch.count <= most) return cuts;
  const Index id = patch.topology.patch;
  for (const PatchSplit& split :
       choose_splits<Dim>(mesh, partition, id, particles_by_cell(patch), most))
    cuts.push_back({id, split});
  return cuts;
}

}  // namespace

template <int Dim>
PatchRenumbering PatchSet<Dim>::split(Index most) {
  std::vector<Cut> own;
  for (const auto& patch : patches_) {
    const auto cuts = cuts_of(*patch, *model_->mesh, partition_, most);
    own.insert(own.end(), cuts.begin(), cuts.end());
  }
  std::vector<Cut> cuts = ranks_.gather_all(std::span<const Cut>(own));
  // The last patches first: no cut changes the id of a patch that is still to be cut.
  std::stable_sort(cuts.begin(), cuts.end(),
                   [](const Cut& a, const Cut& b) { return a.patch > b.patch; });
  std::vector<Index> cut;
  std::vector<PatchSplit> splits;
  for (const Cut& one : cuts) {
    cut.push_back(one.patch);
    splits.push_back(one.split);
  }
  const PatchRenumbering ids(std::move(cut));
  partition_.split(splits);
  splits_.insert(splits_.end(), splits.begin(), splits.end());
  if (!ids.empty()) renumber(ids);
  return ids;
}

/// Parts belong to who had the patch.
template <int Dim>
void PatchSet<Dim>::renumber(const PatchRenumbering& ids) {
  renumbered_ = true;
  std::vector<Index> all;
  std::vector<int> owner;
  for (std::size_t i = 0; i < all_.size(); ++i)
    for (Index id = ids.first(all_[i]); id < ids.first(all_[i] + 1); ++id) {
      all.push_back(id);
      owner.push_back(owner_[i]);
    }
  all_ = std::move(all);
  owner_ = std::move(owner);
  Patches old = std::move(patches_);
  patches_.clear();
  for (auto& patch : old) {
    const Index id = patch->topology.patch, first = ids.first(id);
    if (!ids.is_split(id)) {
      patch->topology.patch = first;
      patches_.push_back(std::move(patch));
      continue;
    }
    for (auto& part : parts_of(*patch, first, ids.first(id + 1) - first))
      patches_.push_back(std::move(part));
    patch.reset();
  }
}

/// Patches first, first + 1, ... with the particles of one, in its order.
template <int Dim>
typename PatchSet<Dim>::Patches PatchSet<Dim>::parts_of(Patch<Dim>& patch, Index first,
                                                        Index n) const {
  Patches parts;
  // Part and cell there, by cell of the patch.
  std::vector<std::pair<std::size_t, Local>> place(patch.topology.cells.size());
  for (Index k = 0; k < n; ++k) {
    parts.push_back(make_patch(first + k));
    const auto& cells = parts.back()->topology.cells;
    const std::size_t own = cells.size() / patch.bodies(), old = place.size() / patch.bodies();
    for (std::size_t c = 0; c < cells.size(); ++c)  // once for each body, there and here
      place[static_cast<std::size_t>(patch.local_cell.at(cells[c])) + c / own * old] = {
          parts.size() - 1, static_cast<Local>(c)};
  }
  std::vector<std::vector<SlotCopy>> copies(parts.size());
  std::vector<std::vector<Local>> cells(parts.size());
  for (const ParticleBin& bin : patch.bins) {
    const auto [part, cell] = place[static_cast<std::size_t>(bin.cell)];
    for (Local p = bin.begin; p < bin.end; ++p) {
      copies[part].push_back({p, static_cast<Local>(cells[part].size())});
      cells[part].push_back(cell);
    }
  }
  for (std::size_t k = 0; k < parts.size(); ++k) {
    Patch<Dim>& part = *parts[k];
    part.particles.resize(static_cast<Local>(cells[k].size()));
    part.particles.copy(copies[k], patch.particles);
    part.particles.cell = std::move(cells[k]);
    part.moving = patch.moving;
    receive(part);  // sorts; nobody has sent anything
  }
  // What the driver takes with the next row of history or output, whoever has it.
  parts.front()->work = patch.work;
  parts.front()->impulses = patch.impulses;
  parts.front()->removed = std::move(patch.removed);
  parts.front()->injected = std::move(patch.injected);
  return parts;
}

}  // namespace lahar

#include "runtime/patches/patch_set_instances.h"
