// Where surfaces of bodies are looked for, and along which directions.
#include "physics/contact/contact_surface.h"

#include <doctest/doctest.h>

#include "physics/contact/contact.h"
#include "tests/physics/kernels/kernels_fixture.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// Two bodies on a mesh of 4 x 1 cells: the first has mass until x = 2, the second from `begin` on.
struct TwoBodies : OnePatch<2> {
  explicit TwoBodies(double begin)
      : OnePatch(Mesh<2>::structured(Vec<2>::Zero(), Vec<2>::Ones(), {4, 1})) {
    const Local nodes = patch.n_nodes();
    repeat_for_bodies(patch.topology, 2, nodes);
    patch.body_nodes = nodes;
    patch.active_nodes = {{0, 2 * nodes, 0}};
    for (auto& copies : patch.sums)
      copies = {NodeArray(static_cast<std::size_t>(2 * nodes) * sum_stride, 0.0)};
    for (Local i = 0; i < nodes; ++i) {
      if (node(i)[0] <= 2) set(NodeSum::mass_momentum, i, mass_lane, 3);
      if (node(i)[0] >= begin) set(NodeSum::mass_momentum, nodes + i, mass_lane, 4);
      set(NodeSum::gradient, i, 0, 5);
      set(NodeSum::gradient, nodes + i, 0, -2);
    }
  }
  void set(NodeSum which, Local n, int component, double value) {
    patch.own_sums(which, 0)[n * sum_stride + component] = value;
  }
  void find() {
    find_nodes_between(patch, context());
    set_directions(patch, context());
  }
};

}  // namespace

TEST_CASE("surfaces are looked for at nodes where two bodies have mass, and in cells around them") {
  TwoBodies touching(2);
  touching.find();
  const auto& nodes = touching.patch.contact.nodes_between;
  REQUIRE(nodes.size() == 2);
  for (const auto& at : nodes) CHECK(touching.node(at.node)[0] == 2);
  for (const int body : {0, 1})
    for (const int cell : {0, 1, 2, 3})
      CHECK(has_nodes_between(touching.patch, 4 * body + cell) == (cell == 1 || cell == 2));

  TwoBodies apart(3);
  apart.find();
  CHECK(apart.patch.contact.nodes_between.empty());
  CHECK_FALSE(has_nodes_between(apart.patch, 1));
}

TEST_CASE("a body with less mass than a node needs to move does not meet others") {
  TwoBodies light(2);
  light.patch.least_mass = 3.5;
  light.find();
  CHECK(light.patch.contact.nodes_between.empty());
}

TEST_CASE("directions of two flat surfaces are their normals, the mean and the axis of the mesh") {
  TwoBodies touching(2);
  touching.find();
  for (const auto& [node, directions] : touching.patch.contact.nodes_between) {
    REQUIRE(directions.count == 4);
    for (int k = 0; k < 4; ++k)
      CHECK(directions.at(k) ==
            Vec<2>(directions.from[static_cast<std::size_t>(k)] == 0 ? 1 : -1, 0));
    CHECK(directions.sign(0, 0) == 1);
    CHECK(directions.sign(0, 1) == -1);
    CHECK(directions.sign(2, 1) == -1);
    CHECK(directions.sign(2, 2) == 0);
  }
}
