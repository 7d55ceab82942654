#include <doctest/doctest.h>

#include "physics/inverse_mapping.h"
#include "tests/physics/mesh_fixtures.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// Largest |inverse(forward(xi)) - xi| over points of every cell.
template <int Dim>
double round_trip_error(const Mesh<Dim>& mesh, std::mt19937& random, int points) {
  double worst = 0;
  for (Index c = 0; c < mesh.n_cells(); ++c) {
    const CellGeometry<Dim> g = mesh.geometry(c);
    for (int i = 0; i < points; ++i) {
      const Vec<Dim> xi = random_point<Dim>(random, -Vec<Dim>::Ones(), Vec<Dim>::Ones());
      Vec<Dim> back;
      REQUIRE(inverse_map<Dim>(g, to_physical<Dim>(g, xi), back));
      worst = std::max(worst, (back - xi).cwiseAbs().maxCoeff());
    }
  }
  return worst;
}

}  // namespace

TEST_CASE("the inverse map undoes the map in strongly distorted quadrilaterals") {
  std::mt19937 random(1);
  const auto mesh = distorted<2>(grid_tables<2>({12, 12}), 0.24, random).mesh(true);
  CHECK(round_trip_error<2>(mesh, random, 100) < 1e-12);
}

TEST_CASE("the inverse map undoes the map in strongly distorted hexahedra") {
  std::mt19937 random(2);
  const auto mesh = distorted<3>(grid_tables<3>({6, 6, 6}), 0.2, random).mesh(true);
  CHECK(round_trip_error<3>(mesh, random, 50) < 1e-12);
}

TEST_CASE("the quadrilateral's closed form holds where its quadratic term vanishes") {
  std::mt19937 random(3);
  const std::vector<std::vector<Vec<2>>> shapes = {
      {{0, 0}, {1, 0}, {1, 1}, {0, 1}},          // square
      {{0, 0}, {2, 1}, {2.5, 3}, {0.5, 2}},      // parallelogram
      {{0, 0}, {3, 0}, {2, 1}, {1, 1}},          // trapezoid, horizontal sides parallel
      {{0, 0}, {1, 1}, {1, 2}, {0, 3}},          // trapezoid, vertical sides parallel
      {{0, 0}, {1, 0}, {1 + 1e-12, 1}, {0, 1}},  // almost a square
      {{0, 0}, {1, 0}, {0.51, 0.51}, {0, 1}},    // nearly straight corner
      {{1e6, 1e6}, {1e6 + 1, 1e6}, {1e6 + 2, 1e6 + 2}, {1e6, 1e6 + 1}},  // far from the origin
  };
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    CAPTURE(i);
    const double tolerance = i == 6 ? 2e-9 : i == 5 ? 1e-11 : 1e-13;
    CHECK(round_trip_error<2>(one_cell<2>(shapes[i]), random, 1000) < tolerance);
  }
}

TEST_CASE("a point outside the cell is mapped to the side on which it lies") {
  std::mt19937 random(4);
  const auto quads = distorted<2>(grid_tables<2>({5, 5}), 0.2, random).mesh(true);
  const auto bricks = distorted<3>(grid_tables<3>({3, 3, 3}), 0.15, random).mesh(true);
  const auto check = [&]<int Dim>(const Mesh<Dim>& mesh) {
    for (Index c = 0; c < mesh.n_cells(); ++c) {
      const auto g = mesh.geometry(c);
      for (int face = 0; face < 2 * Dim; ++face) {
        Vec<Dim> xi = Vec<Dim>::Zero();
        xi[face / 2] = face % 2 ? 1.0 : -1.0;
        const Vec<Dim> beyond = to_physical<Dim>(g, 1.5 * xi);
        Vec<Dim> found;
        inverse_map<Dim>(g, beyond, found);
        CHECK(found.dot(xi) > 1.0);
      }
    }
  };
  check(quads);
  check(bricks);
}

TEST_CASE("NaN is in no cell") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  std::mt19937 random(5);
  const auto plain = Mesh<3>::structured({0, 0, 0}, {1, 1, 1}, {2, 2, 2});
  const auto skew = distorted<3>(grid_tables<3>({2, 2, 2}), 0.1, random).mesh(true);
  for (const auto* mesh : {&plain, &skew}) {
    CHECK_FALSE(mesh->natural_coordinates(0, {0.5, nan, 0.5}));
    CHECK(mesh->locate({0.5, nan, 0.5}).cell == -1);
    CHECK(mesh->locate_from({nan, 0.5, 0.5}, 0).cell == -1);
  }
}

TEST_CASE(
    "natural coordinates of a Cartesian cell are 2 (x - mean of corners) / edge, to the bit") {
  const auto mesh = Mesh<2>::structured({0.1, -0.3}, {0.1, 0.7}, {30, 20});
  std::mt19937 random(6);
  for (int i = 0; i < 1000; ++i) {
    const Vec<2> x = random_point<2>(random, {0.2, 0.0}, {3.0, 13.0});
    const auto found = mesh.locate(x);
    const auto nodes = mesh.cell_nodes(found.cell);
    Vec<2> mean = mesh.node(nodes[0]);
    for (int k = 1; k < 4; ++k) mean += mesh.node(nodes[k]);
    mean /= 4;
    const double width = (mesh.node(nodes[0]) - mesh.node(nodes[1])).norm();
    const double height = (mesh.node(nodes[1]) - mesh.node(nodes[2])).norm();
    CHECK(found.xi[0] == 2 * (x[0] - mean[0]) / width);
    CHECK(found.xi[1] == 2 * (x[1] - mean[1]) / height);
  }
}

TEST_CASE("natural coordinates never reach 1: a face is pulled inside by one rounding unit") {
  const auto mesh = Mesh<2>::structured({0, 0}, {1, 1}, {1, 1});
  const auto corner = mesh.natural_coordinates(0, {1, 0});
  REQUIRE(corner);
  CHECK((*corner)[0] == 1 - 2.2e-16);
  CHECK((*corner)[1] == -(1 - 2.2e-16));
  CHECK_FALSE(mesh.natural_coordinates(0, {std::nextafter(1.0, 2.0), 0.5}));
}
