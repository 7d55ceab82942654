#include "runtime/patches/shared_cut.h"

#include <algorithm>
#include <iterator>
#include <stdexcept>
#include <string>
#include <tuple>

#include "physics/base/bisection.h"
#include "physics/base/error.h"
#include "physics/mesh/partition_common.h"
#include "runtime/patches/shared_bisection.h"

namespace lahar {

namespace {

Index parts_of(Index cells, Index target_cells) {
  if (target_cells <= 0)
    throw InputError(std::to_string(target_cells) + " cells per patch; at least 1 is needed");
  return bisection_parts(cells, target_cells);
}

}  // namespace

template <int Dim>
SharedCut<Dim>::SharedCut(const Mesh<Dim>& share, Index target_cells, const Team& team)
    : share_(share),
      team_(team),
      n_patches_(parts_of(share.n_cells(), target_cells)),
      first_(own_cells(share.n_cells(), team).first),
      patch_(bisect(share, n_patches_, team)) {}

template <int Dim>
std::vector<Index> SharedCut<Dim>::patches_of(const std::vector<Index>& cells) const {
  const auto of_share = ask<Local>(
      team_, cells, [&](Index cell) { return team_.member(cell, share_.n_cells()); },
      [&](Index cell) { return patch_[static_cast<std::size_t>(cell - first_)]; });
  return {of_share.begin(), of_share.end()};
}

namespace {

[[noreturn]] void refuse_cut() {
  throw std::invalid_argument("a split is not one of this partition");
}

}  // namespace

template <int Dim>
void SharedCut<Dim>::split(std::span<const PatchSplit> splits) {
  std::vector<Index> at;
  for (std::size_t k = 0; k < splits.size(); ++k) {
    const PatchSplit& one = splits[k];
    if (one.patch < 0 || one.patch >= n_patches_ + static_cast<Index>(k) || one.axis < 0 ||
        one.axis >= Dim || one.at < 0 || one.at >= share_.n_cells())
      refuse_cut();
    at.push_back(one.at);
  }
  using Centre = std::array<double, static_cast<std::size_t>(Dim)>;
  const auto centre = ask<Centre>(
      team_, at, [&](Index cell) { return team_.member(cell, share_.n_cells()); },
      [&](Index cell) {
        Centre x;
        std::copy_n(share_.cell_centre(cell).data(), Dim, x.begin());
        return x;
      });
  enum : unsigned char { lower = 1, of_patch = 2 };
  std::vector<unsigned char> seen(splits.size(), 0);
  std::vector<Local> patch = patch_;
  for (std::size_t k = 0; k < splits.size(); ++k) {
    const PatchSplit& one = splits[k];
    const auto first = std::tuple(centre[k][static_cast<std::size_t>(one.axis)], one.at);
    for (std::size_t i = 0; i < patch.size(); ++i) {
      if (patch[i] > one.patch) ++patch[i];
      if (patch[i] != one.patch) continue;
      const Index cell = first_ + static_cast<Index>(i);
      if (cell == one.at) seen[k] |= of_patch;
      if (std::tuple(share_.cell_centre(cell)[static_cast<Eigen::Index>(one.axis)], cell) < first)
        seen[k] |= lower;
      else
        ++patch[i];
    }
  }
  std::vector<unsigned char> all(splits.size(), 0);
  for (const auto& of_member : team_.gather(seen))
    for (std::size_t k = 0; k < all.size(); ++k) all[k] |= of_member[k];
  for (const unsigned char both : all)
    if (both != (lower | of_patch)) refuse_cut();
  patch_ = std::move(patch);
  n_patches_ += static_cast<Index>(splits.size());
}

/// The patches around those with these cells (surrounding_patches()) with their cells, and all
/// cells that are needed (surrounding_cells()), but for those that are near without being next to
/// them.
template <int Dim>
typename SharedCut<Dim>::Surroundings SharedCut<Dim>::find_surroundings(
    const std::vector<Index>& patches, int rings) const {
  const CellIndex of_nodes = index_nodes(share_, team_);
  const CellIndex of_patches(share_.n_cells(), team_, [&](Index cell, const CellIndex::Add& add) {
    add(patch_[static_cast<std::size_t>(cell - first_)]);
  });
  Surroundings found;
  found.own = of_patches.cells_of(patches);
  found.ring = widened(share_, of_nodes, found.own, 1, team_);
  // Two patches, each widened by rings, meet if one has a cell that touches the other widened by
  // twice as many.
  found.patches = patches_of(widened(share_, of_nodes, found.ring, 2 * rings, team_));
  sort_unique(found.patches);
  found.of_patches = of_patches.cells_of(found.patches);
  found.cells = widened(share_, of_nodes, found.of_patches, std::max(1, rings), team_);
  return found;
}

/// Cells of bins that are within reach of own ones.
template <int Dim>
std::vector<Index> SharedCut<Dim>::cells_near(const Surroundings& found) const {
  const Mesh<Dim> ring = share_.share({}, fetch_cells(share_, found.ring, team_));
  return index_bins(share_, team_).cells_of(ring.bins_near(found.own));
}

template <int Dim>
typename SharedCut<Dim>::Around SharedCut<Dim>::around(const std::vector<Index>& patches,
                                                       int rings) const {
  Surroundings found = find_surroundings(patches, rings);
  const std::vector<Index> near = cells_near(found);
  found.cells.insert(found.cells.end(), near.begin(), near.end());
  sort_unique(found.cells);
  auto mesh =
      std::make_shared<const Mesh<Dim>>(share_.part({}, fetch_cells(share_, found.cells, team_)));
  const std::vector<Index> patch = patches_of(found.of_patches);
  std::vector<std::vector<Local>> cells(found.patches.size());
  for (std::size_t i = 0; i < patch.size(); ++i) {
    const auto at = std::ranges::lower_bound(found.patches, patch[i]) - found.patches.begin();
    cells[static_cast<std::size_t>(at)].push_back(static_cast<Local>(found.of_patches[i]));
  }
  std::vector<typename Partition<Dim>::Row> rows;
  for (std::size_t i = 0; i < cells.size(); ++i) rows.emplace_back(found.patches[i], cells[i]);
  return {mesh, Partition<Dim>(*mesh, n_patches_, rows)};
}

template class SharedCut<2>;
template class SharedCut<3>;

}  // namespace lahar
