#include "physics/mesh/partition.h"

#include <doctest/doctest.h>

#include "physics/base/error.h"
#include "physics/mesh/partition_common.h"
#include "tests/physics/mesh/partition_checks.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// Cells of a patch of a grid of unit cells along each axis.
template <int Dim>
std::array<Index, Dim> extent(const Mesh<Dim>& mesh, const std::vector<Index>& cells) {
  Vec<Dim> low = mesh.geometry(cells[0]).centre, high = low;
  for (Index c : cells) {
    low = low.cwiseMin(mesh.geometry(c).centre);
    high = high.cwiseMax(mesh.geometry(c).centre);
  }
  std::array<Index, Dim> n;
  for (int d = 0; d < Dim; ++d) n[d] = std::llround(high[d] - low[d]) + 1;
  return n;
}

}  // namespace

TEST_CASE("a partition covers every cell once") {
  std::mt19937 random(31);
  for (Index target : {1, 7, 60, 100000}) {
    CAPTURE(target);
    const auto a = unit_grid<2>({23, 17});
    check_covers(a, Partition<2>(a, target));
    const auto b = unit_grid<3>({9, 5, 11});
    check_covers(b, Partition<3>(b, target));
    const auto c = shuffled<3>(distorted<3>(grid_tables<3>({6, 5, 7}), 0.1, random), random);
    const auto mesh = c.mesh(true);
    check_covers(mesh, Partition<3>(mesh, target));
  }
}

TEST_CASE("bricks are near-cubic, near the target and differ by one cell at most") {
  const auto mesh = unit_grid<3>({50, 70, 33});
  const Partition<3> partition(mesh, 512);
  std::array<Index, 3> least{99, 99, 99}, most{0, 0, 0};
  for (Index p = 0; p < partition.n_patches(); ++p) {
    const auto cells = partition.cells(p);
    const auto n = extent(mesh, cells);
    CHECK(n[0] * n[1] * n[2] == static_cast<Index>(cells.size()));
    for (int d = 0; d < 3; ++d) {
      least[d] = std::min(least[d], n[d]);
      most[d] = std::max(most[d], n[d]);
    }
  }
  for (int d = 0; d < 3; ++d) {
    CHECK(most[d] - least[d] <= 1);
    CHECK(least[d] >= 7);
    CHECK(most[d] <= 9);
  }
}

TEST_CASE("a mesh that is thin along an axis gets longer patches along the others") {
  const auto plate = unit_grid<3>({100, 100, 1});
  const Partition<3> a(plate, 500);
  for (Index p = 0; p < a.n_patches(); ++p) {
    const auto n = extent(plate, a.cells(p));
    CHECK(n[0] >= 18);
    CHECK(n[0] <= 27);
    CHECK(n[2] == 1);
  }
  const auto bar = unit_grid<3>({1000, 3, 2});
  const Partition<3> b(bar, 60);
  CHECK(b.n_patches() == 100);
  CHECK(b.cells(0).size() == 60);
}

TEST_CASE("consecutive patches of a square of bricks touch along a face") {
  const auto mesh = unit_grid<3>({64, 64, 64});
  const Partition<3> partition(mesh, 512);
  REQUIRE(partition.n_patches() == 512);
  for (Index p = 0; p + 1 < partition.n_patches(); ++p) {
    const auto a = partition.brick(p), b = partition.brick(p + 1);
    Index steps = 0;
    for (int d = 0; d < 3; ++d) steps += std::abs(a.low[d] - b.low[d]);
    CHECK(steps == 8);
  }
}

TEST_CASE("a regular grid in a table is cut into bricks, whatever the order of its cells") {
  std::mt19937 random(32);
  const auto mesh = shuffled<2>(grid_tables<2>({40, 24}), random).mesh(false);
  const Partition<2> partition(mesh, 64);
  CHECK(partition.n_patches() == 15);
  for (Index p = 0; p < partition.n_patches(); ++p) {
    const auto cells = partition.cells(p);
    const auto n = extent(mesh, cells);
    CHECK(n[0] * n[1] == static_cast<Index>(cells.size()));
    CHECK(n[0] <= 2 * n[1]);
    CHECK(n[1] <= 2 * n[0]);
  }
}

TEST_CASE("the cut is a function of the mesh: the same geometry is cut at the same places") {
  std::mt19937 random(33);
  const auto tables = distorted<2>(grid_tables<2>({20, 20}), 0.2, random);
  const auto first = tables.mesh(true), second = tables.mesh(true);
  const Partition<2> a(first, 30), b(second, 30);
  for (Index c = 0; c < first.n_cells(); ++c) CHECK(a.patch_of(c) == b.patch_of(c));
}

TEST_CASE("patches are neighbours exactly if their widened node sets meet") {
  std::mt19937 random(34);
  for (int rings : {0, 1, 2}) {
    CAPTURE(rings);
    const auto plain = unit_grid<2>({17, 11});
    check_neighbours(plain, Partition<2>(plain, 6), rings);
    const auto thin = unit_grid<3>({7, 1, 9});
    check_neighbours(thin, Partition<3>(thin, 2), rings);
    const auto table =
        shuffled<3>(distorted<3>(grid_tables<3>({5, 4, 5}), 0.1, random), random).mesh(true);
    check_neighbours(table, Partition<3>(table, 8), rings);
  }
}

TEST_CASE("a partition needs a positive number of cells per patch") {
  const auto mesh = unit_grid<2>({2, 2});
  CHECK_THROWS_WITH_AS(Partition<2>(mesh, 0), "0 cells per patch; at least 1 is needed",
                       InputError);
}

TEST_CASE("a mesh of a hundred million cells is cut at no cost per cell") {
  const auto mesh = unit_grid<3>({1000, 1000, 100});
  const Partition<3> partition(mesh, 100000);
  CHECK(partition.n_patches() > 900);
  CHECK(partition.patch_of(99999999) < partition.n_patches());
}
