// Free rigid bodies by themselves: what turns and rolls without losses goes on.
#include <doctest/doctest.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

#include "tests/verification/case.h"
#include "tests/within.h"

using namespace lahar;
using namespace lahar::verification;

namespace {

/// The last of the bodies at the end. A block of material lies far away. `watch` sees the bodies
/// every 20 steps.
RigidBodyRow after(double time, const std::string& bodies, const Vec<3>& gravity, double dt,
                   const std::function<void(const std::vector<RigidBodyRow>&)>& watch = {}) {
  Simulation simulation(model_of_text<3>(fmt::format(
      R"({{"mesh": {{"structured": {{"cell_size": 0.5, "extent": [12, 4, 3]}},
                     "boundary_conditions": {{"velocity_constraints":
                       [{{"nset": "floor", "dir": "z", "velocity": 0}}]}}}},
          "sets": {{"nodes": {{"floor": {{"half_space": {{"point": [0, 0, 0], "normal": [0, 0, 1]}}}}}}}},
          "materials": [{{"name": "m", "type": "LinearElastic", "density": 2000,
                          "youngs_modulus": 1e5, "poisson_ratio": 0.3}}],
          "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": "m",
             "region": {{"box": {{"min": [11, 3, 0], "max": [11.5, 3.5, 0.5]}}}}}}}}],
          "rigid_bodies": [{}],
          "external_loading_conditions": {{"gravity": [{}]}},
          "analysis": {{"dt": {}, "end_time": {}}}}})",
      bodies, fmt::join(gravity, ", "), dt, time)));
  while (!simulation.finished()) {
    simulation.advance(20);
    if (watch) watch(simulation.history().bodies);
  }
  return simulation.history().bodies.back();
}

const Vec<3> down(0, 0, -9.81);

constexpr const char* sphere = R"("sphere": {"centre": [2, 2, 1.5], "radius": 0.5})";
constexpr const char* roller =
    R"("cylinder": {"from": [2, 1.5, 1.5], "to": [2, 2.5, 1.5], "radius": 0.5})";

std::string on_plane(const char* shape, double friction, const std::string& motion) {
  return fmt::format(
      R"({{"name": "plane", "friction": {0},
           "region": {{"box": {{"min": [-5, -5, 0], "max": [10, 9, 1]}}}}}},
         {{"name": "round", "friction": {0}, "density": 1000, {1}, "region": {{{2}}}}})",
      friction, motion, shape);
}

std::string box_at(const Vec<3>& low, const Vec<3>& high) {
  return fmt::format(R"("box": {{"min": [{}], "max": [{}]}})", fmt::join(low, ", "),
                     fmt::join(high, ", "));
}

Vec<3> vector(const std::array<double, 3>& values) {
  return {values[0], values[1], values[2]};
}

}  // namespace

TEST_CASE("rigid bodies: a ball on a smooth plane keeps its spin and its place") {
  for (const double dt : {4e-3, 1e-3}) {
    CAPTURE(dt);
    const RigidBodyRow end = after(2, on_plane(sphere, 0, R"("spin": [1, 2, 3])"), down, dt);
    CHECK((vector(end.spin) - Vec<3>(1, 2, 3)).norm() < 1e-3);
    CHECK((vector(end.place) - Vec<3>(2, 2, 1.5)).norm() < 0.01);
  }
}

TEST_CASE("rigid bodies: balls and rollers that roll on a rough plane roll on") {
  for (const char* const shape : {sphere, roller})
    for (const double dt : {4e-3, 1e-3}) {
      const RigidBodyRow end =
          after(3, on_plane(shape, 0.8, R"("velocity": [1, 0, 0], "spin": [0, 2, 0])"), down, dt);
      MESSAGE(std::string(shape == sphere ? "ball" : "roller")
              << ", step " << dt << " s: speed " << end.velocity[0] << ", spin " << end.spin[1]);
      const double error = shape == sphere ? 0.01 : 0.03;  // the ends of a roller are edges
      CHECK(end.velocity[0] == test::within(error, 1));
      CHECK(end.spin[1] == test::within(error, 2));
      CHECK(end.place[0] == test::within(error, 5));
    }
}

