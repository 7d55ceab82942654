// Blocks on rigid planes at any angle to the grid slide, stick and hop as theory and finite
// elements say.
#include "tests/verification/rigid_incline.h"

#include <doctest/doctest.h>

#include "tests/verification/elastic_block.h"
#include "tests/within.h"

using namespace lahar;
using namespace lahar::verification;

TEST_CASE(
    "rigid bodies: a block slides on a plane at any angle to the grid with Coulomb's friction") {
  for (const int degrees : {10, 20, 30, 45, 60}) {
    CAPTURE(degrees);
    const double angle = degrees * pi / 180, mu = 0.5 * std::tan(angle);
    const Incline incline{.angle = angle, .friction = mu};
    const auto motion = incline.run();
    const double expected = g * (std::sin(angle) - mu * std::cos(angle)) * motion.time.back();
    CHECK(motion.velocity.back() == test::within(0.01, expected));
    CHECK(motion.friction == test::within(0.01, mu));
  }
}

TEST_CASE("rigid bodies: so it does with the defaults that users have") {
  for (const int degrees : {10, 20, 30, 45, 60}) {
    CAPTURE(degrees);
    const double angle = degrees * pi / 180, mu = 0.5 * std::tan(angle);
    const auto motion = Incline::of_users(angle, mu).run();
    const double expected = g * (std::sin(angle) - mu * std::cos(angle)) * motion.time.back();
    MESSAGE(fmt::format("{} degrees: speed {:+.3f} %", degrees,
                        100 * (motion.velocity.back() / expected - 1)));
    CHECK(motion.velocity.back() == test::within(0.01, expected));
    CHECK(motion.friction == test::within(0.01, mu));
  }
}

TEST_CASE(
    "rigid bodies: with these a block sticks, too, also on a steep plane if "
    "gravity grows and damping takes the waves") {
  for (const int degrees : {10, 20, 30, 45, 60}) {
    CAPTURE(degrees);
    const double angle = degrees * pi / 180;
    Incline incline = Incline::of_users(angle, 1.3 * std::tan(angle));
    if (degrees > 30) {
      incline.ramp = 0.1;
      incline.analysis += R"(, "damping": {"type": "Cundall", "damping_factor": 0.3})";
    }
    const auto motion = incline.run();
    MESSAGE(fmt::format("{} degrees: {:.1e} m/s", degrees, motion.velocity.back()));
    CHECK(std::abs(motion.velocity.back()) < 1e-5);
  }
}

TEST_CASE(
    "rigid bodies: a block slides without friction as it falls along the plane, to rounding") {
  for (const int degrees : {10, 37, 60}) {
    CAPTURE(degrees);
    const Incline incline{.angle = degrees * pi / 180, .friction = 0};
    const auto motion = incline.run();
    const double expected = g * std::sin(incline.angle) * motion.time.back();
    CHECK(motion.velocity.back() == doctest::Approx(expected).epsilon(1e-9));
  }
}

TEST_CASE("rigid bodies: cohesion holds by the area of a block, wherever its first row is cut") {
  // With half of what would hold it the block has half of its acceleration.
  for (const int degrees : {1, 10, 20, 37, 45})
    for (const double level : {1.7, 1.71, 1.72, 1.745}) {
      CAPTURE(degrees);
      CAPTURE(level);
      Incline incline{.angle = degrees * pi / 180, .friction = 0};
      incline.cohesion = 0.5 * 2000 * 0.15 * g * incline.sine();
      incline.level = level;
      incline.cut_cells = "exact";
      incline.analysis += R"(, "shape_functions": "quadratic_spline")";
      const auto motion = incline.run();
      const double expected = 0.5 * g * incline.sine() * motion.time.back();
      // Of boxes at 45 degrees corners touch. At 1 degree the surface cuts a row to slivers that
      // become ever thinner, and somewhere the row behind them begins to touch.
      const double error = degrees == 45 ? 0.25 : degrees == 1 ? 0.35 : 0.2;
      CHECK(motion.velocity.back() == test::within(error, expected));
    }
}

TEST_CASE("rigid bodies: a block sticks where friction suffices, and does not creep") {
  for (const int degrees : {10, 20, 30, 45, 60}) {
    CAPTURE(degrees);
    const Incline incline{.angle = degrees * pi / 180,
                          .friction = 1.3 * std::tan(degrees * pi / 180)};
    const auto motion = incline.run();
    // It comes to rest from the jolt with which gravity begins.
    CHECK(std::abs(motion.velocity.back()) < 0.01 * g * std::sin(incline.angle) * 0.3);
    CHECK(std::abs(motion.velocity.back()) < 2e-3);
  }
}

namespace {

/// Speed over that of a free fall of a block that theory of rigid blocks holds still, without
/// damping, in cells and in elements.
struct Hops {
  double in_cells, in_elements;
};
Hops hops(int degrees, double ramp) {
  const double angle = degrees * pi / 180, friction = 1.3 * std::tan(angle);
  const Incline incline{.angle = angle,
                        .friction = friction,
                        .analysis = R"("velocity_update": "flip")",
                        .ramp = ramp};
  ElasticBlock block{.angle = angle, .friction = friction, .ramp = ramp};
  const double fall = g * std::sin(angle) * incline.end_time;
  const Hops found{incline.run().velocity.back() / fall, block.run().velocity / fall};
  MESSAGE(fmt::format("{} degrees, gravity grows in {} s: {:.4f} in cells, {:.4f} in elements",
                      degrees, ramp, found.in_cells, found.in_elements));
  return found;
}

}  // namespace

TEST_CASE(
    "rigid bodies: an elastic block without damping hops down a steep plane, as finite elements "
    "do, and sticks where it is not steep and gravity grows") {
  for (const int degrees : {20, 30}) {
    const Hops found = hops(degrees, 0.05);
    CHECK(std::abs(found.in_cells) < 2e-3);
    CHECK(std::abs(found.in_elements) < 2e-3);
  }
  // By a half or twice: which corner touches when is chance.
  const Hops found = hops(60, 0);
  CHECK(found.in_elements > 0.2);
  CHECK(found.in_cells > 0.1);
  CHECK(found.in_cells < 2 * found.in_elements);
}
