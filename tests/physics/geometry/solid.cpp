#include "physics/geometry/solid.h"

#include <doctest/doctest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <vector>

#include "physics/geometry/solid_samples.h"
#include "tests/physics/geometry/solid_samples.h"

using namespace lahar;
using namespace lahar::test;

namespace {

constexpr double inf = std::numeric_limits<double>::infinity();

/// A distance and normal at a point are these.
template <int Dim>
void check_at(const Solid<Dim>& solid, const Vec<Dim>& x, double distance, const Vec<Dim>& normal) {
  const auto found = solid.nearest(x);
  CAPTURE(x.transpose());
  CAPTURE(found.normal.transpose());
  CHECK(found.distance == doctest::Approx(distance).epsilon(1e-13));
  CHECK((found.normal - normal).norm() < 1e-13);
}

}  // namespace

TEST_CASE("distances to half spaces are along their normal") {
  const Vec<2> slope = Vec<2>(-1, 2).normalized();
  const auto in_plane = half_space<2>({1, 1}, slope);
  check_distances(*in_plane, -3, 3, 0);
  check_at<2>(*in_plane, Vec<2>(1, 1) + 0.5 * slope + 3 * Vec<2>(2, 1), 0.5, slope);
  CHECK(in_plane->bounds().second == Vec<2>::Constant(inf));
  const auto ground = half_space<3>({0, 0, 2}, Vec<3>::UnitZ());
  check_at<3>(*ground, {5, -7, 1.5}, -0.5, Vec<3>::UnitZ());
  CHECK(ground->bounds().second == Vec<3>(inf, inf, 2));
  CHECK(ground->bounds().first == Vec<3>::Constant(-inf));
}

TEST_CASE("distances to balls are those to the centre less the radius") {
  const auto disc = ball<2>({1, 0}, 0.5);
  check_distances(*disc, -2, 2, 1e-3);
  check_at<2>(*disc, {1, 2}, 1.5, {0, 1});
  check_at<2>(*disc, {0.75, 0}, -0.25, {-1, 0});
  const auto sphere = ball<3>({1, 2, 3}, 2);
  check_distances(*sphere, -2, 4, 1e-3);
  check_at<3>(*sphere, {4, 2, 7}, 3, {0.6, 0, 0.8});
  CHECK(sphere->nearest({1, 2, 3}).distance == -2);
  CHECK(sphere->bounds().first == Vec<3>(-1, 0, 1));
}

TEST_CASE("distances to boxes are those to faces, edges and corners") {
  const auto square = box<2>({0, 0}, {2, 1});
  check_distances(*square, -1, 3, 5e-3);
  check_at<2>(*square, {3, 0.5}, 1, {1, 0});
  check_at<2>(*square, {-3, -4}, 5, {-0.6, -0.8});
  check_at<2>(*square, {1.75, 0.5}, -0.25, {1, 0});
  const auto cube = box<3>({0, 0, 0}, {1, 1, 1});
  check_distances(*cube, -1, 2, 5e-3);
  check_at<3>(*cube, {1.3, 0.5, 1.4}, 0.5, {0.6, 0, 0.8});
  check_at<3>(*cube, {0.5, 0.5, 1}, 0, {0, 0, 1});
  CHECK(cube->bounds().second == Vec<3>(1, 1, 1));
}

