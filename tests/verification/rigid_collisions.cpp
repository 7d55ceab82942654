// Rigid bodies that collide with each other and with the sides of the mesh: results are those of
// impulses, at any step.
#include <doctest/doctest.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "tests/verification/case.h"
#include "tests/within.h"

using namespace lahar;
using namespace lahar::verification;

namespace {

/// Bodies in a plane of 10 x 4 m. A block of material lies far away.
struct Scene {
  std::string bodies;
  double dt = 1e-3, time = 1;
  std::array<double, 2> gravity{0, -9.81};
  std::string boundary = R"("velocity_constraints": [{"nset": "base", "dir": "y", "velocity": 0}])";

  /// Rows of a body, 1 as often as there are steps of 0.01 s.
  std::vector<RigidBodyRow> rows(std::size_t body) const {
    Simulation simulation(model_of_text<2>(fmt::format(
        R"({{"mesh": {{"structured": {{"cell_size": 0.5, "extent": [10, 4]}},
                       "boundary_conditions": {{{}}}}},
            "sets": {{"nodes": {{
              "base": {{"box": {{"min": [9, -0.1], "max": [10.1, 0.1]}}}},
              "floor": {{"half_space": {{"point": [0, 0], "normal": [0, 1]}}}},
              "left": {{"half_space": {{"point": [0, 0], "normal": [1, 0]}}}},
              "right": {{"half_space": {{"point": [10, 0], "normal": [-1, 0]}}}}}}}},
            "materials": [{{"name": "m", "type": "LinearElastic", "density": 2000,
                            "youngs_modulus": 1e5, "poisson_ratio": 0.3}}],
            "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": "m",
               "region": {{"box": {{"min": [9, 0], "max": [9.5, 0.5]}}}}}}}}],
            "rigid_bodies": [{}],
            "external_loading_conditions": {{"gravity": [{}]}},
            "analysis": {{"dt": {}, "end_time": {}}}}})",
        boundary, bodies, fmt::join(gravity, ", "), dt, time)));
    std::vector<RigidBodyRow> all{simulation.history().bodies.at(body)};
    const auto steps = std::max<long>(1, std::lround(0.01 / dt));
    while (!simulation.finished()) {
      simulation.advance(steps);
      all.push_back(simulation.history().bodies.at(body));
    }
    return all;
  }
  RigidBodyRow end(std::size_t body) const { return rows(body).back(); }
};

std::string plane(double friction) {
  return fmt::format(R"({{"name": "plane", "friction": {},
      "region": {{"box": {{"min": [-5, -5], "max": [8, 1]}}}}}})",
                     friction);
}

std::string ball(double x, double y, double radius, const std::string& more) {
  return fmt::format(R"(, {{"name": "ball {0}", "density": 1000, {3},
      "region": {{"sphere": {{"centre": [{0}, {1}], "radius": {2}}}}}}})",
                     x, y, radius, more);
}

/// A rectangle about (3, y), turned by an angle.
std::string block(double width, double height, double y, double angle, const std::string& more) {
  std::vector<std::string> corners;
  for (const auto& [a, b] : {std::array{-0.5, -0.5}, {0.5, -0.5}, {0.5, 0.5}, {-0.5, 0.5}})
    corners.push_back(fmt::format("[{}, {}]",
                                  3 + a * width * std::cos(angle) - b * height * std::sin(angle),
                                  y + a * width * std::sin(angle) + b * height * std::cos(angle)));
  return fmt::format(R"(, {{"name": "block", "density": 1000, {},
      "region": {{"polygon": {{"points": [{}]}}}}}})",
                     more, fmt::join(corners, ", "));
}

}  // namespace

