#include <doctest/doctest.h>

#include <bit>
#include <cstdint>

#include "physics/mesh/cell_polynomial.h"
#include "physics/mesh/inverse_mapping.h"
#include "tests/physics/mesh/mesh_fixtures.h"

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

constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();
constexpr int W = lanes<Pack>;

template <int Dim>
CellPolynomial<Dim> polynomial(const CellGeometry<Dim>& cell) {
  std::array<Local, corners<Dim>> corner;
  double position[corners<Dim>][4] = {};
  for (int a = 0; a < corners<Dim>; ++a) {
    corner[a] = a;
    for (int d = 0; d < Dim; ++d) position[a][d] = cell.corner[a][d];
  }
  return {position[0], corner};
}

/// Points and starts of a pack's lanes; what inverse_map_pack() made of them.
template <int Dim>
struct Lanes {
  Vec<Dim> x[W], start[W], xi[W];
  unsigned open = 0;

  void map(const CellPolynomial<Dim>& cell, Local n) {
    Pack at[Dim], natural[Dim];
    for (int d = 0; d < Dim; ++d) {
      double points[W], starts[W];
      for (int k = 0; k < W; ++k) points[k] = x[k][d], starts[k] = start[k][d];
      at[d] = load<Pack>(points);
      natural[d] = load<Pack>(starts);
    }
    open = inverse_map_pack(cell, at, natural, n);
    for (int k = 0; k < W; ++k)
      for (int d = 0; d < Dim; ++d) xi[k][d] = natural[d][k];
  }
};

/// Natural coordinates somewhere in the cell; every other one on a face, an edge or a corner.
template <int Dim>
Vec<Dim> closed_cell_point(std::mt19937& random) {
  Vec<Dim> xi = random_point<Dim>(random, -Vec<Dim>::Ones(), Vec<Dim>::Ones());
  for (int d = 0; d < Dim; ++d)
    if (random() % 4 == 0) xi[d] = random() % 2 ? 1.0 : -1.0;
  return xi;
}

/// Call with strongly distorted meshes.
template <class Check>
void on_distorted_meshes(Check check) {
  std::mt19937 random(7);
  check(distorted<2>(grid_tables<2>({12, 12}), 0.24, random).mesh(true), random);
  check(distorted<3>(grid_tables<3>({5, 5, 5}), 0.2, random).mesh(true), random);
}

