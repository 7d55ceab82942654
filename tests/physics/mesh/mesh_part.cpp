#include <algorithm>
#include <stdexcept>

#include "physics/mesh/inverse_mapping.h"
#include "tests/physics/mesh/part_fixtures.h"

using namespace lahar;
using namespace lahar::test;

namespace {

template <int Dim>
bool same(const CellGeometry<Dim>& a, const CellGeometry<Dim>& b) {
  return a.centre == b.centre && a.length == b.length && a.corner == b.corner &&
         a.cartesian == b.cartesian;
}

template <int Dim>
std::vector<Index> held_of(std::vector<Index> cells, const Mesh<Dim>& part) {
  std::erase_if(cells, [&](Index c) { return !part.holds(c); });
  return cells;
}

/// Everything but the search.
template <int Dim>
void check_cells(const Mesh<Dim>& whole, const Mesh<Dim>& part, std::mt19937& random) {
  CHECK(part.n_cells() == whole.n_cells());
  CHECK(part.n_nodes() == whole.n_nodes());
  CHECK(part.is_cartesian() == whole.is_cartesian());
  CHECK(part.bounds() == whole.bounds());
  int wrong = 0;
  for (Index c : held_cells(part)) {
    wrong += part.cell_nodes(c) != whole.cell_nodes(c);
    wrong += part.cell_nodes_tensor(c) != whole.cell_nodes_tensor(c);
    wrong += !same(part.geometry(c), whole.geometry(c));
    wrong += part.cell_size(c) != whole.cell_size(c);
    wrong += part.cell_volume(c) != whole.cell_volume(c);
    wrong += part.neighbours(c) != held_of(whole.neighbours(c), part);
    for (Index n : whole.cell_nodes(c)) {
      wrong += part.node(n) != whole.node(n);
      wrong += part.node_cells(n) != held_of(whole.node_cells(n), part);
    }
    const Vec<Dim> xi = random_point<Dim>(random, -1.2 * Vec<Dim>::Ones(), 1.2 * Vec<Dim>::Ones());
    const Vec<Dim> x = to_physical<Dim>(whole.geometry(c), xi);
    wrong += part.natural_coordinates(c, x) != whole.natural_coordinates(c, x);
  }
  CHECK(wrong == 0);
}

/// A point that a particle of the cell may move to: in or beside the cell, often on the face, edge
/// or corner of a cell or a little beyond; now and then several cells away.
template <int Dim>
Vec<Dim> moved_to(const Mesh<Dim>& mesh, Index cell, std::mt19937& random) {
  const double far = random() % 4 == 0 ? 9.0 : 3.0;
  Vec<Dim> xi = random_point<Dim>(random, -far * Vec<Dim>::Ones(), far * Vec<Dim>::Ones());
  for (int d = 0; d < Dim; ++d)
    if (random() % 3 == 0) xi[d] = 2 * std::floor(0.5 * xi[d]) + 1;
  Vec<Dim> x = to_physical<Dim>(mesh.geometry(cell), xi);
  if (random() % 2 == 0) {  // exactly on a node, or beside it
    const auto around = mesh.neighbours(cell);
    x = mesh.node(mesh.cell_nodes(around[random() % around.size()])[random() % corners<Dim>]);
    const double beside = std::array{0.0, 1e-11, 2e-6}[random() % 3];
    x += beside * random_point<Dim>(random, -Vec<Dim>::Ones(), Vec<Dim>::Ones());
  }
  return x;
}

/// What kinds of points were met: the checks mean something only if all were.
struct Met {
  int found = 0, outside = 0, far_found = 0, far_unknown = 0;
};

/// Particles that leave a cell of a patch, as the whole mesh and as a part finds them.
template <int Dim>
int count_wrong(const Mesh<Dim>& whole, const Partition<Dim>& cut, const Part<Dim>& part,
                Index patch, std::mt19937& random, Met& met) {
  auto known = cut.neighbours(patch);
  known.push_back(patch);
  const auto is_known = [&](Index cell) {
    return cell >= 0 && std::count(known.begin(), known.end(), cut.patch_of(cell)) > 0;
  };
  int wrong = 0;
  for (Index cell : cut.cells(patch)) {
    for (int i = 0; i < 10; ++i) {
      const Vec<Dim> x = moved_to<Dim>(whole, cell, random);
      const auto expected = whole.locate_from(x, cell), found = part.mesh.locate_from(x, cell);
      const bool near = whole.is_near(x, cell);
      wrong += part.mesh.is_near(x, cell) != near;
      if (near || is_known(expected.cell)) {
        wrong += found.cell != expected.cell || found.xi != expected.xi;
        wrong += found.cell >= 0 && is_known(found.cell) &&
                 part.partition.patch_of(found.cell) != cut.patch_of(found.cell);
        ++(expected.cell < 0 ? met.outside : near ? met.found : met.far_found);
      } else {
        wrong += is_known(found.cell);
        ++met.far_unknown;
      }
    }
  }
  return wrong;
}

template <int Dim>
void check_parts(const Mesh<Dim>& whole, Index target, std::mt19937& random, Met& met) {
  const Partition<Dim> cut(whole, target);
  bool partial = false;
  for (const auto& own : random_owners(cut.n_patches(), 4, random)) {
    const Part<Dim> part(whole, cut, own, 0);
    partial |= held_cells(part.mesh).size() < 0.8 * static_cast<double>(whole.n_cells());
    check_cells(whole, part.mesh, random);
    int wrong = 0;
    for (Index patch : own) wrong += count_wrong(whole, cut, part, patch, random, met);
    CHECK(wrong == 0);
  }
  CHECK(partial);
}

template <int Dim>
void check_samples(unsigned seed, const std::vector<Index>& targets) {
  std::mt19937 random(seed);
  Met met;
  for (const auto& mesh : sample_meshes<Dim>(random))
    for (Index target : targets) check_parts<Dim>(mesh, target, random, met);
  CHECK(met.found > 1000);
  CHECK(met.outside > 1000);
  CHECK(met.far_found > 100);
  CHECK(met.far_unknown > 100);
}

}  // namespace

