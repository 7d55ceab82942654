// What flows are measured with.
#include "tests/verification/measures.h"

#include <doctest/doctest.h>

#include "tests/within.h"

using namespace lahar;
using namespace lahar::verification;

namespace {

struct Grain {
  double x, y, u = 0;
};

/// Grains of 1 kg.
State state_of(const std::vector<Grain>& grains) {
  Frame frame;
  frame.dim = 2;
  frame.columns = {{"mass", "kg", 1, {}}, {"displacement", "m", 2, {}}};
  for (const Grain& g : grains) {
    frame.id.push_back(frame.size());
    frame.coordinates.insert(frame.coordinates.end(), {g.x, g.y});
    frame.columns[0].values.push_back(1);
    frame.columns[1].values.insert(frame.columns[1].values.end(), {g.u, 0.0});
  }
  return State(std::move(frame));
}

}  // namespace

TEST_CASE("depths of columns are their mass over density and width") {
  const State state = state_of({{0.1, 0}, {0.9, 5}, {1.5, 0}, {-0.5, 0}});
  const Depths d = depths_along_x(state, 2, 0, 1);
  REQUIRE(d.depth.size() == 3);
  CHECK(d.depth[0] == 1.0);
  CHECK(d.depth[1] == 0.5);
  CHECK(d.depth[2] == 0.0);
  CHECK(d.highest() == 1.0);
}

TEST_CASE("a deposit ends where it is as thin as a layer, not at the grain that flew furthest") {
  std::vector<Grain> grains;
  for (int column = 0; column < 4; ++column)
    for (int i = 0; i < 8 - 2 * column; ++i) grains.push_back({column + 0.5, 0.0});
  const double alone = depths_along_x(state_of(grains), 1, 0, 1).front(1);
  // Depths 8, 6, 4, 2 and 0 at 0.5, 1.5 ... 4.5: the line between the last two is at 1 at 4.
  CHECK(alone == doctest::Approx(4));
  for (int i = 0; i < 3; ++i) grains.push_back({9.5, 0.0});
  CHECK(depths_along_x(state_of(grains), 1, 0, 1).front(1) == alone);
  // A finer column moves the front by less than its width.
  CHECK(depths_along_x(state_of(grains), 1, 0, 1).front(1.5) == doctest::Approx(3.75));
}

TEST_CASE("a deposit thinner than a layer everywhere ends where it begins") {
  CHECK(depths_along_x(state_of({{0.5, 0}}), 1, 0, 1).front(2) == 0);
}

TEST_CASE("mean depths are those of the material, and where they end does not depend on columns") {
  // A wedge from depth 2 at 0 to nothing at 4: grains of 1 kg in columns of 0.01.
  const auto end_of = [](double shift) {
    std::vector<Grain> grains;
    for (int i = 0; i < 400; ++i) {
      const double x = 0.01 * (i + 0.5) + shift;
      for (int k = 0; k < std::lround(100 * (4 - x)); ++k) grains.push_back({x, 0.0});
    }
    const State state = state_of(grains);
    const Curve curve = mean_depths(
        state, 20000, 0.5, [&](Index p) { return state.x(p, 0); }, [](double) { return 1.0; });
    CHECK(curve.at(1) == test::within(0.01, 1.5));
    CHECK(curve.at(3) == test::within(0.01, 0.5));
    CHECK(curve.y.back() == 0);
    return curve.first_below(0.5);
  };
  CHECK(end_of(0) == test::within(0.005, 3));
  CHECK(end_of(0.003) == test::within(0.005, 3));
}

TEST_CASE("mean depths at a plane of symmetry are not halved, and grains that fly are no deposit") {
  std::vector<Grain> grains;
  for (int i = 0; i < 100; ++i) grains.push_back({0.01 * (i + 0.5), 0.0});
  grains.push_back({5, 0});
  const State state = state_of(grains);
  const Curve curve = mean_depths(
      state, 100, 0.1, [&](Index p) { return state.x(p, 0); }, [](double) { return 1.0; });
  CHECK(curve.at(0) == doctest::Approx(1));
  CHECK(curve.at(0.5) == doctest::Approx(1));
  CHECK(curve.first_below(0.5) == test::within(0.01, 1));
}

TEST_CASE("depths of rings give a cylinder its height out to its radius") {
  Frame frame;
  frame.dim = 3;
  frame.columns = {{"mass", "kg", 1, {}}};
  // A quarter of a disc of radius 1 and depth 1, density 1, by equal cells.
  constexpr int n = 200;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      const double x = (i + 0.5) / n, y = (j + 0.5) / n;
      if (x * x + y * y > 1) continue;
      frame.id.push_back(frame.size());
      frame.coordinates.insert(frame.coordinates.end(), {x, y, 0.5});
      frame.columns[0].values.push_back(1.0 / (n * n));
    }
  const Depths d = depths_of_rings(State(std::move(frame)), 1, 0.1);
  REQUIRE(d.depth.size() == 11);
  for (std::size_t i = 1; i < 10; ++i) CHECK(d.depth[i] == test::within(0.02, 1));
  CHECK(d.depth[10] == 0);
}

TEST_CASE("what moved does not count as at rest, and columns are those of the start") {
  // One of three grains in the first column slid into the second.
  const State state = state_of({{0.5, 0}, {0.5, 1, 0.0005}, {1.5, 0, 1.0}});
  const Depths d = depths_at_rest(state, 1, 0, 1, 0.001);
  CHECK(d.depth[0] == 2);
  REQUIRE(d.depth.size() == 2);
}

TEST_CASE("curves are straight between points and know where they pass a value") {
  Curve c;
  c.add(0, 0);
  c.add(2, 4);
  c.add(3, 4);
  c.add(5, 0);
  CHECK(c.at(-1) == 0);
  CHECK(c.at(1) == 2);
  CHECK(c.at(9) == 0);
  CHECK(c.first_reach(1) == 0.5);
  CHECK(c.first_reach(5) == 5);
  CHECK(c.last_above(1) == 4.5);
  Curve points;
  points.add(1, 3);
  points.add(4, 1);
  CHECK(distance(points, c) == doctest::Approx(1));
}

TEST_CASE("published points are read without their comments") {
  const Curve surface =
      read_curve(LAHAR_SOURCE_DIR "/tests/verification/world/rods-surface.csv", 0, 1);
  REQUIRE(surface.x.size() == 23);
  CHECK(surface.x.back() == test::within(1e-3, 0.4423));
  CHECK(std::is_sorted(surface.x.begin(), surface.x.end()));
}
