// Free rigid bodies by themselves: what turns and rolls without losses goes on.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>
#include <string>

#include "tests/verification/case.h"

using namespace lahar;
using namespace lahar::verification;

namespace {

/// The last of the bodies at the end. A block of material lies far away.
RigidBodyRow after(double time, const std::string& bodies, double gravity, double dt) {
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
          "external_loading_conditions": {{"gravity": [0, 0, {}]}},
          "analysis": {{"dt": {}, "end_time": {}}}}})",
      bodies, -gravity, dt, time)));
  simulation.run();
  return simulation.history().bodies.back();
}

constexpr const char* ball = R"("sphere": {"centre": [2, 2, 1.5], "radius": 0.5})";
constexpr const char* roller =
    R"("cylinder": {"from": [2, 1.5, 1.5], "to": [2, 2.5, 1.5], "radius": 0.5})";

std::string on_plane(const char* shape, double friction, const std::string& motion) {
  return fmt::format(
      R"({{"name": "plane", "friction": {0},
           "region": {{"box": {{"min": [-5, -5, 0], "max": [10, 9, 1]}}}}}},
         {{"name": "round", "friction": {0}, "density": 1000, {1}, "region": {{{2}}}}})",
      friction, motion, shape);
}

Vec<3> vector(const std::array<double, 3>& values) {
  return {values[0], values[1], values[2]};
}

}  // namespace

TEST_CASE("rigid bodies: a ball on a smooth plane keeps its spin and its place") {
  for (const double dt : {4e-3, 1e-3}) {
    CAPTURE(dt);
    const RigidBodyRow end = after(2, on_plane(ball, 0, R"("spin": [1, 2, 3])"), 9.81, dt);
    CHECK((vector(end.spin) - Vec<3>(1, 2, 3)).norm() < 1e-3);
    CHECK((vector(end.place) - Vec<3>(2, 2, 1.5)).norm() < 0.01);
  }
}

TEST_CASE("rigid bodies: balls and rollers that roll on a rough plane roll on") {
  for (const char* const shape : {ball, roller})
    for (const double dt : {4e-3, 1e-3}) {
      const RigidBodyRow end =
          after(3, on_plane(shape, 0.8, R"("velocity": [1, 0, 0], "spin": [0, 2, 0])"), 9.81, dt);
      MESSAGE(std::string(shape == ball ? "ball" : "roller")
              << ", step " << dt << " s: speed " << end.velocity[0] << ", spin " << end.spin[1]);
      const double error = shape == ball ? 0.01 : 0.03;  // the ends of a roller are edges
      CHECK(end.velocity[0] == doctest::Approx(1).epsilon(error));
      CHECK(end.spin[1] == doctest::Approx(2).epsilon(error));
      CHECK(end.place[0] == doctest::Approx(5).epsilon(error));
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
                                   0, dt);
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
