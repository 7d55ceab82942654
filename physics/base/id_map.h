/// \file Rows of arrays that have entries for all ids, or for some.
#pragma once

#include <algorithm>
#include <utility>
#include <vector>

#include "physics/base/types.h"

namespace lahar {

/// Where in an array the entry of an id is, if it has one. Takes about 12 bytes per entry (nothing
/// where all ids have one) and constant time unless ids lie in very uneven clusters, when it is
/// logarithmic. Rows ascend with ids.
class IdMap {
 public:
  IdMap() = default;
  /// All of 0 to n - 1: the row is the id.
  static IdMap all(Index n) {
    IdMap map;
    map.all_ = n;
    return map;
  }
  /// Some ids, ascending, each once.
  static IdMap some(std::vector<Index> ids) {
    IdMap map;
    map.ids_ = std::move(ids);
    if (!map.ids_.empty()) map.make_blocks();
    return map;
  }

  Index size() const { return all_ >= 0 ? all_ : static_cast<Index>(ids_.size()); }
  Index id(Index row) const { return all_ >= 0 ? row : ids_[row]; }
  /// -1 if there is none.
  Index row(Index id) const {
    if (all_ >= 0) return id >= 0 && id < all_ ? id : -1;
    if (ids_.empty() || id < ids_.front() || id > ids_.back()) return -1;
    const Index block = (id - ids_.front()) >> shift_;
    const auto end = ids_.begin() + first_[block + 1];
    const auto at = std::lower_bound(ids_.begin() + first_[block], end, id);
    return at != end && *at == id ? at - ids_.begin() : -1;
  }
  std::size_t bytes() const {
    return ids_.capacity() * sizeof(Index) + first_.capacity() * sizeof(Local);
  }

 private:
  /// Ids from the first to the last in blocks of a power of two; no more blocks than ids.
  void make_blocks() {
    const Index range = ids_.back() - ids_.front();
    while ((range >> shift_) + 1 > size()) ++shift_;
    first_.assign((range >> shift_) + 2, 0);
    for (Index id : ids_) ++first_[((id - ids_.front()) >> shift_) + 1];
    for (std::size_t b = 1; b < first_.size(); ++b) first_[b] += first_[b - 1];
  }

  Index all_ = -1;
  std::vector<Index> ids_;
  int shift_ = 0;
  std::vector<Local> first_;  ///< row of the first id of each block
};

}  // namespace lahar
