#include <doctest/doctest.h>

#include <algorithm>
#include <map>
#include <set>

#include "physics/mesh/partition.h"
#include "tests/physics/mesh/mesh_fixtures.h"

using namespace lahar;
using namespace lahar::test;

namespace {

template <int Dim>
std::vector<PatchTopology<Dim>> connected(const Mesh<Dim>& mesh, const Partition<Dim>& partition,
                                          const std::vector<Index>& ids, int rings) {
  std::vector<PatchTopology<Dim>> patches;
  for (Index p : ids) patches.push_back(make_topology(mesh, partition, p, rings));
  std::vector<PatchTopology<Dim>*> pointers;
  for (auto& p : patches) pointers.push_back(&p);
  connect<Dim>(pointers);
  return patches;
}

/// Nodes, corner numbers and shared lists against a count by brute force.
template <int Dim>
void check_topologies(const Mesh<Dim>& mesh, const Partition<Dim>& partition,
                      const std::vector<Index>& ids, int rings) {
  const auto patches = connected(mesh, partition, ids, rings);
  // (patch, local node) of every node, in ascending order of patches.
  std::map<Index, std::vector<std::pair<Index, Local>>> holders;
  for (const auto& patch : patches) {
    const std::set<Index> nodes = widened_nodes(mesh, patch.cells, rings);
    CHECK(patch.nodes == std::vector<Index>(nodes.begin(), nodes.end()));
    CHECK(patch.cells == partition.cells(patch.patch));
    for (std::size_t n = 0; n < patch.nodes.size(); ++n)
      holders[patch.nodes[n]].push_back({patch.patch, static_cast<Local>(n)});
    REQUIRE(patch.corner_nodes.size() == patch.cells.size());
    bool same = true;
    for (std::size_t c = 0; c < patch.cells.size(); ++c)
      for (int a = 0; a < corners<Dim>; ++a)
        same &= patch.nodes[patch.corner_nodes[c][a]] == mesh.cell_nodes_tensor(patch.cells[c])[a];
    CHECK(same);
  }
  Index owned = 0;
  for (const auto& patch : patches) {
    std::size_t shared = 0;
    bool same = true;
    for (std::size_t n = 0; n < patch.nodes.size(); ++n) {
      const auto& expected = holders[patch.nodes[n]];
      same &= bool(patch.owned[n]) == (expected[0].first == patch.patch);
      owned += patch.owned[n];
      if (expected.size() == 1) continue;
      REQUIRE(shared < patch.shared_node.size());
      same &= patch.shared_node[shared] == static_cast<Local>(n);
      std::vector<std::pair<Index, Local>> found;
      for (Local s = patch.first[shared]; s < patch.first[shared + 1]; ++s) {
        const auto share = patch.shares[s];
        found.push_back(
            {share.neighbour < 0 ? patch.patch : patch.neighbours[share.neighbour], share.node});
      }
      same &= found == expected;
      ++shared;
    }
    CHECK(same);
    CHECK(patch.shared_node.size() == shared);
    CHECK(patch.first.size() == shared + 1);
  }
  CHECK(owned == static_cast<Index>(holders.size()));
}

std::vector<Index> all(Index n) {
  std::vector<Index> ids(n);
  for (Index i = 0; i < n; ++i) ids[i] = i;
  return ids;
}

}  // namespace

TEST_CASE("every copy of a shared node has the same ascending list of its holders") {
  std::mt19937 random(41);
  for (int rings : {0, 1}) {
    CAPTURE(rings);
    const auto plain = Mesh<2>::structured({0, 0}, {1, 1}, {13, 10});
    const Partition<2> a(plain, 9);
    check_topologies(plain, a, all(a.n_patches()), rings);
    const auto cube = Mesh<3>::structured({0, 0, 0}, {1, 1, 1}, {6, 7, 5});
    const Partition<3> b(cube, 12);
    check_topologies(cube, b, all(b.n_patches()), rings);
    const auto table =
        shuffled<3>(distorted<3>(grid_tables<3>({5, 4, 6}), 0.1, random), random).mesh(true);
    const Partition<3> c(table, 10);
    check_topologies(table, c, all(c.n_patches()), rings);
  }
}

TEST_CASE("patches that are not there contribute nothing") {
  const auto mesh = Mesh<2>::structured({0, 0}, {1, 1}, {16, 16});
  const Partition<2> partition(mesh, 16);
  for (int rings : {0, 1}) {
    check_topologies(mesh, partition, {1, 2, 3, 7, 8, 12}, rings);
    const auto alone = connected(mesh, partition, {5}, rings);
    CHECK(alone[0].neighbours.empty());
    CHECK(alone[0].shared_node.empty());
  }
}

TEST_CASE("patches that are connected again among their neighbours alone are as before") {
  const auto mesh = Mesh<2>::structured({0, 0}, {1, 1}, {16, 16});
  const Partition<2> partition(mesh, 16);
  for (int rings : {0, 1}) {
    const auto whole = connected(mesh, partition, all(partition.n_patches()), rings);
    for (const Index again : {0, 5, 10}) {
      auto patches = whole;
      patches[static_cast<std::size_t>(again)] = make_topology(mesh, partition, again, rings);
      std::vector<PatchTopology<2>*> near;
      std::vector<char> fill;
      for (auto& patch : patches) {
        const auto around = partition.neighbours(again, rings);
        const bool is_near = std::binary_search(around.begin(), around.end(), patch.patch);
        if (patch.patch != again && !is_near) continue;
        near.push_back(&patch);
        fill.push_back(patch.patch == again);
      }
      REQUIRE(near.size() < patches.size());
      connect(near, fill);
      for (std::size_t p = 0; p < patches.size(); ++p) {
        CHECK(patches[p].neighbours == whole[p].neighbours);
        CHECK(patches[p].shared_node == whole[p].shared_node);
        CHECK(patches[p].first == whole[p].first);
        CHECK(patches[p].owned == whole[p].owned);
        REQUIRE(patches[p].shares.size() == whole[p].shares.size());
        bool same = true;
        for (std::size_t s = 0; s < whole[p].shares.size(); ++s)
          same &= patches[p].shares[s].neighbour == whole[p].shares[s].neighbour &&
                  patches[p].shares[s].node == whole[p].shares[s].node;
        CHECK(same);
      }
    }
  }
}

TEST_CASE("the neighbours of a patch after connecting are those with which it shares nodes") {
  const auto mesh = Mesh<2>::structured({0, 0}, {1, 1}, {16, 16});
  const Partition<2> partition(mesh, 16);
  const auto patches = connected(mesh, partition, all(partition.n_patches()), 1);
  for (const auto& patch : patches) {
    CHECK(patch.neighbours == partition.neighbours(patch.patch, 1));
    std::set<Index> sharing;
    for (const auto& share : patch.shares)
      if (share.neighbour >= 0) sharing.insert(patch.neighbours[share.neighbour]);
    CHECK(patch.neighbours == std::vector<Index>(sharing.begin(), sharing.end()));
  }
}
