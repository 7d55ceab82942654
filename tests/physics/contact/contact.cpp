// Contact at one node, and nodes and cells that are there once for each body.
#include "physics/contact/contact.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "tests/physics/mesh/mesh_fixtures.h"

using namespace lahar;
using namespace lahar::test;

namespace {

template <int Dim>
BodyAtNode<Dim> random_body(std::mt19937& random) {
  return {uniform(random, 0.1, 2), random_point<Dim>(random, -Vec<Dim>::Ones(), Vec<Dim>::Ones())};
}

}  // namespace

TEST_CASE("bodies that approach get one normal velocity, and slip freely without friction") {
  const BodyAtNode<2> block{3, {2, -1}}, floor{1, {0, 0.2}};
  const auto done = contact_impulse<2>(block, floor, {0, -1}, 0, 0);
  CHECK(done.pressed);
  CHECK(done.impulse[0] == 0);
  CHECK(done.impulse[1] == doctest::Approx(-0.75 * 1.2));
}

TEST_CASE("bodies that part, or do not close their gap, are free") {
  const BodyAtNode<2> parts{3, {2, 1}}, near{3, {2, -1}}, floor{1, {0, 0.2}};
  CHECK(contact_impulse<2>(parts, floor, {0, -1}, 0, 0.5).impulse.isZero(0));
  CHECK(contact_impulse<2>(near, floor, {0, -1}, 1.3, 0.5).impulse.isZero(0));
  const auto closes = contact_impulse<2>(near, floor, {0, -1}, 0.2, 0);
  CHECK(closes.impulse[1] == doctest::Approx(-0.75));  // what exceeds 0.2 m/s
}

TEST_CASE("friction is at most mu times the normal impulse, and sticks below that") {
  std::mt19937 random(2);
  int stuck = 0, slipped = 0;
  for (int k = 0; k < 500; ++k) {
    const auto a = random_body<3>(random), b = random_body<3>(random);
    const Vec<3> n = random_point<3>(random, -Vec<3>::Ones(), Vec<3>::Ones()).normalized();
    const double mu = uniform(random, 0, 1);
    const auto done = contact_impulse<3>(a, b, n, 0, mu);
    const Vec<3> J = done.impulse;
    if (!done.pressed) continue;
    const double pressed = J.dot(n);
    const Vec<3> along = J - pressed * n;
    const Vec<3> after = (a.velocity - J / a.mass) - (b.velocity + J / b.mass);
    CHECK(std::abs(after.dot(n)) < 1e-14);
    if (done.stuck) {
      CHECK(along.norm() <= mu * pressed * (1 + 1e-12));
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

TEST_CASE("where a direction is held, friction along the other still holds what it can") {
  BodyAtNode<3> a{2, {0.3, 0, -1}}, b{5, {0, 0, 0}};
  a.free(1, 1) = b.free(1, 1) = 0;
  const auto done = contact_impulse<3>(a, b, {0, 0.6, -0.8}, 0, 0.5);
  CHECK(done.stuck);
  const Vec<3> after =
      (a.velocity - a.free * done.impulse / a.mass) - (b.velocity + b.free * done.impulse / b.mass);
  CHECK(after.norm() < 1e-14);
}

TEST_CASE("bodies that are held together neither approach nor part") {
  const BodyAtNode<2> parts{3, {2, 1}}, floor{1, {0, 0.2}};
  const auto done = contact_impulse<2>(parts, floor, {0, -1}, 0, 0, true);
  CHECK(done.impulse[0] == 0);
  CHECK(done.impulse[1] == doctest::Approx(0.75 * 0.8));
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
