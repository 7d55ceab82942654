// Depth to which a ball sinks that is dropped on dry grains. Uehara, Ambroso, Ojha and Durian
// (2003), Phys. Rev. Lett. 90, 194301, and Ambroso, Santore, Abate and Durian (2005), Phys. Rev. E
// 71, 051305, measured for balls of 0.3 to 15 times the density of the grains
//
//     d = 0.14 / mu (rho_ball / rho_grains)^1/2 D^2/3 H^1/3
//
// where mu is the tangent of the angle of repose, D the diameter, and H the whole way of the ball,
// from where it is dropped to where it rests. Ambroso, Kamien and Durian (2005), Phys. Rev. E 72,
// 041305: it takes about three times as long as d at the speed of the impact.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "tests/verification/world.h"
#include "tests/within.h"

using namespace lahar;
using namespace lahar::verification;

namespace {

/// As in world/ball.json.
constexpr double diameter = 0.0254, grains = 1510, mu = 0.445, g = 9.81;

double law(double drop, double density, double depth) {
  return 0.14 / mu * std::sqrt(density / grains) * std::pow(diameter, 2.0 / 3) *
         std::cbrt(drop + depth);
}

Numbers fall(const Resolution& at, double drop, double density) {
  const double speed = std::sqrt(2 * g * drop);
  Curve depth;
  double stopped = 0;
  Observer observer;
  observer.history = [&, start = 0.0](const HistoryRow& row) mutable {
    const RigidBodyRow& ball = row.bodies.at(0);
    if (depth.x.empty()) start = ball.place[1];
    depth.add(row.time, start - ball.place[1]);
    if (stopped == 0 && ball.velocity[1] > -0.02 * speed) stopped = row.time;
  };
  Simulation simulation(world_case<2>("ball.json", at,
                                      {fmt::format("rigid_bodies.0.velocity=[0,{}]", -speed),
                                       fmt::format("rigid_bodies.0.density={}", density),
                                       "post_processing.history_dt=5e-4"}),
                        {}, observer);
  run_to_end(simulation);
  const double gap = 0.1408 - 0.5 * diameter - 0.128;  // before it touches
  const double deepest = *std::max_element(depth.y.begin(), depth.y.end()) - gap;
  if (density == 2500) keep_curve(fmt::format("ball-{:g}", drop), at, depth);
  return {{"depth / D", deepest / diameter},
          {"depth / that measured", deepest / law(drop, density, deepest)},
          {"time until it stops", stopped},
          {"that time times speed / depth", stopped * speed / deepest}};
}

}  // namespace

TEST_CASE("a ball sinks into beads as deep, and as fast, as Uehara et al. measured") {
  const Study study("ball in beads", {"0.002", 0.2}, "0.001",
                    [](const Resolution& at) { return fall(at, 0.2, 2500); });
  study.agrees("depth / that measured", 1, 0.1);
  study.agrees("that time times speed / depth", 2.5, 3.5, 0);
  study.converges("depth / D");
  study.converges("time until it stops");
}

TEST_CASE("the depth of a ball grows with its density and height as Uehara et al. measured") {
  const auto depth = [](double drop, double density) {
    const Numbers found = fall({"0.002", 0.2}, drop, density);
    const double over = found.at("depth / that measured");
    MESSAGE(fmt::format("dropped from {} m, {} kg/m^3: depth / D {:.3f}, over that measured {:.3f}",
                        drop, density, found.at("depth / D"), over));
    CHECK(over == test::within(0.15, 1.0));
    return over;
  };
  // The same over a range of 40 in height, and of 10 in density: the exponents.
  const double low = depth(0.02, 2500), high = depth(0.8, 2500);
  CHECK(high / low == test::within(0.15, 1.0));
  const double light = depth(0.2, 755), heavy = depth(0.2, 7852);
  CHECK(heavy / light == test::within(0.15, 1.0));
}