TEST_CASE("distances to frustums are those to mantle, rims and ends") {
  const auto cylinder = frustum<3>({0, 0, 1}, {0, 0, 3}, 0.5, 0.5);
  check_distances(*cylinder, -2, 4, 1e-2);
  check_at<3>(*cylinder, {2, 0, 2}, 1.5, {1, 0, 0});
  check_at<3>(*cylinder, {0, 0.25, 3.5}, 0.5, {0, 0, 1});
  check_at<3>(*cylinder, {0, 0.8, 3.4}, 0.5, {0, 0.6, 0.8});
  check_at<3>(*cylinder, {0, 0, 1.1}, -0.1, {0, 0, -1});
  const auto cone = frustum<3>({0, 0, 0}, {0, 0, 4}, 3, 0);
  check_distances(*cone, -5, 5, 1e-2);
  check_at<3>(*cone, {1.5 + 0.8, 0, 2 + 0.6}, 1, {0.8, 0, 0.6});
  check_at<3>(*cone, {0, 0, 5}, 1, {0, 0, 1});
  const auto leaning = frustum<3>({1, 0, 0}, {2, 2, 2}, 0.25, 1);
  check_distances(*leaning, -2, 4, 1e-2);
  const Vec<3> low = leaning->bounds().first, high = leaning->bounds().second;
  std::mt19937 random(1);
  for (int i = 0; i < 1000; ++i) {
    const auto x = random_point<3>(random, -2, 4);
    if (leaning->contains(x)) CHECK(((x - low).minCoeff() >= 0 && (high - x).minCoeff() >= 0));
  }
  const auto trapezium = frustum<2>({0, 0}, {0, 2}, 2, 1);
  check_distances(*trapezium, -3, 3, 5e-3);
  check_at<2>(*trapezium, {0, 2.5}, 0.5, {0, 1});
  check_distances(*frustum<2>({0, 0}, {1, 2}, 1, 0), -3, 3, 5e-3);
}

TEST_CASE("distances to polygons are the same for both orientations") {
  const std::vector<Vec<2>> corner{{0, 0}, {4, 0}, {4, 4}, {2, 1}, {0, 4}};  // with a notch
  const std::vector<Vec<2>> turned(corner.rbegin(), corner.rend());
  const auto a = polygon(corner), b = polygon(turned);
  check_distances(*a, -1, 5, 1e-2);
  std::mt19937 random(2);
  for (int i = 0; i < 1000; ++i) {
    const auto x = random_point<2>(random, -1, 5);
    CHECK(a->nearest(x).distance == doctest::Approx(b->nearest(x).distance).epsilon(1e-13));
  }
  CHECK(a->nearest({2, 3}).distance > 0);  // in the notch
  CHECK(a->nearest({2, 0.5}).distance < 0);
  check_at<2>(*a, {2, -1}, 1, {0, -1});
  check_at<2>(*a, {5, 2}, 1, {1, 0});
  check_at<2>(*a, {1, 0}, 0, {0, -1});
  CHECK(a->nearest({4, 4}).distance == 0);
  CHECK(a->bounds().second == Vec<2>(4, 4));
}

TEST_CASE("below a surface, distances are those to its tangent") {
  Surface<2>::Axes axes{{{0, 1, 2}}};
  const auto line = std::make_shared<const Surface<2>>(axes, std::vector<float>{0, 1, 1});
  const auto ground = below<2>(line);
  const double s = std::sqrt(0.5);
  check_at<2>(*ground, {0.5, 1.5}, s, {-s, s});
  check_at<2>(*ground, {1.5, 0.75}, -0.25, {0, 1});
  CHECK(ground->nearest({2.5, 0}).distance == inf);
  CHECK(ground->contains({0.5, 0.5}));
  CHECK(!ground->contains({0.5, 0.51}));
  CHECK(ground->bounds().first == Vec<2>(0, -inf));
  CHECK(ground->bounds().second == Vec<2>(2, 1));
}

TEST_CASE("what is said to be beyond a distance from terrain is so, gentle or steep") {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> height(0, 1), share(0, 3);
  for (const double relief : {0.0, 0.3, 5.0}) {
    std::vector<double> axis;
    for (int i = 0; i <= 6; ++i) axis.push_back(i);
    std::vector<float> heights;
    for (int i = 0; i < 49; ++i) heights.push_back(static_cast<float>(relief * height(random)));
    const auto surface = std::make_shared<const Surface<3>>(Surface<3>::Axes{axis, axis}, heights);
    const auto ground = below<3>(surface);
    std::vector<Vec<3>> points;  // of the surface
    for (int i = 0; i <= 120; ++i)
      for (int j = 0; j <= 120; ++j) {
        Vec<3> x(0.05 * i, 0.05 * j, 0);
        x[2] = surface->height(x);
        points.push_back(x);
      }
    int beyond = 0;
    for (int i = 0; i < 200; ++i) {
      Vec<3> x = random_point<3>(random, 1, 5);
      x[2] = surface->height(x) + share(random);
      const double asked = share(random);
      CHECK_FALSE(ground->is_beyond(x - Vec<3>(0, 0, 4), asked));
      if (!ground->is_beyond(x, asked)) continue;
      ++beyond;
      double nearest = inf;
      for (const Vec<3>& at : points) nearest = std::min(nearest, (x - at).norm());
      if (relief < 1)
        CHECK(nearest >= asked);
      else  // as contact sees it: by tangent planes
        CHECK((nearest >= asked || ground->nearest(x).distance >= asked));
    }
    CHECK(beyond > 20);
  }
}