TEST_CASE("rigid bodies: a ball jumps back by its coefficient of restitution, at any step") {
  for (const double restitution : {0.0, 0.5, 0.9})
    for (const double dt : {4e-3, 1e-3, 2.5e-4}) {
      const Scene scene{
          plane(0) + ball(3, 2.5, 0.5, fmt::format(R"("restitution": {})", restitution)), dt, 1.4};
      double top = 0;
      std::size_t row = 0;
      for (const RigidBodyRow& at : scene.rows(1))
        if (++row > 48) top = std::max(top, at.place[1] - 1.5);  // it falls for 0.45 s
      CAPTURE(restitution);
      CAPTURE(dt);
      CHECK(std::abs(top - restitution * restitution) < 0.02 * (1 + 500 * dt) / 3);
    }
}

// The impulse at the corner is (1 + e) m u / (1 + m r^2 / I), r being its distance along the plane.
TEST_CASE("rigid bodies: a bar that falls on its end turns as its impulse says") {
  constexpr double width = 1, height = 0.1, angle = 0.4, fall = 0.5, mass = 1000 * width * height;
  const double corner = 0.5 * (width * std::sin(angle) + height * std::cos(angle));
  const double r = 0.5 * (width * std::cos(angle) - height * std::sin(angle));
  const double inertia = mass / 12 * (width * width + height * height);
  const double u = std::sqrt(2 * 9.81 * fall);
  for (const double restitution : {0.0, 0.6}) {
    const double spin = (1 + restitution) * mass * u / (1 + mass * r * r / inertia) * r / inertia;
    for (const double dt : {2e-3, 5e-4}) {
      const Scene scene{plane(0) + block(width, height, 1 + corner + fall, angle,
                                         fmt::format(R"("restitution": {})", restitution)),
                        dt, u / 9.81 + 0.02};
      CAPTURE(dt);
      // Without a rebound the corner stays, and gravity turns the bar on.
      const double by_gravity = restitution > 0 ? 0 : 0.02 * 3 * 9.81 / 2 * std::cos(angle) / width;
      CHECK(std::abs(scene.end(1).spin[2]) == test::within(0.03, spin + by_gravity));
    }
  }
}

TEST_CASE("rigid bodies: a square that falls on a corner ends in the same place at any step") {
  std::vector<std::array<double, 3>> ends;
  for (const double dt : {4e-3, 1e-3, 2.5e-4}) {
    const Scene scene{plane(0.5) + block(1, 1, 2.5, 0.5, R"("friction": 0.5)"), dt, 1.5};
    double most = 0;
    RigidBodyRow last;
    for (const RigidBodyRow& at : scene.rows(1)) {
      most =
          std::max(most, 9.81 * (at.place[1] - 1.5) + 0.5 * at.velocity[0] * at.velocity[0] +
                             0.5 * at.velocity[1] * at.velocity[1] + at.spin[2] * at.spin[2] / 12);
      last = at;
    }
    CHECK(most < 9.81 * 1.001);
    CHECK(last.place[1] == test::within(1e-4, 1.5));
    CHECK(std::hypot(last.velocity[0], last.velocity[1]) < 1e-6);
    ends.push_back({last.place[0], last.place[1], last.rotation[2]});
  }
  for (const auto& end : ends)
    for (std::size_t k = 0; k < 3; ++k) CHECK(std::abs(end[k] - ends.back()[k]) < 1e-3);
}

TEST_CASE("rigid bodies: a block on a slope that friction holds does not creep") {
  const double slope = 0.35;
  for (const double dt : {4e-3, 5e-4}) {
    const Scene scene{plane(0.5) + block(1, 0.5, 1.25, 0, R"("friction": 0.3)"),
                      dt,
                      0.5,
                      {9.81 * std::sin(slope), -9.81 * std::cos(slope)}};
    const RigidBodyRow end = scene.end(1);
    CHECK(std::abs(end.place[0] - 3) < 1e-9);
    CHECK(std::abs(end.velocity[0]) < 1e-9);
  }
}

