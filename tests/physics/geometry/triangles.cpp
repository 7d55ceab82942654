#include "physics/geometry/triangles.h"

#include <doctest/doctest.h>

#include "physics/geometry/triangle_heights.h"
#include "physics/geometry/triangle_shells.h"
#include "tests/physics/geometry/solid_samples.h"
#include "tests/within.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// A sheet of triangles over [0, n] x [0, n] with heights f(x, y).
template <class F>
Triangles sheet(int n, const F& f) {
  Triangles t;
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i <= n; ++i) t.points.emplace_back(i, j, f(i, j));
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      const Local a = i + j * (n + 1), b = a + 1, c = a + n + 1, d = c + 1;
      t.corners.push_back({a, b, d});
      t.corners.push_back({a, d, c});
    }
  return t;
}

}  // namespace

TEST_CASE("edges of closed triangulations have two triangles in opposite directions") {
  const Triangles t = box_of_triangles({0, 0, 0}, {1, 2, 3});
  const auto edges = edges_of(t);
  CHECK(edges.open.count + edges.branched.count + edges.turned.count == 0);
  for (std::size_t i = 0; i < 12; ++i)
    for (std::size_t k = 0; k < 3; ++k) {
      const auto& other = edges.neighbour[static_cast<std::size_t>(edges.neighbour[i][k])];
      CHECK(std::count(other.begin(), other.end(), static_cast<Local>(i)) == 1);
    }
  CHECK(enclosed_volume(t) == doctest::Approx(6));
  CHECK(find_flat(t).count == 0);
}

TEST_CASE("holes of triangulations are found with their places") {
  Triangles t = box_of_triangles({0, 0, 0}, {2, 2, 2});
  t.corners.erase(t.corners.begin() + 10, t.corners.end());  // x = 2
  t.corners.erase(t.corners.begin() + 8);                    // half of x = 0
  const auto edges = edges_of(t);
  CHECK(edges.open.count == 7);
  CHECK(edges.open.at == Vec<3>(0, 1, 0));
  const auto holes = find_holes(t, edges, 5);
  REQUIRE(holes.size() == 2);
  CHECK(holes[0].edges == 4);
  CHECK(holes[0].length == doctest::Approx(8));
  CHECK(holes[0].centre == Vec<3>(2, 1, 1));
  CHECK(holes[1].edges == 3);
  CHECK(find_holes(t, edges, 1).size() == 1);
}

TEST_CASE("flaws of triangulations are counted, with the first") {
  Triangles turned = box_of_triangles({0, 0, 0}, {1, 1, 1});
  std::swap(turned.corners[2][1], turned.corners[2][2]);
  CHECK(edges_of(turned).turned.count == 3);
  CHECK(edges_of(turned).open.count == 0);

  Triangles branched = box_of_triangles({0, 0, 0}, {1, 1, 1});
  branched.corners.push_back({0, 1, 7});
  CHECK(edges_of(branched).branched.count == 1);
  CHECK(edges_of(branched).branched.at == Vec<3>(0.5, 0, 0));

  Triangles flat = box_of_triangles({0, 0, 0}, {1, 1, 1});
  flat.points.emplace_back(0.5, 0, 0);
  flat.corners.push_back({0, 8, 1});
  CHECK(find_flat(flat).count == 1);
  CHECK(find_flat(flat).triangle == 12);
  flat.corners.back() = {0, 1, 0};
  CHECK(remove_collapsed(flat).count == 1);
  CHECK(flat.corners.size() == 12);
}

TEST_CASE("triangles become heights on a grid from border to border") {
  const auto plane = [](double x, double y) { return 3 + 0.5 * x - 0.25 * y; };
  const Triangles t = sheet(7, plane);
  const auto heights = triangle_heights(t, 0.3);
  CHECK(heights.steep.count + heights.folded.count + heights.double_points.count == 0);
  std::mt19937 random(9);
  for (int i = 0; i < 1000; ++i) {
    const auto x = random_point<3>(random, 0, 7);
    CHECK(heights.surface.height(x) == within(1e-6, plane(x[0], x[1])));
  }
  CHECK(heights.surface.height({7, 7, 0}) == doctest::Approx(plane(7, 7)));
  CHECK(heights.surface.axes()[0].size() == 25);

  // A grid of the triangles' own points has their heights.
  const auto hills = [](double x, double y) { return std::sin(x) * std::cos(2 * y); };
  const auto own = triangle_heights(sheet(7, hills), 1.0).surface;
  for (int i = 0; i <= 7; ++i)
    for (int j = 0; j <= 7; ++j)
      CHECK(own.height({double(i), double(j), 0}) == doctest::Approx(hills(i, j)).epsilon(1e-6));
  CHECK(spacing_for(sheet(7, hills)) == doctest::Approx(7.0 / 500));
}

