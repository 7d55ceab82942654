/// \file Patches of a partition that are split.
#include <algorithm>
#include <stdexcept>
#include <tuple>

#include "physics/mesh/partition.h"

namespace lahar {
namespace {

[[noreturn]] void refuse() {
  throw std::invalid_argument("a split is not one of this partition");
}

void check_range(const PatchSplit& split, Index n_patches, int dim) {
  if (split.patch < 0 || split.patch >= n_patches || split.axis < 0 || split.axis >= dim) refuse();
}

}  // namespace

template <int Dim>
void Partition<Dim>::split(std::span<const PatchSplit> splits) {
  if (splits.empty()) return;
  Partition result(*this);
  if (mesh_->is_structured())
    result.split_bricks(splits);
  else
    result.split_rows(splits);
  *this = std::move(result);
}

template <int Dim>
void Partition<Dim>::split_bricks(std::span<const PatchSplit> splits) {
  for (const PatchSplit& split : splits) {
    check_range(split, n_patches(), Dim);
    const Index brick = patch_to_brick_[split.patch];
    const auto own = patch_to_brick_.begin() + split.patch;
    Index part = 0;  // of the brick: its patches follow each other
    while (part < split.patch && *(own - part - 1) == brick) ++part;
    auto& parts = parts_.try_emplace(brick, 1, whole_brick(brick)).first->second;
    Brick lower = parts[part], upper = lower;
    if (split.at <= lower.low[split.axis] || split.at >= lower.high[split.axis]) refuse();
    lower.high[split.axis] = upper.low[split.axis] = split.at;
    parts[part] = lower;
    parts.insert(parts.begin() + part + 1, upper);
    patch_to_brick_.insert(own + 1, brick);
  }
  for (Index p = n_patches(); p-- > 0;) brick_to_patch_[patch_to_brick_[p]] = p;
}

template <int Dim>
void Partition<Dim>::split_rows(std::span<const PatchSplit> splits) {
  struct Row {
    Index patch;
    std::vector<Local> cells;
  };
  std::vector<Row> rows;
  for (Index r = 0; r < patch_ids_.size(); ++r) {
    const auto cells = row_of(patch_ids_.id(r));
    rows.push_back({patch_ids_.id(r), {cells.begin(), cells.end()}});
  }
  for (const PatchSplit& split : splits) {
    check_range(split, n_patches_, Dim);
    ++n_patches_;
    auto row = std::ranges::lower_bound(rows, split.patch, {}, &Row::patch);
    const bool held = row != rows.end() && row->patch == split.patch;
    if (held) {
      if (!std::ranges::binary_search(row->cells, split.at)) refuse();
      const auto place = [&](Index cell) {
        return std::tuple(mesh_->cell_centre(cell)[split.axis], cell);
      };
      Row upper{split.patch, {}};
      const auto first = place(split.at);
      for (const Local cell : row->cells)
        if (place(cell) >= first) upper.cells.push_back(cell);
      std::erase_if(row->cells, [&](Local cell) { return place(cell) >= first; });
      if (row->cells.empty()) refuse();
      row = rows.insert(row + 1, std::move(upper));
    }
    for (; row != rows.end(); ++row) ++row->patch;
  }
  std::vector<std::pair<Index, std::span<const Local>>> held;
  for (const Row& row : rows) held.emplace_back(row.patch, row.cells);
  hold(held);
}

template class Partition<2>;
template class Partition<3>;

}  // namespace lahar
