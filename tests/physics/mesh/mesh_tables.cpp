#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

#include "physics/base/error.h"
#include "physics/mesh/inverse_mapping.h"
#include "tests/physics/mesh/mesh_fixtures.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// The messages with which a mesh is refused, with their hints.
template <class Make>
std::vector<std::string> messages(Make&& make) {
  try {
    make();
  } catch (const InputError& error) {
    std::vector<std::string> all;
    for (const Problem& p : error.problems())
      all.push_back(p.hint.empty() ? p.message : p.message + " | " + p.hint);
    return all;
  }
  return {};
}

template <int Dim>
std::vector<std::string> refused(const Tables<Dim>& t, bool isoparametric = true) {
  return messages([&] { t.mesh(isoparametric); });
}

using Text = std::vector<std::string>;

}  // namespace

TEST_CASE("corners in tensor order lie on the sides that their number says") {
  std::mt19937 random(21);
  for (const auto& mesh : {grid_tables<3>({2, 2, 2}).mesh(false),
                           rotated_file_order<3>(grid_tables<3>({2, 2, 2})).mesh(false),
                           rotated_file_order<3>(grid_tables<3>({2, 2, 2})).mesh(true),
                           Mesh<3>::structured({0, 0, 0}, {1, 1, 1}, {2, 2, 2})}) {
    for (Index c = 0; c < mesh.n_cells(); ++c) {
      const auto g = mesh.geometry(c);
      const auto nodes = mesh.cell_nodes_tensor(c);
      for (int a = 0; a < 8; ++a) {
        CHECK(g.corner[a] == mesh.node(nodes[a]));
        for (int d = 0; d < 3; ++d)
          CHECK(corner_sign(a, d) * (g.corner[a][d] - g.centre[d]) == 0.5);
      }
      auto file = mesh.cell_nodes(c), tensor = nodes;
      std::sort(file.begin(), file.end());
      std::sort(tensor.begin(), tensor.end());
      CHECK(file == tensor);
    }
  }
}

TEST_CASE("the file order of a published H8 mesh (0->1 along +y, 0->3 along -x) is understood") {
  // Corners of the unit cube in that order.
  const std::vector<Vec<3>> corner = {{1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 0},
                                      {1, 0, 1}, {1, 1, 1}, {0, 1, 1}, {0, 0, 1}};
  const Tables<3> t{corner, {{0, 1, 2, 3, 4, 5, 6, 7}}};
  const auto mesh = t.mesh(false);
  CHECK(mesh.cell_nodes_tensor(0) == Mesh<3>::Corners{3, 0, 2, 1, 7, 4, 6, 5});
  const auto xi = mesh.natural_coordinates(0, {0.75, 0.25, 0.5});
  REQUIRE(xi);
  CHECK(*xi == Vec<3>(0.5, -0.5, 0));
}

TEST_CASE("cells that are boxes to the last bit use the Cartesian map whatever the file says") {
  std::mt19937 random(22);
  CHECK(grid_tables<2>({3, 3}).mesh(true).is_cartesian());
  CHECK_FALSE(distorted<2>(grid_tables<2>({3, 3}), 1e-9, random).mesh(true).is_cartesian());
  CHECK(distorted<2>(grid_tables<2>({3, 3}), 1e-7, random).mesh(false).is_cartesian());
}

TEST_CASE("cells that share a node are neighbours") {
  std::mt19937 random(23);
  const auto plain = Mesh<3>::structured({0, 0, 0}, {1, 1, 1}, {3, 4, 2});
  const auto table = tables_of(plain).mesh(false);
  for (Index c = 0; c < plain.n_cells(); ++c) {
    std::vector<Index> expected;
    for (Index other = 0; other < plain.n_cells(); ++other) {
      bool share = false;
      for (Index a : plain.cell_nodes(c))
        for (Index b : plain.cell_nodes(other)) share |= a == b;
      if (share && other != c) expected.push_back(other);
    }
    CHECK(plain.neighbours(c) == expected);
    CHECK(table.neighbours(c) == expected);
  }
  for (Index n = 0; n < plain.n_nodes(); ++n) CHECK(plain.node_cells(n) == table.node_cells(n));
}

