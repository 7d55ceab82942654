/// \file Where patches are in lists that are sorted by their ids.
#pragma once

#include <algorithm>
#include <memory>
#include <vector>

#include "runtime/patches/patch_set.h"

namespace lahar {

/// Position of a patch in a list that is sorted by id; -1 = not there.
template <class List>
int position_of(const List& list, Index id, auto id_of) {
  const auto at = std::lower_bound(list.begin(), list.end(), id,
                                   [&](const auto& entry, Index i) { return id_of(entry) < i; });
  return at != list.end() && id_of(*at) == id ? static_cast<int>(at - list.begin()) : -1;
}
template <int Dim>
int position_of(const std::vector<std::unique_ptr<Patch<Dim>>>& patches, Index id) {
  return position_of(patches, id, [](const auto& patch) { return patch->topology.patch; });
}
template <int Dim>
int position_of(const std::vector<RemotePatch<Dim>>& patches, Index id) {
  return position_of(patches, id, [](const auto& patch) { return patch.patch; });
}
inline int position_of(const std::vector<Index>& ids, Index id) {
  return position_of(ids, id, [](Index i) { return i; });
}

}  // namespace lahar