template <int Dim>
bool same_bits(const Vec<Dim>& a, const Vec<Dim>& b) {
  bool same = true;
  for (int d = 0; d < Dim; ++d)
    same = same && std::bit_cast<std::uint64_t>(a[d]) == std::bit_cast<std::uint64_t>(b[d]);
  return same;
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

TEST_CASE(
    "packs find the natural coordinates that single points have, from any start in the cell") {
  on_distorted_meshes([]<int Dim>(const Mesh<Dim>& mesh, std::mt19937& random) {
    for (const double away : {0.0, 1e-9, 1e-8, 1e-6, 4e-6, 1e-4, 1e-3, 1e-2, 0.1, 2.0}) {
      CAPTURE(away);
      double worst = 0;
      int open = 0, total = 0;
      for (Index c = 0; c < mesh.n_cells(); ++c) {
        const CellGeometry<Dim> g = mesh.geometry(c);
        Lanes<Dim> lanes;
        for (int k = 0; k < W; ++k) {
          const Vec<Dim> xi = closed_cell_point<Dim>(random);
          const Vec<Dim> far = Vec<Dim>::Constant(away);
          lanes.x[k] = to_physical<Dim>(g, xi);
          lanes.start[k] = clamp_to_cell<Dim>(xi + random_point<Dim>(random, -far, far));
        }
        lanes.map(polynomial<Dim>(g), W);
        for (int k = 0; k < W; ++k) {
          Vec<Dim> single;
          REQUIRE(inverse_map<Dim>(g, lanes.x[k], single));
          ++total;
          // From far away the polynomial's other root may be found, which is outside of the cell.
          if (lanes.open >> k & 1 || lanes.xi[k].cwiseAbs().maxCoeff() > 1 + 1e-10)
            ++open;
          else
            worst = std::max(worst, (lanes.xi[k] - single).cwiseAbs().maxCoeff());
        }
      }
      CHECK(worst < 1e-12);
      if (away <= 1e-2) CHECK(open == 0);
      CHECK(open <= total / 20);
    }
  });
}

TEST_CASE("packs find a parallelogram's coordinates in one step from any start") {
  const auto g = one_cell<2>({{1e5, 0}, {1e5 + 2, 1}, {1e5 + 2.5, 3}, {1e5 + 0.5, 2}}).geometry(0);
  const auto cell = polynomial<2>(g);
  CHECK(cell.det[1] == 0);
  CHECK(cell.det[2] == 0);
  const Scalar x[2] = {1e5 + 0.7, 1.1}, start[2] = {0.9, -0.9};
  Scalar offset[2], step[2];
  cell.offset_from(x, offset);
  unsigned open = 1;
  inverse_step(cell, offset, start, step, open);
  CHECK(open == 0);
  Vec<2> single;
  REQUIRE(inverse_map<2>(g, {1e5 + 0.7, 1.1}, single));
  for (int d = 0; d < 2; ++d)
    CHECK((start[d] - step[d])[0] == doctest::Approx(single[d]).epsilon(1e-14));
}

TEST_CASE(
    "a particle's natural coordinates are the same, to the last bit, in any lane of any pack") {
  on_distorted_meshes([]<int Dim>(const Mesh<Dim>& mesh, std::mt19937& random) {
    bool same = true, kept = true;
    for (Index c = 0; c < mesh.n_cells(); ++c) {
      const auto cell = polynomial<Dim>(mesh.geometry(c));
      const Vec<Dim> x = to_physical<Dim>(mesh.geometry(c), closed_cell_point<Dim>(random));
      const Vec<Dim> start = closed_cell_point<Dim>(random);
      Scalar at[Dim], alone[Dim];
      for (int d = 0; d < Dim; ++d) at[d] = x[d], alone[d] = start[d];
      const unsigned open = inverse_map_pack(cell, at, alone, 1);
      Vec<Dim> expected;
      for (int d = 0; d < Dim; ++d) expected[d] = alone[d][0];
      for (int k = 0; k < W; ++k) {
        Lanes<Dim> lanes;
        const double others[] = {0.1, 3, 1e300, not_a_number,
                                 std::numeric_limits<double>::infinity()};
        for (int j = 0; j < W; ++j) {
          lanes.x[j] = Vec<Dim>::Constant(others[random() % 5]);
          lanes.start[j] = Vec<Dim>::Constant(others[random() % 5]);
        }
        lanes.x[k] = x;
        lanes.start[k] = start;
        // As the bin's last particle, and with neighbours of the same bin.
        for (const Local n : {k + 1, W}) {
          lanes.map(cell, n);
          same = same && same_bits<Dim>(lanes.xi[k], expected) && (lanes.open >> k & 1) == open;
          same = same && lanes.open >> n == 0;
          for (int j = n; j < W; ++j) kept = kept && same_bits<Dim>(lanes.xi[j], lanes.start[j]);
        }
      }
    }
    CHECK(same);
    CHECK(kept);
  });
}

TEST_CASE(
    "packs never put a point inside a cell that it is not in, what they fail at is reported") {
  on_distorted_meshes([]<int Dim>(const Mesh<Dim>& mesh, std::mt19937& random) {
    int reported = 0;
    for (Index c = 0; c < mesh.n_cells(); ++c) {
      const CellGeometry<Dim> g = mesh.geometry(c);
      Lanes<Dim> lanes;
      for (int k = 0; k < W; ++k) {
        const Vec<Dim> far = Vec<Dim>::Constant(k % 2 ? 1.5 : 30);
        lanes.x[k] = g.centre + random_point<Dim>(random, -far, far);
        lanes.start[k] = closed_cell_point<Dim>(random);
      }
      lanes.x[0][Dim - 1] = not_a_number;
      lanes.start[1][0] = not_a_number;
      lanes.map(polynomial<Dim>(g), W);
      CHECK((lanes.open & 3) == 3);
      reported += std::popcount(lanes.open);
      for (int k = 0; k < W; ++k) {
        if (!(lanes.open >> k & 1) && in_closed_cell<Dim>(lanes.xi[k]))
          CHECK((to_physical<Dim>(g, lanes.xi[k]) - lanes.x[k]).norm() < 1e-13);
      }
    }
    if (W > 2) CHECK(reported > 2 * mesh.n_cells());  // far outside there is no solution
  });
}