// The impulse acts along the line of centres; along it they part with e times their speed.
TEST_CASE("rigid bodies: discs that collide keep their momentum and part as they should") {
  constexpr double restitution = 0.7;
  for (const double dt : {2e-3, 2.5e-4}) {
    const std::string first = fmt::format(R"("velocity": [2, 0], "restitution": {})", restitution);
    Scene scene{plane(0) + ball(2, 2.5, 0.4, first) + ball(4, 2.9, 0.6, R"("velocity": [-1, 0])"),
                dt,
                0.6,
                {0, 0}};
    const RigidBodyRow one = scene.end(1), two = scene.end(2);
    const double m1 = 0.16, m2 = 0.36;
    CHECK(m1 * one.velocity[0] + m2 * two.velocity[0] == doctest::Approx(m1 * 2 - m2));
    CHECK(std::abs(m1 * one.velocity[1] + m2 * two.velocity[1]) < 1e-9);
    const double sine = 0.4, cosine = std::sqrt(1 - sine * sine);  // of the line of centres
    const double impulse = (1 + restitution) * 3 * cosine / (1 / m1 + 1 / m2);
    CAPTURE(dt);
    CHECK(one.velocity[0] == test::within(0.01, 2 - impulse * cosine / m1));
    CHECK(one.velocity[1] == test::within(0.01, -impulse * sine / m1));
    CHECK(std::abs(one.spin[2]) + std::abs(two.spin[2]) < 1e-3);
  }
}

TEST_CASE("rigid bodies: a disc that strikes with a slip gets Coulomb's impulse along the plane") {
  for (const double dt : {2e-3, 2.5e-4}) {
    const Scene scene{plane(0.2) + ball(3, 2, 0.5, R"("spin": -20, "restitution": 0.5)"), dt, 0.5};
    const RigidBodyRow end = scene.end(1);
    const double u = std::sqrt(2 * 9.81 * 0.5);
    const double along = 0.2 * 1.5 * u;  // impulse over mass; it slips all the time
    CAPTURE(dt);
    CHECK(end.velocity[0] == test::within(0.02, along));
    CHECK(end.spin[2] == test::within(0.01, -20 + along * 0.5 / 0.125));
  }
}

TEST_CASE("rigid bodies: what a plate in prescribed motion strikes leaves it as it should") {
  for (const double restitution : {0.0, 0.5}) {
    const Scene scene{fmt::format(R"({{"name": "plate", "velocity": [2, 0],
                         "region": {{"box": {{"min": [1, 1], "max": [1.5, 3]}}}}}})") +
                          block(1, 1, 2, 0, fmt::format(R"("restitution": {})", restitution)),
                      1e-3,
                      0.8,
                      {0, 0}};
    const RigidBodyRow end = scene.end(1);
    CHECK(end.velocity[0] == test::within(1e-6, 2 * (1 + restitution)));
    if (restitution == 0) CHECK(end.place[0] == test::within(1e-6, 1.5 + 1.6 + 0.5));
  }
}

// Walls and constraints of the nodes of a whole side hold bodies, too.
TEST_CASE("rigid bodies: sides of the mesh hold bodies where all their nodes hold material") {
  const std::string closed = R"("walls": [{"nset": "floor", "normal": [0, 1], "friction": 0.4},
                                          {"nset": "right", "normal": [-1, 0], "friction": 0.1}],
      "velocity_constraints": [{"nset": "left", "dir": "x", "velocity": 0}])";
  const std::string body = R"("velocity": [-3, 0], "restitution": 0.5)";
  Scene scene{block(1, 1, 2, 0, body).substr(2), 1e-3, 0.9, {0, 0}, closed};
  CHECK(scene.end(0).velocity[0] == test::within(1e-6, 1.5));  // 2.5 m to the left side
  scene.time = 0.8;
  CHECK(scene.end(0).velocity[0] == -3);
  // It falls on the floor, and slides.
  scene = {block(1, 1, 0.5, 0, R"("velocity": [3, 0])").substr(2), 1e-3, 0.5, {0, -10}, closed};
  const RigidBodyRow slid = scene.end(0);
  CHECK(slid.velocity[0] == test::within(0.01, 3 - 0.4 * 10 * 0.5));
  CHECK(slid.place[1] == test::within(1e-4, 0.5));
  // Nodes of a part of a side hold nothing, and neither does a side behind which it begins.
  scene = {block(1, 1, 0.6, 0, R"("friction": 0.5)").substr(2), 1e-3, 0.5};
  CHECK(scene.end(0).place[1] < 0);
  scene = {block(1, 1, 0.4, 0, R"("friction": 0.5)").substr(2), 1e-3, 0.5, {0, -9.81}, closed};
  CHECK(scene.end(0).place[1] < 0);
}

