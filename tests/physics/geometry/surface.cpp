#include "physics/geometry/surface.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/physics/geometry/solid_samples.h"

using namespace lahar;
using namespace lahar::test;

namespace {

constexpr float unknown = std::numeric_limits<float>::quiet_NaN();

/// Heights of a bilinear function at the points of axes.
template <class F>
Surface<3> surface_of(const Surface<3>::Axes& axes, const F& f) {
  std::vector<float> heights;
  for (const double y : axes[1])
    for (const double x : axes[0]) heights.push_back(static_cast<float>(f(x, y)));
  return {axes, heights};
}

}  // namespace

TEST_CASE("surfaces give bilinear functions back, with their slopes") {
  const auto f = [](double x, double y) { return 2 + 0.5 * x - 0.25 * y + 0.125 * x * y; };
  const std::vector<double> even{0, 1, 2, 3, 4}, graded{-1, 0, 0.5, 4};
  for (const auto& axes : {Surface<3>::Axes{even, even}, Surface<3>::Axes{graded, even}}) {
    const auto surface = surface_of(axes, f);
    std::mt19937 random(3);
    for (int i = 0; i < 1000; ++i) {
      const auto x = random_point<3>(random, 0, 4);
      const auto point = surface.at(x);
      CHECK(point.height == doctest::Approx(f(x[0], x[1])).epsilon(1e-12));
      CHECK(point.slope[0] == doctest::Approx(0.5 + 0.125 * x[1]).epsilon(1e-12));
      CHECK(point.slope[1] == doctest::Approx(-0.25 + 0.125 * x[0]).epsilon(1e-12));
      CHECK(point.slope[2] == 0);
    }
    CHECK(surface.bounds().first[0] == axes[0].front());
    CHECK(surface.bounds().second[2] == 5);
  }
}

TEST_CASE("the place on an axis is the one that a search finds, also at its points") {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> step(0.1, 4);
  for (int trial = 0; trial < 200; ++trial) {
    // Equal steps but for the ends, as centres and borders of a raster are, or any.
    std::vector<double> axis{0, step(random)};
    const bool raster = trial % 2 == 0;
    for (int i = 0; i < 2 + trial % 20; ++i)
      axis.push_back(axis.back() + (raster ? 2 : step(random)));
    axis.push_back(axis.back() + step(random));
    std::vector<float> heights;
    for (std::size_t i = 0; i < axis.size(); ++i)
      heights.push_back(static_cast<float>(step(random)));
    const Surface<2> line({axis}, heights);
    const auto check = [&](double x) {
      const auto above = std::upper_bound(axis.begin() + 1, axis.end() - 1, x) - axis.begin();
      const auto i = static_cast<std::size_t>(above - 1);
      const double length = axis[i + 1] - axis[i], rise = double(heights[i + 1]) - heights[i];
      CHECK(line.at({x, 0}).height == heights[i] + (x - axis[i]) / length * rise);
      CHECK(line.at({x, 0}).slope[0] == rise / length);
    };
    for (const double x : axis) check(x);
    std::uniform_real_distribution<double> anywhere(0, axis.back());
    for (int i = 0; i < 50; ++i) check(anywhere(random));
  }
}

TEST_CASE("surfaces are continuous, and meet their points at both ends of the axes") {
  const Surface<2> line({{{0, 1, 3}}}, {1, 4, -2});
  CHECK(line.height({0, 9}) == 1);
  CHECK(line.height({1, 9}) == 4);
  CHECK(line.height({3, 9}) == -2);
  CHECK(line.height({2, 9}) == 1);
  CHECK(line.at({2, 0}).slope[0] == -3);
  for (const double x : {1.0, 2.0})
    CHECK(std::abs(line.height({x - 1e-9, 0}) - line.height({x + 1e-9, 0})) < 1e-7);
  const Surface<3> saddle({{{0, 1, 2}, {0, 1, 2}}}, {0, 1, 0, 2, -3, 1, 5, 4, 0});
  CHECK(saddle.height({2, 2, 0}) == 0);
  CHECK(saddle.height({0, 2, 0}) == 5);
  for (double y = 0; y <= 2; y += 0.125)
    CHECK(std::abs(saddle.height({1 - 1e-9, y, 0}) - saddle.height({1 + 1e-9, y, 0})) < 1e-7);
}

TEST_CASE("there is no surface outside of its axes, and where heights are not known") {
  const Surface<2> line({{{0, 1, 2, 3}}}, {1, 2, unknown, 4});
  CHECK(std::isnan(line.height({-1e-9, 0})));
  CHECK(std::isnan(line.height({3.0000001, 0})));
  CHECK(std::isnan(line.height({std::numeric_limits<double>::quiet_NaN(), 0})));
  CHECK(line.height({0.5, 0}) == 1.5);
  CHECK(line.height({1, 0}) == 2);  // known from one of its sides
  CHECK(std::isnan(line.height({1.5, 0})));
  CHECK(std::isnan(line.height({2.5, 0})));
  CHECK(line.bounds().second[1] == 4);
  const Surface<3> corner({{{0, 1, 2}, {0, 1, 2}}},
                          {1, 2, unknown, 3, 4, unknown, unknown, unknown, unknown});
  CHECK(corner.height({1, 1, 0}) == 4);
  CHECK(corner.height({0.5, 1, 0}) == 3.5);
  CHECK(corner.height({1, 0.5, 0}) == 3);
  CHECK(corner.at({1, 0.5, 0}).slope[1] == 2);
  CHECK(std::isnan(corner.height({1 + 1e-9, 1, 0})));
  CHECK(std::isnan(Surface<3>().height({0, 0, 0})));
}