TEST_CASE("there are no heights in holes of a triangulation and outside of it") {
  Triangles t = sheet(4, [](double, double) { return 1.0; });
  t.corners.erase(t.corners.begin() + 2 * 5, t.corners.begin() + 2 * 6);  // of (1, 1)
  const auto surface = triangle_heights(t, 0.25).surface;
  CHECK(std::isnan(surface.height({1.4, 1.6, 0})));
  CHECK(surface.height({2.1, 1.6, 0}) == 1);
  CHECK(std::isnan(surface.height({4.1, 1, 0})));
}

TEST_CASE("overhangs, folds and vertical triangles are no heights") {
  // A wave that breaks: its crest lies in front of its foot.
  Triangles wave = sheet(4, [](double x, double) { return x; });
  for (Vec<3>& x : wave.points)
    if (x[0] == 3) x[0] = 1.5;
  const auto folded = triangle_heights(wave, 0.1);
  CHECK(folded.folded.count > 0);
  CHECK(folded.folded.at[0] <= 2);
  CHECK(folded.double_points.count > 0);

  Triangles cliff = sheet(4, [](double x, double) { return x > 2 ? 5.0 : 0.0; });
  for (Vec<3>& x : cliff.points)
    if (x[0] == 3) x[0] = 2;
  CHECK(triangle_heights(cliff, 0.5).steep.count == 8);

  // Two sheets, one above the other, that do not hang together.
  Triangles two = sheet(3, [](double, double) { return 0.0; });
  const auto first = static_cast<Local>(two.points.size());
  for (const Vec<3>& x : std::vector<Vec<3>>(two.points)) two.points.push_back(x + Vec<3>::UnitZ());
  for (auto corner : std::vector<Triangles::Corners>(two.corners)) {
    for (Local& c : corner) c += first;
    two.corners.push_back(corner);
  }
  CHECK(triangle_heights(two, 0.5).double_points.count > 0);
  CHECK(triangle_heights(two, 0.5).folded.count == 0);

  // Which side is outside has no effect.
  Triangles turned = sheet(3, [](double x, double y) { return x * y; });
  turn_over(turned);
  std::swap(turned.corners[4][0], turned.corners[4][1]);
  CHECK(triangle_heights(turned, 0.5).folded.count == 0);
}

namespace {

void add(Triangles& to, const Triangles& other, const Vec<3>& move = Vec<3>::Zero()) {
  const auto first = static_cast<Local>(to.points.size());
  for (const Vec<3>& x : other.points) to.points.push_back(x + move);
  for (const Triangles::Corners& c : other.corners)
    to.corners.push_back({c[0] + first, c[1] + first, c[2] + first});
}

}  // namespace

TEST_CASE("closed surfaces within others are found, however deep and wherever they touch") {
  const auto round = [](double radius) { return star(12, [=](const Vec<3>&) { return radius; }); };
  Triangles all = round(4);
  add(all, round(3));  // with the same poles and angles
  add(all, round(1), {0.5, 0.25, 1});
  add(all, round(1), {9, 0, 0});
  add(all, box_of_triangles({12, 0, 0}, {13, 1, 1}));
  add(all, box_of_triangles({12.25, 0.25, 1}, {12.75, 0.75, 2}));  // stands on that box
  add(all, box_of_triangles({13, 0.25, 0.5}, {14, 0.75, 1}));      // and beside it
  const auto shells = shells_of(edges_of(all));
  REQUIRE(shells.count == 7);
  CHECK(nesting_depths(all, shells) == std::vector<int>{0, 1, 2, 0, 0, 0, 0});
  const auto volumes = shell_volumes(all, shells);
  CHECK(volumes[2] == doctest::Approx(volumes[3]));
  CHECK(volumes[4] == doctest::Approx(1));
  turn_over(all, shells, {false, false, false, false, true, false, false});
  CHECK(shell_volumes(all, shells)[4] == doctest::Approx(-1));
}

TEST_CASE("depths of many closed surfaces follow from their place, in any order") {
  Triangles all;
  constexpr int n = 9;
  for (int k = 0; k < n; ++k)
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i)
        add(all, box_of_triangles({0, 0, 0}, {0.5, 0.5, 0.5}), Vec<3>(i, j, k));
  add(all, box_of_triangles({-1, -1, -1}, {n, n, 4.75}));  // around five layers of nine
  const auto shells = shells_of(edges_of(all));
  const auto depths = nesting_depths(all, shells);
  REQUIRE(depths.size() == n * n * n + 1);
  for (std::size_t s = 0; s < n * n * n; ++s) CHECK(depths[s] == (s < 5 * n * n ? 1 : 0));
  CHECK(depths.back() == 0);
}

TEST_CASE("depths of closed surfaces that lie within each other by thousands are not found") {
  Triangles all;
  for (int i = 0; i < 4200; ++i)
    add(all, box_of_triangles(Vec<3>::Constant(-1 - 1e-3 * i), Vec<3>::Constant(1 + 1e-3 * i)));
  CHECK(nesting_depths(all, shells_of(edges_of(all))).empty());
}
