#include <doctest/doctest.h>

#include <cmath>

#include "physics/mesh/inverse_mapping.h"
#include "tests/physics/mesh/mesh_fixtures.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// Mesh::locate by asking every cell.
template <int Dim>
Index locate_by_force(const Mesh<Dim>& mesh, const Vec<Dim>& x) {
  for (Index c = 0; c < mesh.n_cells(); ++c)
    if (mesh.natural_coordinates(c, x)) return c;
  for (Index c = 0; c < mesh.n_cells(); ++c) {
    Vec<Dim> xi;
    if (inverse_map<Dim>(mesh.geometry(c), x, xi) && xi.cwiseAbs().maxCoeff() <= 1 + 1e-10)
      return c;
  }
  return -1;
}

/// The rule of the input format: own cell, else neighbours by id, else all cells by id.
template <int Dim>
Index locate_from_by_force(const Mesh<Dim>& mesh, const Vec<Dim>& x, Index cell) {
  if (mesh.natural_coordinates(cell, x)) return cell;
  for (Index c : mesh.neighbours(cell))
    if (mesh.natural_coordinates(c, x)) return c;
  return locate_by_force(mesh, x);
}

/// Points anywhere in and around the mesh, and points on faces, edges and corners of cells.
template <int Dim>
std::vector<Vec<Dim>> points(const Mesh<Dim>& mesh, std::mt19937& random, int n) {
  const auto [low, high] = mesh.bounds();
  const Vec<Dim> margin = 0.05 * (high - low);
  std::vector<Vec<Dim>> x;
  for (int i = 0; i < n; ++i) {
    x.push_back(random_point<Dim>(random, low - margin, high + margin));
    Vec<Dim> xi = random_point<Dim>(random, -Vec<Dim>::Ones(), Vec<Dim>::Ones());
    for (int d = 0; d < Dim; ++d)
      if (uniform(random, 0, 1) < 0.6) xi[d] = xi[d] > 0 ? 1.0 : -1.0;
    const Index cell = static_cast<Index>(random() % mesh.n_cells());
    x.push_back(to_physical<Dim>(mesh.geometry(cell), xi));
  }
  return x;
}

template <int Dim>
void check_rule(const Mesh<Dim>& mesh, std::mt19937& random, int n = 150) {
  int wrong = 0, outside = 0;
  for (const Vec<Dim>& x : points<Dim>(mesh, random, n)) {
    const auto found = mesh.locate(x);
    wrong += found.cell != locate_by_force(mesh, x);
    outside += found.cell < 0;
    if (found.cell >= 0) {
      const Vec<Dim> back = to_physical<Dim>(mesh.geometry(found.cell), found.xi);
      wrong += (back - x).norm() > 1e-9;
    }
    // From the cell itself, from next to it and from anywhere.
    std::vector<Index> from = {static_cast<Index>(random() % mesh.n_cells())};
    if (found.cell >= 0) {
      from = mesh.neighbours(found.cell);
      from.push_back(found.cell);
      from.push_back(static_cast<Index>(random() % mesh.n_cells()));
    }
    for (Index cell : from)
      wrong += mesh.locate_from(x, cell).cell != locate_from_by_force(mesh, x, cell);
  }
  CHECK(wrong == 0);
  CHECK(outside > 0);
  CHECK(outside < n);
}

}  // namespace

TEST_CASE("locating a particle by walking gives the cell of the rule: structured mesh") {
  std::mt19937 random(11);
  check_rule<2>(Mesh<2>::structured({0.1, -0.2}, {0.1, 0.3}, {9, 7}), random, 300);
  check_rule<3>(Mesh<3>::structured({-1, 0.1, 3}, {0.1, 0.3, 0.7}, {4, 5, 3}), random);
}

TEST_CASE("locating a particle by walking gives the cell of the rule: boxes from a table") {
  std::mt19937 random(12);
  check_rule<2>(tables_of(Mesh<2>::structured({0.1, 0}, {0.1, 0.3}, {8, 7})).mesh(false), random);
  check_rule<3>(tables_of(Mesh<3>::structured({0, 0, 0}, {0.1, 0.3, 1}, {4, 3, 4})).mesh(false),
                random);
}

