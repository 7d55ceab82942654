/// \file Patches that go to other ranks, and of meshes from tables the part around them.
#include <algorithm>
#include <cstring>
#include <span>
#include <utility>

#include "runtime/comm/rank_team.h"
#include "runtime/patches/patch_positions.h"
#include "runtime/patches/patch_set.h"
#include "runtime/patches/patch_state.h"

namespace lahar {

/// The cut of the mesh that all ranks have shares of.
template <int Dim>
std::unique_ptr<SharedCut<Dim>> PatchSet<Dim>::make_cut(const Team& team) {
  if (!model_->mesh->is_share())
    model_->mesh = std::make_shared<const Mesh<Dim>>(share_of(*model_->mesh, team));
  return std::make_unique<SharedCut<Dim>>(*model_->mesh, target_cells_, team);
}

/// Instead of the share of the mesh, what lies around the patches of this rank.
template <int Dim>
void PatchSet<Dim>::keep_own_mesh(const SharedCut<Dim>& cut) {
  auto around = cut.around(own_patches(), rings_);
  partition_ = std::move(around.partition);
  model_->mesh = std::move(around.mesh);
}

/// Cut the mesh, share patches out, and send particles to where their patches are.
template <int Dim>
void PatchSet<Dim>::distribute_shared(Model<Dim>& model) {
  const RankTeam team(ranks_);
  const auto cut = make_cut(team);
  partition_ = Partition<Dim>(*model.mesh, cut->n_patches(), {});
  all_ = needed({});
  const std::vector<Index> patch = cut->patches_of(model.particles.cell);
  std::vector<Index> particles(static_cast<std::size_t>(cut->n_patches()), 0);
  for (const Index p : patch) ++particles[static_cast<std::size_t>(p)];
  ranks_.sum(particles);
  share_patches(particles);
  send_to_owners<Dim>(
      model.particles, [&](std::size_t row) { return owner_of(patch[row]); }, ranks_);
  keep_own_mesh(*cut);
}

template <int Dim>
void PatchSet<Dim>::restore_shared(const SimulationState& state) {
  const RankTeam team(ranks_);
  const auto cut = make_cut(team);
  cut->split(splits_);
  partition_ = Partition<Dim>(*model_->mesh, cut->n_patches(), {});
  choose_owners(state);
  keep_own_mesh(*cut);
}

/// The part of the mesh when patches have changed their ranks: those that had a patch send its
/// surroundings.
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
  auto new_cells = some(ranks_.exchange(cells));
  const auto new_cuts = some(ranks_.exchange(cuts));
  auto mesh = std::make_shared<const Mesh<Dim>>(
      whole.part(surrounding_cells(whole, partition_, kept, rings_), std::move(new_cells)));
  partition_ = partition_.part(*mesh, surrounding_patches(partition_, kept, rings_), new_cuts);
  model_->mesh = std::move(mesh);
}

template <int Dim>
void PatchSet<Dim>::give_to(const std::vector<int>& owner, Index step) {
  struct Parcel {
    Index patch, bytes;  // its state, which follows
  };
  const auto new_owner = [&](const Patch<Dim>& patch) {
    const int at = position_of(all_, patch.topology.patch);
    return static_cast<std::size_t>(owner[static_cast<std::size_t>(at)]);
  };
  const auto own = static_cast<std::size_t>(ranks_.rank());
  std::vector<std::vector<std::byte>> parcels(static_cast<std::size_t>(ranks_.size()));
  std::vector<std::size_t> sizes(parcels.size(), 0);
  for (const auto& patch : patches_)
    if (has_state(*patch)) sizes[new_owner(*patch)] += sizeof(Parcel) + packed_bytes(*patch);
  for (std::size_t r = 0; r < parcels.size(); ++r)
    if (r != own) parcels[r].reserve(sizes[r]);
  std::erase_if(patches_, [&](const auto& patch) {
    const std::size_t to = new_owner(*patch);
    if (to == own) return false;
    if (has_state(*patch)) {
      const Parcel parcel{patch->topology.patch, static_cast<Index>(packed_bytes(*patch))};
      std::vector<std::byte>& bytes = parcels[to];
      const std::size_t begin = bytes.size(), state = begin + sizeof parcel;
      bytes.resize(state + static_cast<std::size_t>(parcel.bytes));
      std::memcpy(&bytes[begin], &parcel, sizeof parcel);
      pack(*patch, step, &bytes[state]);
    }
    return true;
  });
  exchange_mesh(owner);
  owner_ = owner;
  arrange(all_);  // new patches are made empty
  for (const std::vector<std::byte>& come : ranks_.exchange(parcels)) {
    std::span<const std::byte> rest(come);
    while (!rest.empty()) {
      Parcel parcel{};
      std::memcpy(&parcel, rest.data(), sizeof parcel);
      rest = rest.subspan(sizeof parcel);
      const auto size = static_cast<std::size_t>(parcel.bytes);
      const int at = position_of(patches_, parcel.patch);
      unpack<Dim>(rest.first(size), *patches_[static_cast<std::size_t>(at)], step,
                  {model_->materials.size(), memory_.bytes});
      rest = rest.subspan(size);
    }
  }
  link();
}

}  // namespace lahar

#include "runtime/patches/patch_set_instances.h"
