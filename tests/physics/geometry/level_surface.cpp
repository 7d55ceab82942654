#include "physics/geometry/level_surface.h"

#include <doctest/doctest.h>

#include <cmath>
#include <map>
#include <numbers>

#include "tests/physics/geometry/ball_grid.h"
#include "tests/within.h"

using namespace lahar;
using test::ball;

TEST_CASE("the line around a disc is closed, has its length, and the disc on its left") {
  const double radius = 0.7;
  double before = 1;
  for (const double spacing : {0.1, 0.05}) {
    const Lines line = level_surface(ball<2>(radius, spacing), 0);
    std::map<Local, int> begins, ends;
    double length = 0, area = 0;
    for (const auto& [a, b] : line.corners) {
      ++begins[a], ++ends[b];
      const Vec<2>&x = line.points[static_cast<std::size_t>(a)],
            y = line.points[static_cast<std::size_t>(b)];
      length += (y - x).norm();
      area += 0.5 * (x[0] * y[1] - x[1] * y[0]);
    }
    CHECK(begins.size() == line.points.size());
    for (const auto& [point, count] : begins) CHECK((count == 1 && ends[point] == 1));
    const double error = std::abs(length / (2 * std::numbers::pi * radius) - 1);
    CHECK(error < 0.6 * before);
    CHECK(area == test::within(0.02, std::numbers::pi * radius * radius));
    before = error;
  }
  CHECK(before < 0.01);
}

TEST_CASE("the surface of a ball is closed and encloses its volume") {
  const double radius = 0.7;
  const Triangles surface = level_surface(ball<3>(radius, 0.05), 0);
  const TriangleEdges edges = edges_of(surface);
  CHECK(edges.open.count == 0);
  CHECK(edges.turned.count == 0);
  CHECK(enclosed_volume(surface) ==
        test::within(0.01, 4.0 / 3 * std::numbers::pi * std::pow(radius, 3)));
}

TEST_CASE("a surface that leaves the grid ends there") {
  GridValues<3> grid{
      .low = Vec<3>::Zero(), .spacing = {0.5, 0.5, 0.5}, .n = {3, 4, 5}, .values = {}};
  for (Index point = 0; point < grid.size(); ++point)
    grid.values.push_back(static_cast<float>(0.8 - grid.place(point)[2]));
  const Triangles plane = level_surface(grid, 0);
  Vec<3> area = Vec<3>::Zero();
  for (Index t = 0; t < static_cast<Index>(plane.corners.size()); ++t)
    area += 0.5 * plane.area_vector(t);
  CHECK((area - Vec<3>(0, 0, 1 * 1.5)).norm() < 1e-6);
  for (const Vec<3>& x : plane.points) CHECK(x[2] == doctest::Approx(0.8));
  CHECK(level_surface(grid, 10).corners.empty());
}
