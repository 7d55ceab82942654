// The cut of a mesh that several processes have shares of, and what each keeps of it.
#include "runtime/patches/shared_cut.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <numeric>
#include <random>

#include "physics/mesh/element_grid.h"
#include "tests/io/base/thread_team.h"

using namespace lahar;

namespace {

constexpr int teams[] = {2, 3, 4, 7};

// A grid with nodes out of their places; of cells in an order of their own, if `shuffled`.
template <int Dim>
Mesh<Dim> grid(Element element, const std::array<Index, Dim>& counts, double by, bool shuffled) {
  auto tables = element_grid<Dim>(element, Vec<Dim>::Zero(), Vec<Dim>::Ones(), counts);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> off(-by, by);
  for (auto& x : tables.nodes)
    for (int d = 0; d < Dim; ++d) x[d] += off(random);
  const auto per_cell = static_cast<std::size_t>(info(element).nodes);
  std::vector<std::size_t> order(tables.cells.size() / per_cell);
  std::iota(order.begin(), order.end(), std::size_t{0});
  if (shuffled) std::shuffle(order.begin(), order.end(), random);
  std::vector<Index> cells;
  for (const std::size_t c : order)
    for (std::size_t k = 0; k < per_cell; ++k) cells.push_back(tables.cells[c * per_cell + k]);
  return Mesh<Dim>::from_tables(tables.nodes, element, cells, true);
}

template <class T>
bool same(const std::vector<T>& a, const std::vector<T>& b) {
  return a == b;
}

// What a rank with some patches keeps must be what it would keep of the whole.
template <int Dim>
void check_around(const Mesh<Dim>& whole, const Partition<Dim>& partition,
                  const SharedCut<Dim>& cut, const std::vector<Index>& patches, int rings) {
  const auto [mesh, part] = cut.around(patches, rings);
  const auto cells = surrounding_cells(whole, partition, patches, rings);
  const Mesh<Dim> expected = whole.part(cells);
  bool alike = true;
  for (Index c = 0; c < whole.n_cells(); ++c) alike &= mesh->holds(c) == expected.holds(c);
  CHECK(alike);
  CHECK(same(mesh->pack(cells), expected.pack(cells)));
  const auto around = surrounding_patches(partition, patches, rings);
  for (Index p = 0; p < partition.n_patches(); ++p) {
    const bool held = std::binary_search(around.begin(), around.end(), p);
    CHECK(part.holds(p) == held);
    if (held) CHECK(same(part.cells(p), partition.cells(p)));
  }
}

template <int Dim>
void check_cut(const Mesh<Dim>& whole, Index target_cells, const std::vector<PatchSplit>& splits,
               int rings) {
  Partition<Dim> partition(whole, target_cells);
  partition.split(splits);
  for (const int size : teams) {
    CAPTURE(size);
    run_team(size, [&](const Team& team) {
      const Mesh<Dim> share = share_of(whole, team);
      SharedCut<Dim> cut(share, target_cells, team);
      cut.split(splits);
      CHECK(cut.n_patches() == partition.n_patches());
      std::vector<Index> cells(static_cast<std::size_t>(whole.n_cells()));
      std::iota(cells.begin(), cells.end(), Index{0});
      std::vector<Index> patch;
      for (const Index c : cells) patch.push_back(partition.patch_of(c));
      CHECK(same(cut.patches_of(cells), patch));
      std::vector<Index> own;  // the last rank has none
      for (Index p = 0; p < cut.n_patches(); ++p)
        if (p * (size - 1) / cut.n_patches() == team.index()) own.push_back(p);
      check_around(whole, partition, cut, own, rings);
    });
  }
}

}  // namespace

TEST_CASE("processes with shares of a mesh cut it as one does that has all of it") {
  check_cut<2>(grid<2>(Element::Q4, {40, 30}, 0.2, true), 20, {}, 0);
  check_cut<2>(grid<2>(Element::Q4, {40, 30}, 0, false), 37, {}, 1);  // layers are aligned
  check_cut<2>(grid<2>(Element::T6, {12, 9}, 0.05, false), 10, {}, 0);
  check_cut<3>(grid<3>(Element::H8, {9, 8, 7}, 0.15, true), 30, {}, 0);
  check_cut<3>(grid<3>(Element::Tet4, {5, 4, 3}, 0.02, true), 25, {}, 1);
  check_cut<2>(grid<2>(Element::Q4, {3, 1}, 0, false), 1, {}, 0);       // fewer cells than ranks
  check_cut<2>(grid<2>(Element::Q4, {9, 9}, 0.1, false), 1000, {}, 0);  // one patch
}

TEST_CASE("patches of shares are split as those of a whole mesh, and refused alike") {
  const auto mesh = grid<2>(Element::Q4, {40, 30}, 0.2, true);
  const Partition<2> partition(mesh, 100);
  const std::vector<Index> cells = partition.cells(3);
  const auto right = *std::max_element(cells.begin(), cells.end(), [&](Index a, Index b) {
    return mesh.cell_centre(a).x() < mesh.cell_centre(b).x();
  });
  check_cut<2>(mesh, 100, {{3, 0, right}, {0, 1, partition.cells(0)[40]}, {4, 1, cells[50]}}, 0);
  const auto left = *std::min_element(cells.begin(), cells.end(), [&](Index a, Index b) {
    return mesh.cell_centre(a).x() < mesh.cell_centre(b).x();
  });
  for (const PatchSplit& bad :
       {PatchSplit{3, 0, left}, PatchSplit{2, 0, right}, PatchSplit{30, 0, right},
        PatchSplit{3, 2, right}, PatchSplit{3, 0, 1200}})
    run_team(3, [&](const Team& team) {
      const Mesh<2> share = share_of(mesh, team);
      SharedCut<2> cut(share, 100, team);
      CHECK_THROWS_AS(cut.split(std::vector{bad}), std::invalid_argument);
    });
}