TEST_CASE("locating a particle by walking gives the cell of the rule: shuffled and rotated ids") {
  std::mt19937 random(13);
  check_rule<2>(rotated_file_order<2>(shuffled<2>(grid_tables<2>({8, 7}), random)).mesh(false),
                random);
  check_rule<3>(rotated_file_order<3>(shuffled<3>(grid_tables<3>({4, 4, 3}), random)).mesh(false),
                random);
}

TEST_CASE("locating a particle by walking gives the cell of the rule: distorted cells") {
  std::mt19937 random(14);
  check_rule<2>(distorted<2>(shuffled<2>(grid_tables<2>({8, 7}), random), 0.22, random).mesh(true),
                random);
  check_rule<3>(
      distorted<3>(shuffled<3>(grid_tables<3>({3, 4, 3}), random), 0.18, random).mesh(true), random,
      100);
}

TEST_CASE("a structured mesh and the same mesh from a table place every particle alike") {
  std::mt19937 random(15);
  const auto plain = Mesh<3>::structured({0.3, -0.1, 7}, {0.1, 0.3, 0.7}, {5, 4, 3});
  const auto table = tables_of(plain).mesh(false);
  for (const Vec<3>& x : points<3>(plain, random, 500)) {
    const auto a = plain.locate(x), b = table.locate(x);
    CHECK(a.cell == b.cell);
    if (a.cell >= 0) CHECK(a.xi == b.xi);
  }
}

TEST_CASE("a particle on a face is placed in the lowest cell, and stays in its own") {
  const auto mesh = Mesh<2>::structured({0, 0}, {1, 1}, {3, 3});
  const Vec<2> corner(1, 1), face(1, 0.5);
  CHECK(mesh.locate(corner).cell == 0);
  CHECK(mesh.locate(face).cell == 0);
  CHECK(mesh.locate_from(face, 1).cell == 1);
  CHECK(mesh.locate_from(corner, 4).cell == 4);
  // From cell 5 all four cells around the corner are possible; 1 and 4 are neighbours of 5.
  CHECK(mesh.locate_from(corner, 5).cell == 1);
  // Far away: the lowest id again.
  CHECK(mesh.locate_from(corner, 8).cell == 4);
  CHECK(mesh.locate_from(Vec<2>(0, 1), 8).cell == 0);
}

TEST_CASE("a wall crossed by 1e-18 is no reason to lose a particle, one crossed by 1e-6 is") {
  std::mt19937 random(16);
  const auto plain = Mesh<2>::structured({0, 0}, {0.1, 0.1}, {10, 10});
  const auto table = shuffled<2>(tables_of(plain), random).mesh(false);
  auto skew_tables = tables_of(plain);
  for (Vec<2>& x : skew_tables.nodes) x[0] += 0.3 * x[1] + 0.1 * x[0] * x[1];
  const auto skew = skew_tables.mesh(true);
  for (const auto* mesh : {&plain, &table, &skew}) {
    CHECK(mesh->locate({0.55, -1e-18}).cell >= 0);
    CHECK(mesh->locate_from({0.55, -1e-18}, mesh->locate({0.55, 0.05}).cell).cell ==
          mesh->locate({0.55, 0.0}).cell);
    CHECK(mesh->locate({0.55, -1e-6}).cell == -1);
    CHECK(mesh->locate_from({0.55, -1e-6}, 0).cell == -1);
  }
  // Far from the origin the coordinates' own rounding counts as touching.
  const auto far = Mesh<2>::structured({1e6 + 0.1, 0}, {0.1, 1}, {10, 1});
  for (Index n = 0; n <= 10; ++n) CHECK(far.locate({far.node(n)[0], 0.5}).cell >= 0);
}

TEST_CASE("every point of a large structured mesh is found in constant time") {
  const auto mesh = Mesh<3>::structured({0, 0, 0}, {0.1, 0.1, 0.1}, {1000, 1000, 1000});
  CHECK(mesh.n_cells() == 1000000000);
  CHECK(mesh.locate({99.95, 99.95, 99.95}).cell == 999999999);
  CHECK(mesh.locate_from({99.95, 99.95, 99.95}, 0).cell == 999999999);
}