// A box turns about no axis of its own: momentum stays to rounding, energy to the second order.
TEST_CASE("rigid bodies: a box that tumbles freely keeps its angular momentum and its energy") {
  const Vec<3> size(2, 1, 0.5), spin(3, 0, 3);
  const double mass = 1000 * size.prod();
  const Vec<3> inertia = mass / 12 * (Vec<3>::Constant(size.squaredNorm()) - size.cwiseAbs2());
  double coarse = 0;
  for (const double dt : {0.02, 0.01}) {
    const RigidBodyRow box = after(5, R"({"name": "box", "density": 1000, "spin": [3, 0, 3],
               "region": {"box": {"min": [3, 2, 2], "max": [5, 3, 2.5]}}})",
                                   Vec<3>::Zero(), dt);
    const Vec<3> w = vector(box.spin), turned = vector(box.rotation);
    const Eigen::Matrix3d axes =
        Eigen::AngleAxisd(turned.norm(), turned.normalized()).toRotationMatrix();
    const Vec<3> own = axes.transpose() * w;  // by the axes of the box
    const Vec<3> momentum = axes * inertia.cwiseProduct(own);
    CHECK((momentum - inertia.cwiseProduct(spin)).norm() <
          1e-3 * inertia.cwiseProduct(spin).norm());
    const double error =
        std::abs(own.dot(inertia.cwiseProduct(own)) / spin.dot(inertia.cwiseProduct(spin)) - 1);
    MESSAGE("step " << dt << " s: energy is wrong by " << error);
    CHECK(error < 2e-3);
    if (coarse > 0) CHECK(error < 0.5 * coarse);
    coarse = error;
  }
}

// Euler's motion of a body with two equal moments I: axis and spin turn about the momentum L with
// |L| / I. The axis of the body lies along no axis of the mesh.
TEST_CASE("rigid bodies: a free top whose moments of inertia are given precesses") {
  const Vec<3> axis = Vec<3>(1, 2, 2) / 3, spin(1, 4, 2);
  constexpr double across = 300, along = 450, time = 2;
  const Eigen::Matrix3d inertia =
      across * Eigen::Matrix3d::Identity() + (along - across) * axis * axis.transpose();
  const Vec<3> momentum = inertia * spin;
  const Vec<3> expected =
      Eigen::AngleAxisd(momentum.norm() / across * time, momentum.normalized()) * spin;
  double coarse = 0;
  for (const double dt : {0.01, 0.005}) {
    const RigidBodyRow top =
        after(time,
              fmt::format(R"({{"name": "top", "mass": 1000, "spin": [{}],
                         "inertia": [{}, {}, {}, {}, {}, {}],
                         "region": {{"box": {{"min": [3, 2, 2], "max": [5, 3, 2.5]}}}}}})",
                          fmt::join(spin, ", "), inertia(0, 0), inertia(1, 1), inertia(2, 2),
                          inertia(0, 1), inertia(1, 2), inertia(0, 2)),
              Vec<3>::Zero(), dt);
    const double error = (vector(top.spin) - expected).norm() / spin.norm();
    MESSAGE("step " << dt << " s: the spin is wrong by " << error);
    CHECK(error < 0.01);
    if (coarse > 0) CHECK(error < 0.5 * coarse);
    coarse = error;
  }
}

TEST_CASE("rigid bodies: shells roll down by their moments of inertia, also in space") {
  constexpr double angle = 20 * std::numbers::pi / 180, time = 0.5, g = 9.81, radius = 0.5;
  const Vec<3> gravity = g * Vec<3>(std::sin(angle), 0, -std::cos(angle));
  // A solid ball, a shell, and all mass at the rim.
  for (const double share : {0.4, 2.0 / 3, 1.0}) {
    const double moment = share * 1000 * radius * radius;
    std::string bodies =
        on_plane(sphere, 0.8, fmt::format(R"("mass": 1000, "inertia": [{0}, {0}, {0}])", moment));
    bodies.replace(bodies.find(R"("density": 1000, )"), 17, "");
    const RigidBodyRow end = after(time, bodies, gravity, 1e-3);
    CHECK(end.velocity[0] == test::within(0.01, g * std::sin(angle) * time / (1 + share)));
    CHECK(end.spin[1] == test::within(0.02, end.velocity[0] / radius));
  }
}

