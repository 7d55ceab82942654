// Surfaces that pass through themselves.
#include <doctest/doctest.h>

#include <cmath>
#include <random>

#include "physics/geometry/triangle_tree.h"
#include "tests/physics/geometry/solid_samples.h"

using namespace lahar;
using namespace lahar::test;

namespace {

void add(Triangles& to, const Triangles& more) {
  const auto first = static_cast<Local>(to.points.size());
  to.points.insert(to.points.end(), more.points.begin(), more.points.end());
  for (auto corner : more.corners) {
    for (Local& c : corner) c += first;
    to.corners.push_back(corner);
  }
}

Triangles two_boxes(const Vec<3>& low, const Vec<3>& high) {
  Triangles t = box_of_triangles({0, 0, 0}, {2, 2, 2});
  add(t, box_of_triangles(low, high));
  return t;
}

Index crossings(Triangles t) {
  return TriangleTree(std::move(t)).crossings().count;
}

Triangles bumpy(int rings, double inwards) {
  return star(rings, [=](const Vec<3>& to) {
    return 1 + 0.3 * std::sin(5 * to[0]) * std::cos(7 * to[1]) - inwards * std::exp(-9 * to[2]);
  });
}

/// All pairs, one by one: whether an edge of one passes through the other, by volumes.
Index crossings_of_all(const Triangles& t) {
  const auto volume = [](const Vec<3>& a, const Vec<3>& b, const Vec<3>& c, const Vec<3>& d) {
    return Vec<3>(b - a).cross(Vec<3>(c - a)).dot(d - a);
  };
  const auto pierces = [&](Index s, Index o) {
    const Vec<3> a = t.point(o, 0), b = t.point(o, 1), c = t.point(o, 2);
    for (int k = 0; k < 3; ++k) {
      const Vec<3> p = t.point(s, k), q = t.point(s, (k + 1) % 3);
      const double u = volume(p, q, a, b), v = volume(p, q, b, c), w = volume(p, q, c, a);
      if (volume(a, b, c, p) * volume(a, b, c, q) < 0 && u * v > 0 && v * w > 0) return true;
    }
    return false;
  };
  Index count = 0;
  const auto n = static_cast<Index>(t.corners.size());
  for (Index s = 0; s < n; ++s)
    for (Index o = s + 1; o < n; ++o) {
      int common = 0;
      for (const Local p : t.corners[static_cast<std::size_t>(s)])
        for (const Local q : t.corners[static_cast<std::size_t>(o)]) common += p == q;
      count += common == 0 && (pierces(s, o) || pierces(o, s));
    }
  return count;
}

}  // namespace

TEST_CASE("bodies that are apart, inside of each other or touch do not cross") {
  CHECK(crossings(box_of_triangles({0, 0, 0}, {1, 2, 3})) == 0);
  CHECK(crossings(bumpy(40, 0)) == 0);
  CHECK(crossings(two_boxes({3, 0, 0}, {4, 1, 1})) == 0);
  CHECK(crossings(two_boxes({0.5, 0.5, 0.5}, {1, 1, 1})) == 0);
  CHECK(crossings(two_boxes({2, 0, 0}, {3, 2, 2})) == 0);             // face to face
  CHECK(crossings(two_boxes({2, 0.5, 0.5}, {3, 1, 1})) == 0);         // on a part of a face
  CHECK(crossings(two_boxes({2, 2, 0}, {3, 3, 1})) == 0);             // at an edge
  CHECK(crossings(two_boxes({2, 2, 2}, {3, 3, 3})) == 0);             // at a corner
  CHECK(crossings(two_boxes({2 + 1e-9, 0.1, 0.1}, {3, 1, 1})) == 0);  // nearly
}

TEST_CASE("bodies that overlap cross, and the place is where they do") {
  const Vec<3> low(1.5, 0.25, 0.5), high(3, 1, 1.75);
  const TriangleTree tree(two_boxes(low, high));
  const TriangleCrossings found = tree.crossings();
  CHECK(found.count >= 4);
  CHECK(found.at[0] == doctest::Approx(2));  // on the face that the other box passes through
  for (int d = 1; d < 3; ++d) {
    CHECK(found.at[d] >= low[d] - 1e-12);
    CHECK(found.at[d] <= high[d] + 1e-12);
  }
  CHECK(found.first != found.second);
  CHECK(crossings(two_boxes({2 - 1e-9, 0.1, 0.1}, {3, 1, 1})) > 0);
  CHECK(crossings(two_boxes({-1, 0.5, 0.25}, {3, 1.25, 1})) > 0);  // right through
}

TEST_CASE("crossings of a surface with itself are those of all pairs") {
  // A corner is pulled through the other side of the surface.
  for (const int rings : {6, 12, 25}) {
    Triangles t = bumpy(rings, 0);
    t.points.front() = -1.7 * t.points.front() + Vec<3>(0.01, 0.02, 0.03);
    const Index found = crossings(t);
    CHECK(found > 0);
    CHECK(found == crossings_of_all(t));
  }
  std::mt19937 random(3);
  std::uniform_real_distribution<double> at(0, 1);
  Triangles soup;
  for (int i = 0; i < 300; ++i) {
    const Vec<3> x(at(random), at(random), at(random));
    for (int k = 0; k < 3; ++k)
      soup.points.push_back(x + 0.2 * Vec<3>(at(random), at(random), at(random)));
    soup.corners.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  CHECK(crossings(soup) > 30);
  CHECK(crossings(soup) == crossings_of_all(soup));
}

TEST_CASE("the search for crossings ends where there are very many") {
  Triangles sheets;  // 1100 upright ones along x through as many along y
  const auto put = [&](const Vec<3>& a, const Vec<3>& b, const Vec<3>& c) {
    const auto first = static_cast<Local>(sheets.points.size());
    sheets.points.insert(sheets.points.end(), {a, b, c});
    sheets.corners.push_back({first, first + 1, first + 2});
  };
  for (int i = 0; i < 1100; ++i) {
    put({0.0, 1.0 + i, -1}, {2000, 1.0 + i, -1}, {1000, 1.0 + i, 4000});
    put({1.0 + i, 0, -2}, {1.0 + i, 2000, -2}, {1.0 + i, 1000, 4000});
  }
  CHECK(crossings(sheets) == TriangleCrossings::most);
}
