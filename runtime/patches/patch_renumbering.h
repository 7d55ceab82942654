/// \file What becomes of the ids of patches when some are split.
#pragma once

#include <algorithm>
#include <utility>
#include <vector>

#include "physics/base/types.h"

namespace lahar {

class PatchRenumbering {
 public:
  PatchRenumbering() = default;
  /// The patch of every cut, by the ids before all cuts.
  explicit PatchRenumbering(std::vector<Index> cut) : cut_(std::move(cut)) {
    std::sort(cut_.begin(), cut_.end());
  }

  bool empty() const { return cut_.empty(); }  ///< nothing was split
  /// What was patch `id` are now patches first(id) to first(id + 1) - 1.
  Index first(Index id) const {
    return id + (std::lower_bound(cut_.begin(), cut_.end(), id) - cut_.begin());
  }
  bool is_split(Index id) const { return std::binary_search(cut_.begin(), cut_.end(), id); }
  /// New ids of what was split, ascending.
  std::vector<Index> parts() const {
    std::vector<Index> all;
    for (auto at = cut_.begin(); at != cut_.end(); at = std::upper_bound(at, cut_.end(), *at))
      for (Index id = first(*at); id < first(*at + 1); ++id) all.push_back(id);
    return all;
  }

 private:
  std::vector<Index> cut_;  ///< ascending
};

}  // namespace lahar
