#include <stdexcept>

#include "tests/physics/mesh/part_fixtures.h"

using namespace lahar;
using namespace lahar::test;

namespace {

template <int Dim>
bool same_cells(const PatchTopology<Dim>& a, const PatchTopology<Dim>& b) {
  return a.patch == b.patch && a.cells == b.cells && a.nodes == b.nodes &&
         a.corner_nodes == b.corner_nodes;
}

template <int Dim>
void check_topology(const Mesh<Dim>& whole, Index target, int rings, std::mt19937& random) {
  const Partition<Dim> cut(whole, target);
  bool partial = false;
  for (const auto& own : random_owners(cut.n_patches(), 4, random)) {
    const Part<Dim> part(whole, cut, own, rings);
    const auto held = held_patches(part.partition);
    partial |= static_cast<Index>(held.size()) < cut.n_patches();
    CHECK(part.partition.n_patches() == cut.n_patches());
    CHECK(held == surrounding_patches(cut, own, rings));
    CHECK(surrounding_cells(part.mesh, part.partition, own, rings) == held_cells(part.mesh));
    int wrong = 0;
    for (Index c = 0; c < whole.n_cells(); ++c) {
      const Index patch = cut.patch_of(c);
      wrong += part.partition.patch_of(c) != (part.partition.holds(patch) ? patch : -1);
    }
    for (Index patch : held)
      wrong += !same_cells(make_topology(part.mesh, part.partition, patch, rings),
                           make_topology(whole, cut, patch, rings));
    for (Index patch : own) {
      wrong += part.partition.neighbours(patch, rings) != cut.neighbours(patch, rings);
      const std::vector<Index> one = {patch};
      wrong += surrounding_cells(part.mesh, part.partition, one, rings) !=
               surrounding_cells(whole, cut, one, rings);
    }
    CHECK(wrong == 0);
  }
  CHECK(partial);
}

/// Move patches between ranks at random, as a balancer would, and give each rank what it then needs
/// from what it keeps and what the former owners of its new patches send.
template <int Dim>
void check_moves(const Mesh<Dim>& whole, Index target, int rings, std::mt19937& random) {
  const Partition<Dim> cut(whole, target);
  const int ranks = 3;
  auto own = random_owners(cut.n_patches(), ranks, random);
  std::vector<std::unique_ptr<Part<Dim>>> parts;
  for (int r = 0; r < ranks; ++r)
    parts.push_back(std::make_unique<Part<Dim>>(whole, cut, own[r], rings));
  for (int round = 0; round < 3; ++round) {
    std::vector<std::vector<Index>> next(ranks), kept(ranks);
    std::vector<Pieces> cells(ranks), patches(ranks);
    for (int r = 0; r < ranks; ++r) {
      for (Index patch : own[r]) {
        // In the last round one rank gives everything away.
        const int to = round == 2 && r == 0 ? 1 : random() % 5 == 0 ? random() % ranks : r;
        next[to].push_back(patch);
        if (to == r) {
          kept[r].push_back(patch);
          continue;
        }
        const std::vector<Index> one = {patch};
        const Part<Dim>& from = *parts[r];
        cells[to].push_back(
            from.mesh.pack(surrounding_cells(from.mesh, from.partition, one, rings)));
        patches[to].push_back(from.partition.pack(surrounding_patches(from.partition, one, rings)));
      }
    }
    std::vector<std::unique_ptr<Part<Dim>>> moved;
    for (int r = 0; r < ranks; ++r) {
      std::sort(next[r].begin(), next[r].end());
      moved.push_back(std::make_unique<Part<Dim>>(*parts[r], kept[r], cells[r], patches[r], rings));
      const Part<Dim> direct(whole, cut, next[r], rings);
      const auto held = held_cells(direct.mesh);
      CHECK(held_cells(moved[r]->mesh) == held);
      CHECK(moved[r]->mesh.pack(held) == direct.mesh.pack(held));
      const auto known = held_patches(direct.partition);
      CHECK(held_patches(moved[r]->partition) == known);
      CHECK(moved[r]->partition.pack(known) == direct.partition.pack(known));
      CHECK(moved[r]->partition.bytes() == direct.partition.bytes());
    }
    parts = std::move(moved);
    own = std::move(next);
  }
}

}  // namespace

TEST_CASE("a part gives its patches the topology of the whole, and their neighbours the nodes") {
  std::mt19937 random(61);
  int rings = 0;  // alternately
  for (const auto& mesh : sample_meshes<2>(random)) check_topology<2>(mesh, 7, rings ^= 1, random);
  for (const auto& mesh : sample_meshes<3>(random)) check_topology<3>(mesh, 30, rings ^= 1, random);
}

TEST_CASE("ranks that pass patches on hold what they would have held from the start") {
  std::mt19937 random(62);
  int rings = 0;
  for (const auto& mesh : sample_meshes<2>(random)) check_moves<2>(mesh, 7, rings ^= 1, random);
  for (const auto& mesh : sample_meshes<3>(random)) check_moves<3>(mesh, 30, rings ^= 1, random);
}

TEST_CASE("patches of another partition, and damaged ones, are refused") {
  const auto mesh = grid_tables<2>({6, 6}).mesh(true);
  const Partition<2> cut(mesh, 6), other(mesh, 9);
  const std::vector<Index> two = {1, 2};
  CHECK_THROWS_WITH_AS(cut.part(mesh, {}, Pieces{other.pack(two)}),
                       "patches from another rank are not of the same partition",
                       std::invalid_argument);
  auto bytes = cut.pack(two);
  bytes.resize(bytes.size() - 4);
  CHECK_THROWS_AS(cut.part(mesh, {}, Pieces{bytes}), std::invalid_argument);
}