TEST_CASE("a part says of its cells, and of particles that leave them, what the whole mesh says") {
  check_samples<2>(51, {1, 5, 16});
  check_samples<3>(52, {8, 40});
}

TEST_CASE("a part takes memory for its cells, not for those of the whole mesh") {
  const auto bytes_of_part = [](const std::array<Index, 3>& counts) {
    const auto whole = grid_tables<3>(counts).mesh(true);
    std::vector<Index> cells;
    for (Index c = 0; c < 1000; ++c) cells.push_back(c);
    const auto part = whole.part(cells);
    const double per_cell = static_cast<double>(whole.bytes()) / whole.n_cells();
    CHECK(static_cast<double>(part.bytes()) / 1000 < 1.7 * per_cell);
    return part.bytes();
  };
  // The same thousand cells, of three thousand and of fifteen thousand.
  const double few = bytes_of_part({10, 10, 30}), many = bytes_of_part({10, 10, 150});
  CHECK(std::abs(many - few) < 0.01 * few);
  CHECK(grid_tables<3>({5, 5, 5}).mesh(true).part({}).bytes() < 100);
}

TEST_CASE("a part put together from pieces is the part made at once") {
  std::mt19937 random(53);
  for (const auto& whole : sample_meshes<3>(random)) {
    std::vector<Index> wanted, here, there;
    for (Index c = 0; c < whole.n_cells(); ++c) {
      const unsigned dice = random() % 8;
      if (dice < 6) wanted.push_back(c);
      if (dice < 3 || dice == 7) here.push_back(c);
      if (dice >= 2 && dice < 6) there.push_back(c);
    }
    const auto a = whole.part(here), b = whole.part(there);
    std::vector<Index> kept;
    std::set_intersection(here.begin(), here.end(), wanted.begin(), wanted.end(),
                          std::back_inserter(kept));
    const auto middle = there.begin() + static_cast<Index>(there.size() / 2);
    const auto built = a.part(
        kept, Pieces{b.pack({middle, there.end()}), b.pack({there.begin(), middle}), b.pack({})});
    const auto direct = whole.part(wanted);
    CHECK(held_cells(built) == wanted);
    CHECK(built.pack(wanted) == direct.pack(wanted));
    CHECK(built.bytes() == direct.bytes());
    check_cells(whole, built, random);
    const auto [low, high] = whole.bounds();
    int wrong = 0;
    for (int i = 0; i < 1000; ++i) {
      const Vec<3> x = random_point<3>(random, low, high);
      wrong += built.locate(x).cell != direct.locate(x).cell;
    }
    CHECK(wrong == 0);
  }
}

TEST_CASE("pieces of another mesh, and damaged ones, are refused") {
  const auto mesh = grid_tables<2>({4, 4}).mesh(true), other = grid_tables<2>({4, 5}).mesh(true);
  const auto part = mesh.part(std::vector<Index>{0, 1});
  const std::vector<Index> cells = {2, 3};
  CHECK_THROWS_WITH_AS(part.part({}, Pieces{other.pack(cells)}),
                       "cells from another rank are not of the same mesh", std::invalid_argument);
  auto bytes = mesh.pack(cells);
  bytes.pop_back();
  CHECK_THROWS_WITH_AS(part.part({}, Pieces{bytes}),
                       "bytes from another rank are cut off or not what was expected",
                       std::invalid_argument);
  bytes = mesh.pack(std::vector<Index>{3, 2});
  CHECK_THROWS_WITH_AS(part.part({}, Pieces{bytes}), "cells from another rank are damaged",
                       std::invalid_argument);
}

TEST_CASE("a structured mesh has no parts and packs nothing") {
  const auto mesh = Mesh<2>::structured({0, 0}, {1, 1}, {4, 4});
  const Partition<2> cut(mesh, 4);
  const Part<2> part(mesh, cut, {1}, 0);
  CHECK(part.mesh.holds(15));
  CHECK(part.mesh.locate({3.5, 3.5}).cell == 15);
  CHECK(part.mesh.bytes() == 0);
  CHECK(mesh.pack(std::vector<Index>{1}).empty());
  CHECK(part.partition.patch_of(15) == cut.patch_of(15));
  CHECK(cut.pack(std::vector<Index>{1}).empty());
}
