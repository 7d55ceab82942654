#include <doctest/doctest.h>

#include <numeric>
#include <stdexcept>

#include "physics/particles/patch_split.h"
#include "tests/physics/mesh/part_fixtures.h"
#include "tests/physics/mesh/partition_checks.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// Particles in every cell of a mesh: few, but in some cells very many.
std::vector<Index> random_particles(Index cells, std::mt19937& random) {
  std::vector<Index> particles;
  for (Index c = 0; c < cells; ++c)
    particles.push_back(random() % 7 == 0 ? random() % 900 : random() % 3);
  return particles;
}

template <int Dim>
std::vector<Index> in_patch(const Partition<Dim>& cut, Index patch,
                            const std::vector<Index>& particles) {
  std::vector<Index> own;
  for (const Index cell : cut.cells(patch)) own.push_back(particles[cell]);
  return own;
}

/// The cuts of all patches, the last patches first.
template <int Dim>
std::vector<PatchSplit> splits_of(const Mesh<Dim>& mesh, const Partition<Dim>& cut,
                                  const std::vector<Index>& particles, Index most) {
  std::vector<PatchSplit> splits;
  for (Index p = cut.n_patches(); p-- > 0;) {
    const auto own = choose_splits<Dim>(mesh, cut, p, in_patch(cut, p, particles), most);
    splits.insert(splits.end(), own.begin(), own.end());
  }
  return splits;
}

template <int Dim>
void check_splits(const Mesh<Dim>& mesh, Index target, std::mt19937& random) {
  constexpr Index most = 1000;
  const Partition<Dim> before(mesh, target);
  Partition<Dim> cut = before;
  const std::vector<Index> particles = random_particles(mesh.n_cells(), random);
  const auto splits = splits_of(mesh, before, particles, most);
  REQUIRE(splits.size() > 2);
  cut.split(splits);
  CHECK(cut.n_patches() == before.n_patches() + static_cast<Index>(splits.size()));
  check_covers(mesh, cut);
  for (const int rings : {0, 1}) check_neighbours(mesh, cut, rings);

  int crowded = 0, empty = 0, disordered = 0;
  Index last = -1;
  for (Index p = 0; p < cut.n_patches(); ++p) {
    const std::vector<Index> own = in_patch(cut, p, particles);
    const Index n = std::accumulate(own.begin(), own.end(), Index{0});
    const auto filled = std::count_if(own.begin(), own.end(), [](Index k) { return k > 0; });
    crowded += n > most && filled > 1;
    empty += n == 0;
    // Parts lie where the patch was.
    const Index parent = before.patch_of(cut.cells(p).front());
    for (const Index cell : cut.cells(p)) disordered += before.patch_of(cell) != parent;
    disordered += parent < last;
    last = parent;
  }
  CHECK(crowded == 0);
  CHECK(empty == 0);  // none of those before were
  CHECK(disordered == 0);

  // The same in two portions, the second of which splits parts again.
  Partition<Dim> again = before;
  again.split(splits_of(mesh, before, particles, 3 * most));
  again.split(splits_of(mesh, again, particles, most));
  check_covers(mesh, again);
  check_neighbours(mesh, again, 0);
}

template <int Dim>
void check_parts(const Mesh<Dim>& mesh, Index target, int rings, std::mt19937& random) {
  const Partition<Dim> before(mesh, target);
  const auto splits =
      splits_of(mesh, before, random_particles(mesh.n_cells(), random), Index{1500});
  REQUIRE(splits.size() > 2);
  Partition<Dim> cut = before;
  cut.split(splits);
  for (const auto& own : random_owners(before.n_patches(), 3, random)) {
    Part<Dim> part(mesh, before, own, rings);
    part.partition.split(splits);
    CHECK(part.partition.n_patches() == cut.n_patches());
    int wrong = 0;
    for (Index c = 0; c < mesh.n_cells(); ++c) {
      const Index patch = part.partition.patch_of(c);
      wrong += patch >= 0 && patch != cut.patch_of(c);
    }
    for (Index p = 0; p < cut.n_patches(); ++p) {
      const Index parent = before.patch_of(cut.cells(p).front());
      if (!std::binary_search(own.begin(), own.end(), parent)) continue;
      const std::vector<Index> one = {p};
      wrong += part.partition.cells(p) != cut.cells(p);
      wrong += part.partition.neighbours(p, rings) != cut.neighbours(p, rings);
      wrong += surrounding_cells(part.mesh, part.partition, one, rings) !=
               surrounding_cells(mesh, cut, one, rings);
    }
    CHECK(wrong == 0);
  }
}

}  // namespace

