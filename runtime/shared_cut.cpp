#include "runtime/shared_cut.h"

#include <algorithm>
#include <iterator>
#include <stdexcept>
#include <string>
#include <tuple>

#include "physics/bisection.h"
#include "physics/error.h"
#include "physics/partition_common.h"
#include "runtime/shared_bisection.h"

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

[[noreturn]] void refuse() {
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
      refuse();
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
    if (both != (lower | of_patch)) refuse();
  patch_ = std::move(patch);
  n_patches_ += static_cast<Index>(splits.size());
}

/// Patches with cells that touch these, widened by twice as many layers as nodes of a patch are:
/// surrounding_patches().
template <int Dim>
std::vector<Index> SharedCut<Dim>::patches_near(const std::vector<Index>& cells, int rings) const {
  const CellIndex of_nodes = index_nodes(share_, team_);
  std::vector<Index> near = patches_of(widened(share_, of_nodes, cells, 2 * rings + 1, team_));
  sort_unique(near);
  return near;
}

/// A part with these cells, and with those that are near `own`, which are among them.
template <int Dim>
Mesh<Dim> SharedCut<Dim>::part_around(const std::vector<Index>& own,
                                      const std::vector<Index>& cells) const {
  Mesh<Dim> part = share_.part({}, fetch_cells(share_, cells, team_));
  std::vector<Index> near = index_bins(share_, team_).cells_of(part.bins_near(own));
  std::erase_if(near, [&](Index cell) { return part.holds(cell); });
  auto missing = fetch_cells(share_, near, team_);
  if (missing.empty()) return part;
  return part.part(cells, std::move(missing));
}

template <int Dim>
typename SharedCut<Dim>::Around SharedCut<Dim>::around(const std::vector<Index>& patches,
                                                       int rings) const {
  const CellIndex of_patches(share_.n_cells(), team_, [&](Index cell, const CellIndex::Add& add) {
    add(patch_[static_cast<std::size_t>(cell - first_)]);
  });
  const std::vector<Index> own = of_patches.cells_of(patches);
  const std::vector<Index> near = patches_near(own, rings);
  const std::vector<Index> of_near = of_patches.cells_of(near);
  std::vector<Index> all;
  {
    const CellIndex of_nodes = index_nodes(share_, team_);
    all = widened(share_, of_nodes, of_near, std::max(1, rings), team_);
  }
  auto mesh = std::make_shared<const Mesh<Dim>>(part_around(own, all));
  const std::vector<Index> patch = patches_of(of_near);
  std::vector<std::vector<Local>> cells(near.size());
  for (std::size_t i = 0; i < of_near.size(); ++i) {
    const auto at = std::lower_bound(near.begin(), near.end(), patch[i]) - near.begin();
    cells[static_cast<std::size_t>(at)].push_back(static_cast<Local>(of_near[i]));
  }
  std::vector<typename Partition<Dim>::Row> rows;
  for (std::size_t i = 0; i < near.size(); ++i) rows.emplace_back(near[i], cells[i]);
  return {mesh, Partition<Dim>(*mesh, n_patches_, rows)};
}

template class SharedCut<2>;
template class SharedCut<3>;

}  // namespace lahar
