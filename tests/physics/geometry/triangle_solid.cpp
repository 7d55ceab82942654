#include "physics/geometry/triangle_solid.h"

#include <doctest/doctest.h>

#include <thread>

#include "tests/physics/geometry/solid_samples.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// The share of the full sphere that a surface covers, seen from x: 1 inside, 0 outside (Van
/// Oosterom & Strackee 1983).
double winding(const Triangles& t, const Vec<3>& x) {
  double sum = 0;
  for (Index i = 0; i < static_cast<Index>(t.corners.size()); ++i) {
    const Vec<3> a = t.point(i, 0) - x, b = t.point(i, 1) - x, c = t.point(i, 2) - x;
    const double la = a.norm(), lb = b.norm(), lc = c.norm();
    sum += 2 * std::atan2(a.dot(b.cross(c)),
                          la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
  }
  return sum / (4 * M_PI);
}

/// The distance to all triangles, one by one, by parts of the barycentric coordinates.
double distance_to_all(const Triangles& t, const Vec<3>& x) {
  double least = 1e300;
  for (Index i = 0; i < static_cast<Index>(t.corners.size()); ++i) {
    const Vec<3> n = t.area_vector(i).normalized();
    const double off = n.dot(x - t.point(i, 0));
    const Vec<3> foot = x - off * n;
    bool within = true;
    for (int k = 0; k < 3; ++k) {
      const Vec<3> a = t.point(i, k), b = t.point(i, (k + 1) % 3);
      within = within && n.dot((b - a).cross(foot - a)) >= 0;
      const double along = std::clamp((x - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
      least = std::min(least, (x - a - along * (b - a)).norm());
    }
    if (within) least = std::min(least, std::abs(off));
  }
  return least;
}

Triangles rugged(int rings) {
  return star(rings, [](const Vec<3>& to) {
    return 1 + 0.4 * std::sin(5 * to[0]) * std::cos(7 * to[1]) + 0.2 * std::sin(11 * to[2]);
  });
}

}  // namespace

TEST_CASE("a box of triangles answers like the box") {
  const Vec<3> low(1, -2, 0), high(3, 1, 0.5);
  const auto exact = box<3>(low, high);
  const auto solid = solid_of_triangles(box_of_triangles(low, high));
  check_distances(*solid, -3, 4, 2e-2);
  std::mt19937 random(4);
  for (int i = 0; i < 5000; ++i) {
    const auto x = random_point<3>(random, -3, 4);
    const auto a = exact->nearest(x), b = solid->nearest(x);
    CHECK(std::abs(a.distance - b.distance) < 1e-13);
    if (a.distance > 0) CHECK((a.normal - b.normal).norm() < 1e-12);
  }
  CHECK(solid->bounds().first == low);
  CHECK(solid->bounds().second == high);
}

TEST_CASE("normals on a surface of triangles are those of faces, edges and corners") {
  const auto solid = solid_of_triangles(box_of_triangles({0, 0, 0}, {1, 1, 1}));
  CHECK(solid->nearest({0.3, 0.4, 1}).normal == Vec<3>(0, 0, 1));
  CHECK(solid->nearest({0.3, 0.4, 1.25}).normal == Vec<3>(0, 0, 1));
  CHECK(solid->nearest({0.5, 0.5, 1}).normal == Vec<3>(0, 0, 1));  // between two of a face
  CHECK((solid->nearest({1, 0.4, 1}).normal - Vec<3>(1, 0, 1).normalized()).norm() < 1e-14);
  CHECK((solid->nearest({1, 1, 1}).normal - Vec<3>(1, 1, 1).normalized()).norm() < 1e-14);
  CHECK(solid->nearest({1, 1, 1}).distance == 0);
  CHECK((solid->nearest({1, 1 + 3e-6, 1 + 4e-6}).normal - Vec<3>(0, 0.6, 0.8)).norm() < 1e-9);
}

TEST_CASE("distances to triangles are those of a search of all, sides those of solid angles") {
  for (const int rings : {3, 12}) {
    const Triangles t = rugged(rings);
    const auto solid = solid_of_triangles(t);
    std::mt19937 random(5);
    for (int i = 0; i < 2000; ++i) {
      Vec<3> x = random_point<3>(random, -1.8, 1.8);
      if (i % 4 == 0) x = t.points[static_cast<std::size_t>(i) % t.points.size()] + 1e-3 * x;
      const auto found = solid->nearest(x);
      CHECK(std::abs(std::abs(found.distance) - distance_to_all(t, x)) < 1e-12);
      CHECK((found.distance < 0) == (winding(t, x) > 0.5));
    }
    check_distances(*solid, -1.8, 1.8, 2e-2);
  }
}

TEST_CASE("triangles far from the origin of coordinates lose no digits but those of coordinates") {
  Triangles here = rugged(8), there = here;
  const Vec<3> shift(4.5e5, 5.2e6, 1800);
  for (Vec<3>& x : there.points) x += shift;
  for (std::size_t i = 0; i < here.points.size(); ++i) here.points[i] = there.points[i] - shift;
  const auto a = solid_of_triangles(here), b = solid_of_triangles(there);
  std::mt19937 random(6);
  for (int i = 0; i < 2000; ++i) {
    const auto x = random_point<3>(random, -2, 2);
    CHECK(std::abs(a->nearest(x).distance - b->nearest(x + shift).distance) < 5e-9);
  }
}

TEST_CASE("beyond their band distances are right in sign and not too large") {
  const Triangles t = rugged(10);
  const double band = 0.1;
  const auto exact = solid_of_triangles(t), banded = solid_of_triangles(t, band);
  std::mt19937 random(7);
  int beyond = 0;
  for (int i = 0; i < 4000; ++i) {
    const auto x = random_point<3>(random, -2.5, 2.5);
    const auto a = exact->nearest(x), b = banded->nearest(x);
    CHECK((a.distance < 0) == (b.distance < 0));
    if (std::abs(a.distance) <= band) {
      CHECK(a.distance == b.distance);
      CHECK(a.normal == b.normal);
    } else {
      ++beyond;
      CHECK(std::abs(b.distance) >= band);
      CHECK(std::abs(b.distance) <= std::abs(a.distance));
    }
    CHECK(banded->contains(x) == (a.distance <= 0));
  }
  CHECK(beyond > 1000);
}

TEST_CASE("a solid of triangles may be hollow, and of several bodies") {
  Triangles t = box_of_triangles({0, 0, 0}, {4, 4, 4});
  const auto add = [&](Triangles more) {
    const auto first = static_cast<Local>(t.points.size());
    t.points.insert(t.points.end(), more.points.begin(), more.points.end());
    for (auto& corner : more.corners) {
      for (Local& c : corner) c += first;
      t.corners.push_back(corner);
    }
  };
  Triangles hole = box_of_triangles({1, 1, 1}, {3, 3, 3});
  turn_over(hole);
  add(hole);
  add(box_of_triangles({6, 0, 0}, {7, 1, 1}));
  CHECK(enclosed_volume(t) == doctest::Approx(64 - 8 + 1));
  const auto solid = solid_of_triangles(t);
  CHECK(solid->nearest({2, 2, 2}).distance == 1);
  CHECK(solid->nearest({2, 2, 0.75}).distance == -0.25);
  CHECK(solid->nearest({2, 2, 1.25}).normal == Vec<3>(0, 0, 1));
  CHECK(solid->contains({6.5, 0.5, 0.5}));
  CHECK(!solid->contains({5, 0.5, 0.5}));
}

TEST_CASE("many threads get the same answers from a solid of triangles") {
  const auto solid = solid_of_triangles(rugged(16), 0.3);
  const auto ask = [&] {
    std::mt19937 random(8);
    double sum = 0;
    for (int i = 0; i < 20000; ++i) sum += solid->nearest(random_point<3>(random, -2, 2)).distance;
    return sum;
  };
  const double alone = ask();
  std::vector<double> sums(4);
  std::vector<std::thread> threads;
  for (double& sum : sums) threads.emplace_back([&] { sum = ask(); });
  for (auto& thread : threads) thread.join();
  for (const double sum : sums) CHECK(sum == alone);
}