// A point of a face does not run into the front of what slides on this face, and a corner not into
// the side of the next floor at a seam.
TEST_CASE("rigid bodies: what slides on free bodies and over seams goes on as on one plane") {
  const auto box = [](const std::string& name, double x, double y, double width, double height,
                      const std::string& more) {
    return fmt::format(R"({{"name": "{}", {}, "region": {{"box": {{"min": [{}, {}],
                            "max": [{}, {}]}}}}}})",
                       name, more, x, y, x + width, y + height);
  };
  const std::string floor = box("floor", -5, -5, 13, 6, R"("friction": 0)");
  const auto plank = box("plank", 0.5, 1, 5, 0.2, R"("density": 8000, "friction": 0)");
  for (const double dt : {4e-3, 1e-3, 2.5e-4})
    for (const double friction : {0.0, 0.2}) {
      CAPTURE(dt);
      CAPTURE(friction);
      const std::string moving =
          fmt::format(R"("density": 1000, "velocity": [3, 0], "friction": {})", friction);
      const double way = 3 * 0.8 - friction * 9.81 * 0.8 * 0.8 / 2;
      // On a plank that is free.
      Scene scene{floor + ", " + plank + ", " + box("block", 1, 1.2, 0.5, 0.5, moving), dt, 0.8};
      RigidBodyRow end = scene.end(2);
      CHECK(end.place[0] == test::within(0.005, 1.25 + way));
      CHECK(std::abs(end.place[1] - 1.45) < 1e-4);
      // Over the seam of two floors; on the floor of a plane mesh that lies on its side.
      scene.bodies = box("one", -5, -5, 7.13, 6, R"("friction": 0)") + ", " +
                     box("two", 2.13, -5, 5, 6, R"("friction": 0)") + ", " +
                     box("block", 1, 1, 0.5, 0.5, moving);
      end = scene.end(2);
      CHECK(end.place[0] == test::within(0.005, 1.25 + way));
      CHECK(std::abs(end.place[1] - 1.25) < 1e-4);
    }
  // A floor on a side of the mesh that holds bodies, too, has all of the normal force.
  Scene scene{box("floor", -5, -5, 13, 5, R"("friction": 0.2)") + ", " +
                  box("block", 1, 0, 0.5, 0.5, R"("density": 1000, "velocity": [3, 0])"),
              1e-3, 0.8};
  scene.boundary = R"("velocity_constraints": [{"nset": "floor", "dir": "y", "velocity": 0}])";
  CHECK(scene.end(1).place[0] == test::within(0.005, 1.25 + 3 * 0.8 - 0.2 * 9.81 * 0.32));
}

TEST_CASE("rigid bodies: a gate falls freely along a lower box that it touches") {
  for (const double clearance : {0.0, 1e-3})
    for (const double dt : {1e-3, 2.5e-4}) {
      const Scene scene{fmt::format(R"({{"name": "box", "region": {{"box": {{"min": [1, 0],
                                         "max": [2, 2]}}}}}},
                                       {{"name": "gate", "density": 1000, "fixed": ["x", "spin"],
                                         "region": {{"box": {{"min": [{}, 2.5], "max": [2.3, 3.6]}}}}}})",
                                    2 + clearance),
                        dt, 0.5};
      CHECK(scene.end(1).velocity[1] == test::within(1e-6, -9.81 * 0.5));
    }
}

