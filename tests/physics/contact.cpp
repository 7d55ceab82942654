// Contact at one node, and nodes and cells that are there once for each body.
#include "physics/contact.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "tests/physics/mesh_fixtures.h"

using namespace lahar;
using namespace lahar::test;

namespace {

template <int Dim>
struct Body {
  double mass;
  Vec<Dim> velocity, gradient;
  BodyAtNode<Dim> at_node() const {
    return {mass, Eigen::Map<const Vec<Dim>>(velocity.data()),
            Eigen::Map<const Vec<Dim>>(gradient.data())};
  }
};

template <int Dim>
Vec<Dim> impulse(const Body<Dim>& a, const Body<Dim>& b, double friction) {
  return contact_impulse<Dim>(a.at_node(), b.at_node(), friction);
}

template <int Dim>
Body<Dim> random_body(std::mt19937& random) {
  return {uniform(random, 0.1, 2), random_point<Dim>(random, -Vec<Dim>::Ones(), Vec<Dim>::Ones()),
          random_point<Dim>(random, -Vec<Dim>::Ones(), Vec<Dim>::Ones())};
}

}  // namespace

TEST_CASE("bodies that approach get one normal velocity, and slip freely without friction") {
  const Body<2> block{3, {2, -1}, {0, -0.5}}, floor{1, {0, 0.2}, {0, 1}};
  const Vec<2> J = impulse(block, floor, 0);
  CHECK(J[0] == 0);
  CHECK(J[1] == doctest::Approx(-0.75 * 1.2));
  const Vec<2> v_block = block.velocity - J / 3, v_floor = floor.velocity + J;
  CHECK(v_block[1] == doctest::Approx(v_floor[1]));
  CHECK(v_block[0] == 2);
  CHECK(v_floor[0] == 0);
}

TEST_CASE("bodies that part, or move together, are free") {
  const Body<2> block{3, {2, 1}, {0, -0.5}}, floor{1, {0, 0.2}, {0, 1}};
  CHECK(impulse(block, floor, 0.5).isZero(0));
  const Body<2> resting{3, {2, 0.2}, {0, -0.5}};
  CHECK(impulse(resting, floor, 0.5).isZero(0));
  const Body<2> inside{3, {2, -1}, {0, 0}}, other{1, {0, 0}, {0, 0}};
  CHECK(impulse(inside, other, 0.5).isZero(0));  // no surface
}

TEST_CASE("friction is at most mu times the normal impulse, and sticks below that") {
  std::mt19937 random(2);
  int stuck = 0, slipped = 0;
  for (int k = 0; k < 500; ++k) {
    const Body<3> a = random_body<3>(random), b = random_body<3>(random);
    const double mu = uniform(random, 0, 1);
    const Vec<3> J = impulse(a, b, mu);
    if (J.isZero(0)) continue;
    const Vec<3> n =
        a.gradient.norm() >= b.gradient.norm() ? a.gradient.normalized() : -b.gradient.normalized();
    const double pressed = J.dot(n);
    CHECK(pressed > 0);
    const Vec<3> along = J - pressed * n;
    const Vec<3> after = (a.velocity - J / a.mass) - (b.velocity + J / b.mass);
    CHECK(std::abs(after.dot(n)) < 1e-14);
    if (along.norm() < mu * pressed * (1 - 1e-12)) {
      CHECK(after.norm() < 1e-13);
      ++stuck;
    } else {
      CHECK(along.norm() == doctest::Approx(mu * pressed).epsilon(1e-12));
      CHECK(along.dot(after) > -1e-14);  // against what is left of the slip
      ++slipped;
    }
  }
  CHECK(stuck > 20);
  CHECK(slipped > 20);
}

TEST_CASE("which body is first makes no difference") {
  std::mt19937 random(3);
  for (int k = 0; k < 200; ++k) {
    const Body<2> a = random_body<2>(random), b = random_body<2>(random);
    CHECK((impulse(a, b, 0.4) + impulse(b, a, 0.4)).norm() < 1e-15);
  }
}

TEST_CASE("the surface is that of the body with the larger gradient") {
  // The corner of a block on a floor: its own gradient is oblique and would stop it.
  const Body<2> corner{1, {1, 0}, {0.5, -0.5}}, floor{2, {0, 0}, {0, 1}};
  CHECK(impulse(corner, floor, 0).isZero(0));
}

TEST_CASE("each body has the nodes and cells of the patch, after those of the one before") {
  const Mesh<2> mesh = Mesh<2>::structured(Vec<2>::Zero(), Vec<2>::Ones(), {3, 2});
  const Partition<2> partition(mesh, mesh.n_cells());
  const PatchTopology<2> one = make_topology(mesh, partition, 0);
  PatchTopology<2> three = one;
  repeat_for_bodies(three, 3, mesh.n_nodes());
  const std::size_t cells = one.cells.size(), nodes = one.nodes.size();
  REQUIRE(three.cells.size() == 3 * cells);
  REQUIRE(three.nodes.size() == 3 * nodes);
  CHECK(std::is_sorted(three.nodes.begin(), three.nodes.end()));
  CHECK(std::adjacent_find(three.nodes.begin(), three.nodes.end()) == three.nodes.end());
  for (std::size_t b = 0; b < 3; ++b)
    for (std::size_t c = 0; c < cells; ++c) {
      CHECK(three.cells[b * cells + c] == one.cells[c]);
      for (std::size_t k = 0; k < 4; ++k) {
        const auto node = static_cast<std::size_t>(three.corner_nodes[b * cells + c][k]);
        CHECK(node / nodes == b);
        CHECK(three.nodes[node] % mesh.n_nodes() ==
              one.nodes[static_cast<std::size_t>(one.corner_nodes[c][k])]);
      }
    }
  PatchTopology<2> alone = one;
  repeat_for_bodies(alone, 1, mesh.n_nodes());
  CHECK(alone.nodes == one.nodes);
}
