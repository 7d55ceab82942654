// The series that `lahar verify plate-with-hole` compares with and fits to particles.
#include "runtime/verify/hole_series.h"

#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

#include "tests/within.h"

using namespace lahar;

TEST_CASE("the series of a plate with a hole: a wide plate gives Kirsch's solution") {
  // Kirsch (1898) along the ligament: xx = 1 + a^2 / (2 r^2) + 3 a^4 / (2 r^4). Width 200 a.
  HoleSeries series(0.5, std::hypot(100, 160) / 2, 24);
  CHECK(series.fit_tension(160, 100, 1) < 1e-4);
  for (const double r : {0.5, 0.6, 0.75, 1.0, 2.0}) {
    const double q = 0.25 / (r * r);
    CHECK(series.stress({0, r})[0] == test::within(1e-3, 1 + q / 2 + 1.5 * q * q));
  }
  CHECK(series.stress({0.5, 0})[1] == test::within(1e-3, -1));
}

TEST_CASE("the series of a plate with a hole: the hole is free, the ligament carries the load") {
  HoleSeries series(0.5, std::hypot(8, 5) / 2, 24);
  CHECK(series.fit_tension(8, 5, 100) < 1e-2);
  for (int k = 0; k <= 10; ++k) {
    const double theta = k * std::numbers::pi / 20, c = std::cos(theta), s = std::sin(theta);
    const PlaneStress stress = series.stress({0.5 * c, 0.5 * s});
    CHECK(std::abs(stress[0] * c + stress[2] * s) < 1e-9);
    CHECK(std::abs(stress[2] * c + stress[1] * s) < 1e-9);
  }
  double force = 0;
  constexpr int n = 4000;  // midpoint rule
  for (int k = 0; k < n; ++k) force += series.stress({0, 0.5 + 2.0 * (k + 0.5) / n})[0] * 2.0 / n;
  CHECK(force == test::within(1e-5, 250));
  // Bilinear finite elements of this plate, extrapolated to zero size
  // (tests/examples/howland_test.py).
  CHECK(series.stress({0, 0.5})[0] == test::within(1e-4, 317.57));
  CHECK(series.stress({0.5, 0})[1] == test::within(1e-4, -114.81));
}

TEST_CASE("the series of a plate with a hole: a long plate gives Howland's numbers") {
  // Howland (1930), hole / width 0.2: 3.14 and -1.11, within 1 %.
  HoleSeries series(0.5, std::hypot(16, 5) / 2, 24);
  CHECK(series.fit_tension(16, 5, 1) < 1e-3);
  CHECK(series.stress({0, 0.5})[0] == test::within(0.01, 3.14));
  CHECK(series.stress({0.5, 0})[1] == test::within(0.01, -1.11));
}

TEST_CASE(
    "the series of a plate with a hole: fitted to exact stresses, seven terms give those at the "
    "hole") {
  HoleSeries exact(0.5, std::hypot(8, 5) / 2, 24), fitted(0.5, 1.5, 4);
  exact.fit_tension(8, 5, 1);
  std::vector<Vec<2>> points;
  std::vector<PlaneStress> stresses;
  for (double x = 0.03; x < 1.5; x += 0.06)
    for (double y = 0.03; y < 1.5; y += 0.06)
      if (std::hypot(x, y) > 0.5625 && std::hypot(x, y) < 1.5) {
        points.push_back({x, y});
        stresses.push_back(exact.stress({x, y}));
      }
  fitted.fit(points, stresses);
  CHECK(fitted.stress({0, 0.5})[0] == test::within(1e-4, exact.stress({0, 0.5})[0]));
  CHECK(fitted.stress({0.5, 0})[1] == test::within(1e-4, exact.stress({0.5, 0})[1]));
}
