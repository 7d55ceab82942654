/// \file Constraints and loads of the nodes of one patch.
#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "physics/model/model.h"
#include "physics/particles/patch.h"

namespace lahar {

/// The entries of a list sorted by node that belong to `node`.
template <class Entry>
std::span<const Entry> entries_at(const std::vector<Entry>& sorted, Index node) {
  const auto first = std::lower_bound(sorted.begin(), sorted.end(), node,
                                      [](const Entry& a, Index b) { return a.node < b; });
  const auto last = std::upper_bound(first, sorted.end(), node,
                                     [](Index a, const Entry& b) { return a < b.node; });
  return {first, last};
}

/// Sort what is said of nodes in the order in which set_constraints() looks for it.
template <int Dim>
void sort_constraints(NodeConditions<Dim>& conditions);

/// Say which cells are those of each body, where nodes and cells are repeated for bodies.
template <int Dim>
void set_bodies(Patch<Dim>& patch, const Model<Dim>& model);

/// Fill Patch::fixed, fixed_displacement, walls, forces and acting for the nodes of the patch, of
/// every body alike.
template <int Dim>
void set_constraints(Patch<Dim>& patch, const NodeConditions<Dim>& conditions, Index n_nodes);

extern template void sort_constraints(NodeConditions<2>&);
extern template void sort_constraints(NodeConditions<3>&);
extern template void set_bodies(Patch<2>&, const Model<2>&);
extern template void set_bodies(Patch<3>&, const Model<3>&);
extern template void set_constraints(Patch<2>&, const NodeConditions<2>&, Index);
extern template void set_constraints(Patch<3>&, const NodeConditions<3>&, Index);

}  // namespace lahar