TEST_CASE("volumes of the cells of a distorted mesh add up to the volume that they fill") {
  std::mt19937 random(24);
  auto quads = grid_tables<2>({6, 5});
  for (auto& x : quads.nodes)
    if (x[0] > 0 && x[0] < 6 && x[1] > 0 && x[1] < 5)
      x += random_point<2>(random, {-0.2, -0.2}, {0.2, 0.2});
  auto bricks = grid_tables<3>({4, 3, 3});
  for (auto& x : bricks.nodes)
    if (x[0] > 0 && x[0] < 4 && x[1] > 0 && x[1] < 3 && x[2] > 0 && x[2] < 3)
      x += random_point<3>(random, {-0.2, -0.2, -0.2}, {0.2, 0.2, 0.2});
  const auto total = [](const auto& mesh) {
    double sum = 0;
    for (Index c = 0; c < mesh.n_cells(); ++c) sum += mesh.cell_volume(c);
    return sum;
  };
  CHECK(total(quads.mesh(true)) == doctest::Approx(30).epsilon(1e-14));
  CHECK(total(bricks.mesh(true)) == doctest::Approx(36).epsilon(1e-14));
  CHECK(Mesh<3>::structured({0, 0, 0}, {0.5, 0.25, 2}, {2, 2, 2}).cell_volume(3) == 0.25);
}

TEST_CASE("a frustum has the volume of the textbook") {
  // Square base of side 2, square top of side 1, height 3: h (A1 + A2 + sqrt(A1 A2)) / 3.
  const auto mesh = one_cell<3>({{-1, -1, 0},
                                 {1, -1, 0},
                                 {1, 1, 0},
                                 {-1, 1, 0},
                                 {-0.5, -0.5, 3},
                                 {0.5, -0.5, 3},
                                 {0.5, 0.5, 3},
                                 {-0.5, 0.5, 3}});
  CHECK(mesh.cell_volume(0) == doctest::Approx(7).epsilon(1e-14));
}

TEST_CASE("the size of a cell is the distance that a wave has to cross") {
  CHECK(Mesh<3>::structured({0, 0, 0}, {0.5, 0.25, 2}, {2, 2, 2}).cell_size(0) == 0.25);
  // A parallelogram of base 2 and height 1, sheared: the height, not the side.
  CHECK(one_cell<2>({{0, 0}, {2, 0}, {3, 1}, {1, 1}}).cell_size(0) == doctest::Approx(1));
  // A trapezoid with a short side: never above the shortest distance between nodes.
  CHECK(one_cell<2>({{0, 0}, {1, 0}, {0.51, 1}, {0.5, 1}}).cell_size(0) <= 0.01);
  // A cube rotated about z has the size of the cube.
  const double c = std::numbers::sqrt2 / 2;
  CHECK(one_cell<3>({{0, 0, 0},
                     {c, c, 0},
                     {0, 2 * c, 0},
                     {-c, c, 0},
                     {0, 0, 1},
                     {c, c, 1},
                     {0, 2 * c, 1},
                     {-c, c, 1}})
            .cell_size(0) == doctest::Approx(1));
}

TEST_CASE("nodes that no cell uses are accepted and do not extend the mesh") {
  auto t = grid_tables<2>({2, 1});
  t.nodes.push_back({100, 100});
  const auto mesh = t.mesh(true);
  CHECK(mesh.bounds().second == Vec<2>(2, 1));
  CHECK(mesh.node_cells(6).empty());
}

TEST_CASE("a structured mesh states its bounds and refuses sizes that make no sense") {
  const auto mesh = Mesh<2>::structured({1, 2}, {0.5, 0.25}, {4, 8});
  CHECK(mesh.bounds() == std::pair<Vec<2>, Vec<2>>({1, 2}, {3, 4}));
  CHECK(messages([] {
          Mesh<2>::structured({0, 0}, {1, -1}, {0, 3});
        }) == Text{"structured mesh: 0 cells along x; at least 1 is needed",
                   "structured mesh: the cell size along y is -1; it must be above 0"});
  CHECK(messages([] {
          Mesh<2>::structured({1e9, 0}, {1e-6, 1}, {2, 2});
        }) == Text{"structured mesh: cells of 1e-06 along x are lost in rounding at coordinates of "
                   "1e+09"});
}