// Some hundred points of a face touch at once.
TEST_CASE("rigid bodies: a cube that falls on a plane never has more energy, and comes to rest") {
  constexpr double fall = 0.3, mass = 1000, gravity = 9.81;
  const std::string cube = box_at({2, 1.5, 1 + fall}, {3, 2.5, 2 + fall});
  for (const double dt : {8e-3, 2e-3, 5e-4}) {
    CAPTURE(dt);
    double most = 0;
    const RigidBodyRow end =
        after(1.5, on_plane(cube.c_str(), 0.5, R"("velocity": [0, 0, 0])"), down, dt,
              [&](const auto& bodies) {
                const RigidBodyRow& body = bodies.back();
                most = std::max(most, mass * gravity * (body.place[2] - 1.5) +
                                          mass / 2 * vector(body.velocity).squaredNorm() +
                                          mass / 12 * vector(body.spin).squaredNorm());
              });
    MESSAGE("step " << dt << " s: most energy " << most / (mass * gravity * fall)
                    << " of that at first, ends at " << end.place[2]);
    CHECK(most <= 1.001 * mass * gravity * fall);
    CHECK(end.place[2] == test::within(0.005, 1.5));
    CHECK(vector(end.velocity).norm() < 0.01);
    CHECK((vector(end.place) - Vec<3>(2.5, 2, end.place[2])).norm() < 0.01);
  }
}

TEST_CASE("rigid bodies: cubes, plates and rods that touch a plane stay, and so does a stack") {
  for (const double dt : {4e-3, 5e-4}) {
    CAPTURE(dt);
    for (const Vec<3>& size : {Vec<3>(1, 1, 1), Vec<3>(2, 2, 0.1), Vec<3>(2, 0.2, 0.2)}) {
      const Vec<3> low(2, 1, 1), middle = low + size / 2;
      const std::string shape = box_at(low, low + size);
      const RigidBodyRow end =
          after(1, on_plane(shape.c_str(), 0.5, R"("velocity": [0, 0, 0])"), down, dt);
      CHECK((vector(end.place) - middle).norm() < 0.005);
      CHECK(vector(end.rotation).norm() < 0.005);
    }
    // An intersection: its corners are not those of a box.
    const RigidBodyRow prism =
        after(1,
              on_plane(R"("polygon": {"points": [[1, 2], [1.4, 2], [1.2, 2.6], [1, 2.6]],
                             "axis": "y", "range": [1, 2]})",
                       0.5, R"("velocity": [0, 0, 0])"),
              down, dt);
    CHECK(std::abs(prism.velocity[0]) + std::abs(prism.velocity[2]) < 0.002);
    CHECK(prism.place[2] < 1.2);
    std::string stack = on_plane(box_at({2, 1, 1}, {3, 2, 2}).c_str(), 0.5, R"("mass": 1000)");
    stack.replace(stack.find(R"("density": 1000, )"), 17, "");
    for (const int k : {1, 2})
      stack += fmt::format(R"(, {{"name": "box {}", "friction": 0.5, "density": 1000,
                                  "region": {{{}}}}})",
                           k, box_at({2, 1, 1.0 + k}, {3, 2, 2.0 + k}));
    std::vector<RigidBodyRow> all;
    after(1, stack, down, dt, [&](const auto& bodies) { all = bodies; });
    for (std::size_t k = 1; k < all.size(); ++k) {
      CAPTURE(k);
      const Vec<3> middle(2.5, 1.5, 0.5 + static_cast<double>(k));
      CHECK((vector(all[k].place) - middle).norm() < 0.01);
    }
  }
}

TEST_CASE("rigid bodies: a rod on a rough slope stays, and a smooth one slides as Coulomb says") {
  constexpr double angle = 20 * std::numbers::pi / 180, gravity = 9.81, time = 0.5;
  // Gravity is turned in place of the slope; so cells and faces lie along it.
  const auto slide = [&](double friction, double dt) {
    const std::string bodies =
        on_plane(box_at({2, 1, 1}, {4, 1.2, 1.2}).c_str(), friction, R"("velocity": [0, 0, 0])");
    return after(time, bodies, gravity * Vec<3>(std::sin(angle), 0, -std::cos(angle)), dt);
  };
  for (const double dt : {2e-3, 5e-4}) {
    CAPTURE(dt);
    const RigidBodyRow rests = slide(0.5, dt), slides = slide(0.2, dt);
    CHECK((vector(rests.place) - Vec<3>(3, 1.1, 1.1)).norm() < 0.01);
    CHECK(vector(rests.rotation).norm() < 0.01);
    const double way = gravity * (std::sin(angle) - 0.2 * std::cos(angle)) * time * time / 2;
    CHECK(slides.place[0] - 3 == test::within(0.02, way));
  }
}
