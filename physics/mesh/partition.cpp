/// \file Cutting a mesh into patches: bricks of a structured mesh, bisection of cell centres
/// otherwise.
#include "physics/mesh/partition.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <numeric>

#include "physics/base/bisection.h"
#include "physics/base/error.h"
#include "physics/mesh/partition_common.h"

namespace lahar {
namespace {

/// `cells` in a row cut into `parts`: the first cells % parts of them are one cell longer.
Index part_begin(Index cells, Index parts, Index part) {
  return part * (cells / parts) + std::min(part, cells % parts);
}

Index part_of(Index cells, Index parts, Index cell) {
  const Index width = cells / parts, longer = cells % parts;
  const Index in_longer = longer * (width + 1);
  return cell < in_longer ? cell / (width + 1) : longer + (cell - in_longer) / width;
}

/// Bricks per axis such that a brick has about `target` cells and edges as equal as the mesh
/// allows: an axis with fewer cells than the ideal edge is not cut, and the others make up for it.
template <int Dim>
std::array<Index, Dim> choose_bricks(const std::array<Index, Dim>& counts, Index target) {
  std::array<Index, Dim> bricks;
  bricks.fill(0);
  double remaining = static_cast<double>(target);
  int open = Dim;
  for (bool changed = true; changed && open > 0;) {
    changed = false;
    const double edge = std::pow(remaining, 1.0 / open);
    for (int d = 0; d < Dim; ++d) {
      if (bricks[d] > 0 || static_cast<double>(counts[d]) > edge) continue;
      bricks[d] = 1;
      remaining /= static_cast<double>(counts[d]);
      --open;
      changed = true;
      break;  // with a new ideal edge
    }
  }
  for (int d = 0; d < Dim; ++d) {
    if (bricks[d] > 0) continue;
    const double edge = std::pow(remaining, 1.0 / open);
    bricks[d] = std::max<Index>(1, std::llround(static_cast<double>(counts[d]) / edge));
  }
  return bricks;
}

}  // namespace

template <int Dim>
Partition<Dim>::Partition(const Mesh<Dim>& mesh, Index target_cells) : mesh_(&mesh) {
  if (target_cells <= 0)
    throw InputError(fmt::format("{} cells per patch; at least 1 is needed", target_cells));
  if (mesh.is_structured()) {
    cut_bricks(target_cells);
  } else {
    cut_cells(target_cells);
  }
}

template <int Dim>
void Partition<Dim>::cut_bricks(Index target_cells) {
  counts_ = mesh_->counts();
  bricks_ = choose_bricks<Dim>(counts_, target_cells);
  Index n = 1, most = 1;
  for (Index b : bricks_) n *= b, most = std::max(most, b);
  const int bits = std::bit_width(static_cast<std::uint64_t>(most - 1));
  std::vector<std::uint64_t> along(n);
  for (Index b = 0; b < n; ++b) {
    std::array<std::uint64_t, Dim> p;
    const auto position = brick_position(b);
    std::copy(position.begin(), position.end(), p.begin());
    along[b] = hilbert_position<Dim>(p, bits);
  }
  patch_to_brick_.resize(n);
  std::iota(patch_to_brick_.begin(), patch_to_brick_.end(), Index{0});
  std::sort(patch_to_brick_.begin(), patch_to_brick_.end(),
            [&](Index a, Index b) { return along[a] < along[b]; });
  brick_to_patch_.resize(n);
  for (Index p = 0; p < n; ++p) brick_to_patch_[patch_to_brick_[p]] = p;
}

template <int Dim>
void Partition<Dim>::cut_cells(Index target_cells) {
  const Index n = mesh_->n_cells(), parts = bisection_parts(n, target_cells);
  std::vector<Vec<Dim>> centre(n);
  for (Index c = 0; c < n; ++c) centre[c] = mesh_->cell_centre(c).cwiseQuotient(mesh_->mean_cell());
  Bisection<Dim>(std::move(centre)).cut(parts, first_cell_, cells_);
  n_patches_ = parts;
  patch_ids_ = IdMap::all(parts);
  cell_ids_ = IdMap::all(n);
  note_patches();
}

/// Fill patch_of_cell_ from the cells of the patches.
template <int Dim>
void Partition<Dim>::note_patches() {
  patch_of_cell_.resize(cells_.size());
  for (Index row = 0; row < patch_ids_.size(); ++row)
    for (Index i = first_cell_[row]; i < first_cell_[row + 1]; ++i)
      patch_of_cell_[cell_ids_.row(cells_[i])] = static_cast<Local>(patch_ids_.id(row));
}

template <int Dim>
Index Partition<Dim>::n_patches() const {
  return mesh_->is_structured() ? static_cast<Index>(patch_to_brick_.size()) : n_patches_;
}

template <int Dim>
std::array<Index, Dim> Partition<Dim>::brick_position(Index brick) const {
  std::array<Index, Dim> p;
  for (int d = 0; d < Dim; ++d) {
    p[d] = brick % bricks_[d];
    brick /= bricks_[d];
  }
  return p;
}

template <int Dim>
typename Partition<Dim>::Brick Partition<Dim>::brick(Index patch) const {
  const Index brick = patch_to_brick_[patch];
  if (const auto parts = parts_.find(brick); parts != parts_.end())
    return parts->second[patch - brick_to_patch_[brick]];
  return whole_brick(brick);
}

template <int Dim>
typename Partition<Dim>::Brick Partition<Dim>::whole_brick(Index brick) const {
  const auto p = brick_position(brick);
  Brick b;
  for (int d = 0; d < Dim; ++d) {
    b.low[d] = part_begin(counts_[d], bricks_[d], p[d]);
    b.high[d] = part_begin(counts_[d], bricks_[d], p[d] + 1);
  }
  return b;
}

template <int Dim>
Index Partition<Dim>::patch_of(Index cell) const {
  if (!mesh_->is_structured()) {
    const Index row = cell_ids_.row(cell);
    return row < 0 ? -1 : patch_of_cell_[row];
  }
  Index brick = 0, stride = 1;
  std::array<Index, Dim> position;
  for (int d = 0; d < Dim; ++d) {
    position[d] = cell % counts_[d];
    brick += stride * part_of(counts_[d], bricks_[d], position[d]);
    cell /= counts_[d];
    stride *= bricks_[d];
  }
  const Index first = brick_to_patch_[brick];
  if (parts_.empty()) return first;
  const auto parts = parts_.find(brick);
  if (parts == parts_.end()) return first;
  const auto holds = [&](const Brick& part) {
    for (int d = 0; d < Dim; ++d)
      if (position[d] < part.low[d] || position[d] >= part.high[d]) return false;
    return true;
  };
  return first + (std::ranges::find_if(parts->second, holds) - parts->second.begin());
}

template <int Dim>
std::vector<Index> Partition<Dim>::cells(Index patch) const {
  if (mesh_->is_structured()) return cells_in(brick(patch));
  const auto row = row_of(patch);
  return {row.begin(), row.end()};
}

template <int Dim>
std::span<const Local> Partition<Dim>::row_of(Index patch) const {
  const Index row = patch_ids_.row(patch);
  assert(row >= 0 && "the patch is in another part of the partition");
  return {cells_.data() + first_cell_[row], cells_.data() + first_cell_[row + 1]};
}

template <int Dim>
std::vector<Index> Partition<Dim>::cells_in(const Brick& b) const {
  std::vector<Index> cells;
  auto ijk = b.low;
  for (bool more = true; more;) {
    Index id = 0;
    for (int d = Dim - 1; d >= 0; --d) id = id * counts_[d] + ijk[d];
    cells.push_back(id);
    int d = 0;
    while (d < Dim && ++ijk[d] == b.high[d]) ijk[d] = b.low[d], ++d;
    more = d < Dim;
  }
  return cells;
}

template <int Dim>
std::vector<Index> Partition<Dim>::neighbours(Index patch, int rings) const {
  // Nodes of two bricks, each widened by rings, meet if at most 2 rings cells lie between them.
  std::vector<Index> patches = mesh_->is_structured()
                                   ? patches_near(brick(patch), 2 * Index{rings} + 1)
                                   : near_patches(patch, rings);
  sort_unique(patches);
  patches.erase(std::lower_bound(patches.begin(), patches.end(), patch));
  return patches;
}

template <int Dim>
std::vector<Index> Partition<Dim>::patches_near(const Brick& cells, Index distance) const {
  std::array<Index, Dim> from, to;
  for (int d = 0; d < Dim; ++d) {
    const Index before = std::max<Index>(cells.low[d] - distance, 0);
    const Index after = std::min(cells.high[d] - 1 + distance, counts_[d] - 1);
    from[d] = part_of(counts_[d], bricks_[d], before);
    to[d] = part_of(counts_[d], bricks_[d], after);
  }
  const auto is_near = [&](const Brick& part) {
    for (int d = 0; d < Dim; ++d)
      if (part.high[d] - 1 < cells.low[d] - distance || part.low[d] > cells.high[d] - 1 + distance)
        return false;
    return true;
  };
  std::vector<Index> patches;
  const auto add_near = [&](Index brick) {
    const Index first = brick_to_patch_[brick];
    const auto parts = parts_.find(brick);
    if (parts == parts_.end()) return patches.push_back(first);
    for (std::size_t k = 0; k < parts->second.size(); ++k)
      if (is_near(parts->second[k])) patches.push_back(first + static_cast<Index>(k));
  };
  auto p = from;
  for (bool more = true; more;) {
    Index brick = 0;
    for (int d = Dim - 1; d >= 0; --d) brick = brick * bricks_[d] + p[d];
    add_near(brick);
    int d = 0;
    while (d < Dim && ++p[d] > to[d]) p[d] = from[d], ++d;
    more = d < Dim;
  }
  std::sort(patches.begin(), patches.end());
  return patches;
}

/// A patch widened by `rings` layers meets this one, widened likewise, if it has a cell that
/// touches this one widened by twice as many.
template <int Dim>
std::vector<Index> Partition<Dim>::near_patches(Index patch, int rings) const {
  std::vector<Index> patches = {patch};
  for (Index n : nodes_around<Dim>(*mesh_, cells(patch), 2 * rings))
    for (Index c : mesh_->node_cells(n))
      if (const Index p = patch_of(c); p >= 0 && p != patches.back()) patches.push_back(p);
  return patches;
}

// Members in partition_part.cpp and partition_split.cpp are instantiated there.
template class Partition<2>;
template class Partition<3>;

}  // namespace lahar
