#include "physics/geometry/coarse_triangles.h"

#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

#include "tests/physics/geometry/ball_grid.h"
#include "tests/within.h"

using namespace lahar;

namespace {

/// A square of side 1 that is bent along a line in its middle.
Triangles roof(int parts) {
  Triangles surface;
  const auto number = [&](int i, int j) { return static_cast<Local>(i + (parts + 1) * j); };
  for (int j = 0; j <= parts; ++j)
    for (int i = 0; i <= parts; ++i) {
      const double x = 1.0 * i / parts, y = 1.0 * j / parts;
      surface.points.emplace_back(x, y, 0.5 - std::abs(x - 0.5));
      if (i == parts || j == parts) continue;
      const Local a = number(i, j), b = number(i + 1, j), c = number(i + 1, j + 1),
                  d = number(i, j + 1);
      surface.corners.push_back({a, b, c});
      surface.corners.push_back({a, c, d});
    }
  return surface;
}

}  // namespace

TEST_CASE("a ball of fewer triangles is closed, round, and encloses its volume") {
  const double radius = 0.7;
  const Triangles fine = level_surface(test::ball<3>(radius, 0.03), 0),
                  coarse = coarser(fine, 1000);
  REQUIRE(fine.corners.size() > 10'000);
  CHECK(coarse.corners.size() <= 1000);
  CHECK(coarse.corners.size() > 990);
  CHECK(coarse.points.size() == coarse.corners.size() / 2 + 2);  // Euler
  const TriangleEdges edges = edges_of(coarse);
  for (const TriangleFlaw& flaw : {edges.open, edges.branched, edges.turned})
    CHECK(flaw.count == 0);
  for (const Vec<3>& x : coarse.points) CHECK(x.norm() == test::within(0.01, radius));
  CHECK(enclosed_volume(coarse) ==
        test::within(0.02, 4.0 / 3 * std::numbers::pi * std::pow(radius, 3)));
}

TEST_CASE("bends and borders stay in their places where flat parts have fewer triangles") {
  Triangles fine = roof(30);
  for (Vec<3>& x : fine.points) x += Vec<3>(652'000, 5'163'000, 0);  // coordinates of a map
  const Triangles coarse = coarser(fine, 60);
  CHECK(coarse.corners.size() <= 60);
  double area = 0, in_plan = 0;
  for (Index t = 0; t < static_cast<Index>(coarse.corners.size()); ++t) {
    area += 0.5 * coarse.area_vector(t).norm();
    in_plan += 0.5 * coarse.area_vector(t)[2];
  }
  constexpr double rounding = 1e-7;
  CHECK(area == doctest::Approx(std::numbers::sqrt2).epsilon(rounding));
  CHECK(in_plan == doctest::Approx(1).epsilon(rounding));
}

TEST_CASE("a surface of few triangles stays as it is") {
  const Triangles surface = roof(3);
  CHECK(coarser(surface, surface.corners.size()).corners == surface.corners);
}