TEST_CASE("split patches cover every cell once and know their neighbours") {
  std::mt19937 random(71);
  check_splits(unit_grid<2>({24, 17}), 40, random);
  check_splits(unit_grid<3>({9, 8, 10}), 90, random);
  check_splits(shuffled<2>(grid_tables<2>({24, 17}), random).mesh(false), 40, random);
  check_splits(
      shuffled<3>(distorted<3>(grid_tables<3>({9, 8, 10}), 0.1, random), random).mesh(true), 90,
      random);
}

TEST_CASE("parts of a partition are split as the whole is") {
  std::mt19937 random(72);
  for (const Mesh<2>& mesh : sample_meshes<2>(random)) check_parts(mesh, 30, 1, random);
  for (const Mesh<3>& mesh : sample_meshes<3>(random)) check_parts(mesh, 100, 0, random);
}

TEST_CASE("a patch is cut where its particles are halved, across its longest side") {
  const auto mesh = unit_grid<2>({12, 4});
  const Partition<2> one(mesh, 1000);
  std::vector<Index> particles(48, 10);
  CHECK(choose_splits<2>(mesh, one, 0, particles, 480).empty());
  CHECK(choose_splits<2>(mesh, one, 0, particles, 479) ==
        std::vector<PatchSplit>{{.patch = 0, .axis = 0, .at = 6}});
  // Nearly all in the two lower rows: a third of the cells beyond one of the cuts.
  for (std::size_t c = 0; c < 24; ++c) particles[c] = c % 12 < 4 ? 100 : 0;
  CHECK(choose_splits<2>(mesh, one, 0, particles, 900).front().axis == 0);
  CHECK(choose_splits<2>(mesh, one, 0, particles, 900).front().at == 2);
  // One column, then one cell.
  particles.assign(48, 0);
  for (const std::size_t row : {0, 1, 2, 3}) particles[12 * row + 5] = 25;
  CHECK(choose_splits<2>(mesh, one, 0, particles, 50) ==
        std::vector<PatchSplit>{{.patch = 0, .axis = 1, .at = 2}});
  CHECK(choose_splits<2>(mesh, one, 0, particles, 1).size() == 3);
  particles.assign(48, 0);
  particles[17] = 1'000'000;
  CHECK(choose_splits<2>(mesh, one, 0, particles, 1).empty());
}

TEST_CASE("cuts that are not of the partition are refused and change nothing") {
  std::mt19937 random(73);
  const auto grid = unit_grid<2>({8, 8});
  const auto table = grid_tables<2>({8, 8}).mesh(false);
  for (const Mesh<2>* mesh : {&grid, &table}) {
    Partition<2> cut(*mesh, 16);
    const Index patches = cut.n_patches();
    const Index inner = mesh == &grid ? cut.brick(0).low[0] + 1 : cut.cells(0).back();
    for (const PatchSplit& bad :
         {PatchSplit{-1, 0, inner}, PatchSplit{patches + 1, 0, inner}, PatchSplit{0, 2, inner},
          PatchSplit{0, -1, inner}, PatchSplit{0, 0, -3}, PatchSplit{0, 0, 1'000'000},
          PatchSplit{0, 0, mesh == &grid ? cut.brick(0).low[0] : cut.cells(0).front()}}) {
      const std::vector<PatchSplit> splits = {{0, 0, inner}, bad};
      CHECK_THROWS_AS(cut.split(std::span(splits).last(1)), std::invalid_argument);
      CHECK(cut.n_patches() == patches);
    }
    const std::vector<PatchSplit> splits = {{0, 0, inner}, {0, 5, inner}};
    CHECK_THROWS_AS(cut.split(splits), std::invalid_argument);
    CHECK(cut.n_patches() == patches);
    cut.split(std::span(splits).first(1));
    CHECK(cut.n_patches() == patches + 1);
  }
}