// A turned box of six half-spaces: beside its edges the distance is one to a plane.
TEST_CASE("points of a surface lie on it, at the edges of an intersection, too") {
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.4, Vec<3>(1, 2, 3).normalized()).matrix();
  const Vec<3> half(1, 0.2, 0.3);
  std::vector<SolidPtr<3>> sides{box<3>(Vec<3>::Constant(-1.2), Vec<3>::Constant(1.2))};
  for (int d = 0; d < 3; ++d)
    for (const double side : {-1.0, 1.0}) {
      const Vec<3> out = side * turn.col(d);
      sides.push_back(half_space<3>(half[d] * out, out));
    }
  const auto all = surface_points<3>(*common<3>(sides), 20);
  CHECK(all.size() > 100);
  double worst = 0;
  int corners = 0, of_edges = 0;
  for (const auto& [x, out, is_sharp] : all) {
    const Vec<3> beyond = (turn.transpose() * x).cwiseAbs() - half;
    worst = std::max(worst, beyond.maxCoeff());
    const auto sides_here = (beyond.array() > -1e-6).count();
    CHECK((is_sharp ? sides_here > 1 : sides_here >= 1));
    corners += sides_here == 3 ? 1 : 0;
    of_edges += sides_here == 2 ? 1 : 0;
    CHECK(out.norm() == doctest::Approx(1));
  }
  CHECK(worst < 1e-6);
  CHECK(corners == 8);
  CHECK(of_edges > 60);  // 12 m of edges, points at 0.1 m
}

TEST_CASE("points of a surface go from end to end, with all corners") {
  const auto corners_of = [](const Solid<2>& solid) {
    std::vector<Vec<2>> corners;
    for (const auto& [x, out, is_sharp] : surface_points<2>(solid, 64))
      if (is_sharp) corners.push_back(x);
    return corners;
  };
  for (const double width : {0.1008, 0.3, 0.017}) {  // no multiples of the height / 64
    const auto corners = corners_of(*box<2>(Vec<2>(1, 2), Vec<2>(1 + width, 3)));
    REQUIRE(corners.size() == 4);
    double right = 0, upper = 0;
    for (const Vec<2>& x : corners) {
      right += std::abs(x[0] - 1 - width) < 1e-9 ? 1 : 0;
      upper += std::abs(x[1] - 3) < 1e-9 ? 1 : 0;
    }
    CHECK(right == 2);
    CHECK(upper == 2);
  }
  // A wedge of 20 degrees, and a notch: its inner corner is none.
  CHECK(corners_of(*polygon({{0, 0}, {1, 0.1}, {0.1, 0.34}})).size() == 3);
  CHECK(corners_of(*polygon({{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 2}})).size() == 5);
  CHECK(corners_of(*ball<2>(Vec<2>(0, 0), 1)).empty());
  for (const auto& point : surface_points<3>(*ball<3>(Vec<3>(0, 0, 0), 1), 20))
    CHECK_FALSE(point.is_sharp);
}

TEST_CASE("the normal of a polygon is that of its side, however near to it") {
  const double c = std::cos(0.3), s = std::sin(0.3);
  const Vec<2> along(c, s), out(-s, c), at(301.7, 42.1);
  const auto solid = polygon({at, at + along, at + along - out, at - out});
  for (double far = 1e-3; far > 1e-17; far *= 0.07)
    for (const double side : {-1.0, 1.0}) {
      const auto near = solid->nearest(at + 0.4 * along + side * far * out);
      CHECK((near.normal - out).norm() < 1e-12);
      CHECK(std::abs(near.distance - side * far) < 1e-13);
    }
}
