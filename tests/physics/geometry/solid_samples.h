/// \file What is true of any solid, asked at random points, and triangulations of known bodies.
#pragma once

#include <doctest/doctest.h>

#include <cmath>
#include <functional>
#include <random>

#include "physics/geometry/solid.h"
#include "physics/geometry/triangles.h"

namespace lahar::test {

template <int Dim>
Vec<Dim> random_point(std::mt19937& random, double low, double high) {
  std::uniform_real_distribution<double> along(low, high);
  Vec<Dim> x;
  for (int d = 0; d < Dim; ++d) x[d] = along(random);
  return x;
}

/// At points of [low, high]^Dim: normals have length 1, distances change by the way at most, and
/// their gradient is the normal but near places where the nearest point jumps (at most `jumps` of
/// the points). contains() agrees with the sign.
template <int Dim>
void check_distances(const Solid<Dim>& solid, double low, double high, double jumps) {
  constexpr int points = 4000;
  constexpr double h = 1e-5;
  std::mt19937 random(7);
  int off = 0;
  for (int i = 0; i < points; ++i) {
    const auto x = random_point<Dim>(random, low, high), y = random_point<Dim>(random, low, high);
    const auto at_x = solid.nearest(x);
    CHECK(at_x.normal.norm() == doctest::Approx(1).epsilon(1e-12));
    CHECK(solid.contains(x) == (at_x.distance <= 0));
    CHECK(std::abs(at_x.distance - solid.nearest(y).distance) <= (x - y).norm() + 1e-12);
    Vec<Dim> gradient;
    for (int d = 0; d < Dim; ++d)
      gradient[d] = (solid.nearest(x + h * Vec<Dim>::Unit(d)).distance -
                     solid.nearest(x - h * Vec<Dim>::Unit(d)).distance) /
                    (2 * h);
    if ((gradient - at_x.normal).norm() > 1e-3) ++off;
  }
  CHECK(off <= jumps * points);
}

/// Twelve triangles around a box.
inline Triangles box_of_triangles(const Vec<3>& low, const Vec<3>& high) {
  Triangles t;
  for (int corner = 0; corner < 8; ++corner)
    t.points.emplace_back(corner & 1 ? high[0] : low[0], corner & 2 ? high[1] : low[1],
                          corner & 4 ? high[2] : low[2]);
  t.corners = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
               {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return t;
}

/// A surface around the origin: in rings from pole to pole, `radius(direction)` away.
inline Triangles star(int rings, const std::function<double(const Vec<3>&)>& radius) {
  Triangles t;
  const int around = 2 * rings;
  const auto add = [&](double polar, double angle) {
    const Vec<3> to(std::sin(polar) * std::cos(angle), std::sin(polar) * std::sin(angle),
                    std::cos(polar));
    t.points.push_back(radius(to) * to);
  };
  add(0, 0);
  for (int i = 1; i < rings; ++i)
    for (int j = 0; j < around; ++j) add(M_PI * i / rings, 2 * M_PI * j / around);
  add(M_PI, 0);
  const auto last = static_cast<Local>(t.points.size()) - 1;
  const auto id = [&](int i, int j) {
    return static_cast<Local>(1 + (i - 1) * around + j % around);
  };
  for (int j = 0; j < around; ++j) {
    t.corners.push_back({0, id(1, j), id(1, j + 1)});
    t.corners.push_back({id(rings - 1, j), last, id(rings - 1, j + 1)});
    for (int i = 1; i < rings - 1; ++i) {
      t.corners.push_back({id(i, j), id(i + 1, j), id(i + 1, j + 1)});
      t.corners.push_back({id(i, j), id(i + 1, j + 1), id(i, j + 1)});
    }
  }
  return t;
}

}  // namespace lahar::test
