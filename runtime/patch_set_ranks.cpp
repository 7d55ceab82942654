/// \file Patches that go to other ranks, and of meshes from tables the part around them.
#include <algorithm>
#include <cstring>
#include <span>
#include <utility>

#include "runtime/patch_positions.h"
#include "runtime/patch_set.h"
#include "runtime/patch_state.h"

namespace lahar {

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
void PatchSet<Dim>::give_to(const std::vector<int>& owner, Index step) {
  struct Parcel {
    Index patch, bytes;  // its state, which follows
  };
  std::vector<std::vector<std::byte>> parcels(static_cast<std::size_t>(ranks_.size()));
  std::erase_if(patches_, [&](const auto& patch) {
    const int at = position_of(all_, patch->topology.patch);
    const auto to = static_cast<std::size_t>(owner[static_cast<std::size_t>(at)]);
    if (static_cast<int>(to) == ranks_.rank()) return false;
    if (has_state(*patch)) {
      const std::vector<std::byte> state = pack(*patch, step);
      const Parcel parcel{patch->topology.patch, static_cast<Index>(state.size())};
      const auto head = std::as_bytes(std::span(&parcel, 1));
      parcels[to].insert(parcels[to].end(), head.begin(), head.end());
      parcels[to].insert(parcels[to].end(), state.begin(), state.end());
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
      unpack<Dim>(rest.first(size), *patches_[static_cast<std::size_t>(at)], step);
      rest = rest.subspan(size);
    }
  }
  link();
}

#define LAHAR_INSTANTIATE(Dim)                                         \
  template void PatchSet<Dim>::keep_own_mesh();                        \
  template void PatchSet<Dim>::exchange_mesh(const std::vector<int>&); \
  template void PatchSet<Dim>::give_to(const std::vector<int>&, Index);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