// Block of mass m on a wedge of mass M, all smooth: the wedge moves with
// m g sin cos / (M + m sin^2) (Landau and Lifshitz, Mechanics).
TEST_CASE("rigid bodies: a smooth block on a free wedge, both as momentum and energy say") {
  constexpr double angle = std::numbers::pi / 6, m = 250, M = 1000 * 0.5 * 3 * 3 * 0.57735026919;
  const double s = std::sin(angle), c = std::cos(angle);
  const double x = 2.2, y = 1 + (4 - x) * s / c;  // the foot of the block's middle
  std::vector<std::string> corners;
  for (const auto& [a, b] : {std::array{-0.25, 0.0}, {0.25, 0.0}, {0.25, 0.5}, {-0.25, 0.5}})
    corners.push_back(fmt::format("[{}, {}]", x + a * c + b * s, y - a * s + b * c));
  for (const double dt : {1e-3, 2.5e-4}) {
    const Scene scene{plane(0) + fmt::format(R"(, {{"name": "wedge", "density": 1000,
            "region": {{"polygon": {{"points": [[1, 1], [4, 1], [1, {}]]}}}}}},
          {{"name": "block", "density": 1000,
            "region": {{"polygon": {{"points": [{}]}}}}}})",
                                             1 + 3 * s / c, fmt::join(corners, ", ")),
                      dt, 0.4};
    CHECK(scene.end(1).velocity[0] ==
          test::within(0.01, -m * 9.81 * s * c / (M + m * s * s) * 0.4));
    CHECK(std::abs(M * scene.end(1).velocity[0] + m * scene.end(2).velocity[0]) < 0.01);
  }
}

// A box topples when gravity passes its lower corner: at tan = width / height.
TEST_CASE("rigid bodies: a box topples to either side where its corner lets it") {
  for (const double width : {0.1008, 0.3})
    for (const double side : {-1.0, 1.0})
      for (const double share : {0.985, 1.015}) {
        const double angle = std::atan(share * width);
        Scene scene{plane(5) + block(width, 1, 1.5, 0, R"("friction": 5)"),
                    2e-3,
                    2,
                    {side * 9.81 * std::sin(angle), -9.81 * std::cos(angle)}};
        scene.boundary = R"("velocity_constraints": [{"nset": "base", "dir": "x", "velocity": 0},
                                                     {"nset": "base", "dir": "y", "velocity": 0}])";
        CAPTURE(width);
        CAPTURE(side);
        CAPTURE(share);
        const double turned = std::abs(scene.end(1).rotation[2]);
        if (share > 1)
          CHECK(turned > 0.5);
        else
          CHECK(turned < 0.01);
      }
}

// Newton's law of restitution makes energy where friction turns the slip around (Kane and Levinson
// 1985): there the rebound is smaller.
TEST_CASE("rigid bodies: a rod that strikes with a slip has no more energy than before") {
  for (const double restitution : {0.9, 1.0}) {
    const Scene scene{
        plane(0.5) + block(2, 0.02, 1.73, 0.785398,
                           fmt::format(R"("restitution": {}, "velocity": [0.6, -1])", restitution)),
        1e-3,
        0.05,
        {0, 0}};
    const RigidBodyRow end = scene.end(1);
    const auto energy = [](double u, double v, double spin) {
      return 0.5 * (u * u + v * v + (4 + 0.0004) / 12 * spin * spin);
    };
    const double after = energy(end.velocity[0], end.velocity[1], end.spin[2]);
    CHECK(std::abs(end.spin[2]) > 0.1);
    CHECK(after < energy(0.6, -1, 0) * (1 + 1e-6));
    CHECK(after > 0.97 * energy(0.6, -1, 0));
  }
}