TEST_CASE("every bad cell of a table is reported with its nodes and coordinates") {
  auto t = grid_tables<2>({3, 1});
  std::swap(t.cells[0][1], t.cells[0][3]);
  t.cells[1][2] = 17;
  t.cells[2][0] = t.cells[2][1];
  CHECK(refused(t) ==
        Text{"cell 0 is inverted at its corner at node 0: nodes 0 (0, 0), 4 (0, 1), 5 (1, 1), "
             "1 (1, 0) | list the corners counter-clockwise",
             "cell 1 has node 17, but the 8 nodes are numbered 0 to 7",
             "cell 2 has node 3 twice; a quadrilateral has 4 different nodes"});
}

TEST_CASE("flat cells, reflex corners and crossed hexahedra are refused") {
  Tables<2> flat{{{0, 0}, {1, 0}, {2, 0}, {3, 0}}, {{0, 1, 2, 3}}};
  CHECK(refused(flat) == Text{"cell 0 is flat at its corner at node 0: nodes 0 (0, 0), 1 (1, 0), "
                              "2 (2, 0), 3 (3, 0) | list the corners counter-clockwise"});
  Tables<2> reflex{{{0, 0}, {1, 0}, {0.1, 0.1}, {0, 1}}, {{0, 1, 2, 3}}};
  CHECK(refused(reflex) ==
        Text{"cell 0 is inverted at its corner at node 2: nodes 0 (0, 0), 1 (1, 0), 2 (0.1, 0.1), "
             "3 (0, 1) | list the corners counter-clockwise"});
  auto upside_down = grid_tables<3>({1, 1, 1});
  std::rotate(upside_down.cells[0].begin(), upside_down.cells[0].begin() + 4,
              upside_down.cells[0].end());
  const auto text = refused(upside_down);
  REQUIRE(text.size() == 1);
  CHECK(text[0].starts_with("cell 0 is inverted at its corner at node 4: nodes 4 (0, 0, 1), "));
  CHECK(text[0].ends_with(
      "| list the bottom face counter-clockwise seen from the top face, then the top"));
}

TEST_CASE("coordinates that are not numbers, empty tables and doubled cells are refused") {
  auto t = grid_tables<2>({1, 1});
  t.nodes[2][1] = std::numeric_limits<double>::quiet_NaN();
  CHECK(refused(t) == Text{"node 2 has coordinates (0, nan); they must be finite numbers"});
  t.nodes[2][1] = 1e308;
  CHECK(refused(t) == Text{"node 2 has coordinates (0, 1e+308); they must be at most 1e+50 m"});
  CHECK(refused(Tables<2>{}) == Text{"the mesh has no nodes", "the mesh has no cells"});
  auto twice = grid_tables<2>({3, 1});
  twice.cells.push_back(twice.cells[1]);
  CHECK(refused(twice) == Text{"cells 0, 1 and 3 share one face; two at most can"});
}

TEST_CASE("a mesh declared Cartesian must consist of boxes") {
  auto t = grid_tables<2>({1, 1});
  t.nodes[3] = {1.5, 1};
  CHECK(refused(t, false) ==
        Text{"cell 0 is not a box along the axes: nodes 0 (0, 0), 1 (1, 0), 3 (1.5, 1), 2 (0, 1) "
             "| set isoparametric to true for cells of any shape"});
  CHECK(refused(t, true).empty());
}

TEST_CASE("of many bad cells twenty are listed and the rest is counted") {
  auto t = grid_tables<2>({30, 1});
  for (auto& cell : t.cells) std::swap(cell[1], cell[3]);
  const auto text = refused(t);
  REQUIRE(text.size() == 21);
  CHECK(text.back() == "and 10 more problems in this mesh");
}
