/// \file What has to hold for every partition.
#pragma once

#include <doctest/doctest.h>

#include <algorithm>
#include <set>
#include <vector>

#include "physics/mesh/partition.h"
#include "tests/physics/mesh/mesh_fixtures.h"

namespace lahar::test {

/// Every cell in exactly one patch, and cells() and patch_of() agree.
template <int Dim>
void check_covers(const Mesh<Dim>& mesh, const Partition<Dim>& partition) {
  std::vector<int> seen(mesh.n_cells(), 0);
  bool agree = true;
  for (Index p = 0; p < partition.n_patches(); ++p) {
    const auto cells = partition.cells(p);
    CHECK_FALSE(cells.empty());
    CHECK(std::is_sorted(cells.begin(), cells.end()));
    for (Index c : cells) ++seen[c], agree &= partition.patch_of(c) == p;
  }
  CHECK(agree);
  CHECK(std::all_of(seen.begin(), seen.end(), [](int n) { return n == 1; }));
}

/// neighbours() against the intersection of all pairs of node sets.
template <int Dim>
void check_neighbours(const Mesh<Dim>& mesh, const Partition<Dim>& partition, int rings) {
  std::vector<std::set<Index>> nodes;
  for (Index p = 0; p < partition.n_patches(); ++p)
    nodes.push_back(widened_nodes(mesh, partition.cells(p), rings));
  for (Index p = 0; p < partition.n_patches(); ++p) {
    std::vector<Index> expected;
    for (Index q = 0; q < partition.n_patches(); ++q) {
      const bool meet = std::any_of(nodes[p].begin(), nodes[p].end(),
                                    [&](Index n) { return nodes[q].contains(n); });
      if (meet && q != p) expected.push_back(q);
    }
    CHECK(partition.neighbours(p, rings) == expected);
  }
}

template <int Dim>
Mesh<Dim> unit_grid(const std::array<Index, Dim>& counts) {
  return Mesh<Dim>::structured(Vec<Dim>::Zero(), Vec<Dim>::Ones(), counts);
}

}  // namespace lahar::test
