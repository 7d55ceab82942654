// Rigid bodies of revolution, and rings that meet them.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <utility>

#include "tests/verification/case.h"
#include "tests/within.h"

using namespace lahar;
using namespace lahar::verification;

namespace {

constexpr double pi = std::numbers::pi, E = 1e6, nu = 0.3;

/// Elastic cylinder of radius 1 m and height 0.8 m on a smooth base at y = 0.2 m, that nothing
/// holds at its side, and one rigid body more.
Model<2> cylinder(const std::string& body, const std::string& analysis, double h) {
  return model_of_text<2>(fmt::format(
      R"({{
    "mesh": {{"structured": {{"cell_size": {}, "extent": [2, 2]}}}},
    "materials": [{{"type": "LinearElastic", "density": 1000, "youngs_modulus": {},
                   "poisson_ratio": {}}}],
    "rigid_bodies": [
      {{"name": "base", "region": {{"half_space": {{"point": [0, 0.2], "normal": [0, 1]}}}}}},
      {}],
    "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": 0,
                                 "region": {{"box": {{"min": [0, 0.2], "max": [1, 1]}}}}}}}}],
    "math_functions": [{{"id": 0, "type": "Linear", "xvalues": [0, 0.1, 0.1001, 1],
                        "fxvalues": [1, 1, 0, 0]}}],
    "analysis": {{"plane": "axisymmetric", "mpm_scheme": "musl", {}}},
    "post_processing": {{"history_steps": 1}}}})",
      h, E, nu, body, analysis));
}

/// Mean forces on the first three bodies from a time on [N].
std::array<Vec<2>, 3> mean_forces(Model<2> model, double from) {
  std::array<Vec<2>, 3> sum;
  sum.fill(Vec<2>::Zero());
  int rows = 0;
  Observer observer;
  observer.history = [&](const HistoryRow& row) {
    if (row.time < from) return;
    for (std::size_t k = 0; k < std::min(sum.size(), row.bodies.size()); ++k)
      for (int d = 0; d < 2; ++d) sum[k][d] += row.bodies[k].force[static_cast<std::size_t>(d)];
    ++rows;
  };
  Simulation simulation(std::move(model), {.threads = 2}, observer);
  simulation.run();
  for (Vec<2>& force : sum) force /= rows;
  return sum;
}

/// Steps that damp waves.
std::string damped(double end) {
  return fmt::format(R"("end_time": {}, "shape_functions": "quadratic_spline",
                         "damping": {{"type": "Viscous", "damping_factor": 20}})",
                     end);
}

}  // namespace

TEST_CASE("rigid bodies around an axis: a free one has the mass of a body of revolution") {
  const Model<2> model =
      cylinder(R"({"region": {"sphere": {"centre": [0, 1.4], "radius": 0.3}}, "density": 2000})",
               R"("dt": 1e-4, "nsteps": 1)", 0.1);
  const RigidBody<2>& ball = model.rigid_bodies.at(1);
  CHECK(ball.mass == test::within(1e-4, 2000 * 4.0 / 3 * pi * std::pow(0.3, 3)));
  CHECK(ball.centre[0] == 0);
  CHECK(ball.centre[1] == doctest::Approx(1.4).epsilon(1e-9));
}

TEST_CASE("rigid bodies around an axis: momentum along the axis is kept, energy is not made") {
  for (const char* functions : {"quadratic_spline", "gimp", "element"}) {
    CAPTURE(functions);
    Model<2> model = cylinder(
        R"({"region": {"sphere": {"centre": [0, 1.31], "radius": 0.3}}, "density": 2000,
            "velocity": [0, -2], "friction": 0.4})",
        fmt::format(R"("end_time": 0.04, "velocity_update": "flip", "shape_functions": "{}")",
                    functions),
        0.05);
    const double mass = model.rigid_bodies.at(1).mass, start = 0.5 * mass * 4;
    model.rigid_bodies.erase(model.rigid_bodies.begin());  // the base
    double slowest = -2;
    Observer observer;
    observer.history = [&](const HistoryRow& row) {
      const RigidBodyRow& ball = row.bodies.at(0);
      slowest = std::max(slowest, ball.velocity[1]);
      CHECK(ball.velocity[0] == 0);
      CHECK(row.momentum[1] + mass * ball.velocity[1] == doctest::Approx(-2 * mass).epsilon(1e-12));
      const double kinetic = row.kinetic + 0.5 * mass * std::pow(ball.velocity[1], 2);
      CHECK(kinetic < 1.001 * start);
      CHECK(std::abs(row.balance) < 0.02 * start);
    };
    Simulation simulation(std::move(model), {.threads = 2}, observer);
    simulation.run();
    CHECK(slowest > -1.5);  // it was stopped
  }
}

// Strains e along the axis and none across: sigma = M e over pi R^2. Contact yields by p / M of
// half a cell at either end (rigid_contact.h): the error is that of first order.
TEST_CASE("rigid bodies around an axis: a piston in a tube gets the force of confined strain") {
  constexpr double M = E * (1 - nu) / ((1 + nu) * (1 - 2 * nu)), strain = 0.01;
  constexpr double along = M * strain * pi, across = nu / (1 - nu) * M * strain * 2 * pi * 0.8;
  for (const auto& [h, tolerance] : {std::pair(0.1, 0.16), {0.05, 0.1}, {0.025, 0.05}}) {
    CAPTURE(h);
    const Model<2> model =
        cylinder(fmt::format(R"({{"region": {{"box": {{"min": [0, 1], "max": [1.5, 1.2]}}}},
                       "velocity": [0, {}], "math_function_id": 0}},
                      {{"region": {{"box": {{"min": [1, 0.2], "max": [1.2, 1]}}}}}})",
                             -10 * strain * 0.8),
                 damped(0.4), h);
    const auto [base, piston, tube] = mean_forces(model, 0.3);
    CHECK(piston[1] == test::within(tolerance, along));
    CHECK(base[1] == test::within(tolerance, -along));
    // The tube holds the lateral pressure along its whole circle.
    CHECK(tube[0] == test::within(1.5 * tolerance, across));
  }
}

// Hertz (1882) with the correction of Dimitriadis et al. (2002), Biophys. J. 82, 2798-2810, eq. 12,
// for a layer of finite thickness H on a base that it sticks to.
TEST_CASE("rigid bodies around an axis: a sphere gets the force of Hertz") {
  constexpr double R = 0.5, depth = 0.03, H = 0.8;
  const double chi = std::sqrt(R * depth) / H;
  const double a0 = -(1.2876 - 1.4678 * nu + 1.3442 * nu * nu) / (1 - nu);
  const double b0 = (0.6387 - 1.0277 * nu + 1.5164 * nu * nu) / (1 - nu);
  const double layer =
      1 - 2 * a0 / pi * chi + 4 * a0 * a0 / (pi * pi) * chi * chi -
      8 / std::pow(pi, 3) * (std::pow(a0, 3) + 4 * pi * pi / 15 * b0) * std::pow(chi, 3) +
      16 * a0 / std::pow(pi, 4) * (std::pow(a0, 3) + 3 * pi * pi / 5 * b0) * std::pow(chi, 4);
  const double hertz = 4.0 / 3 * E / (1 - nu * nu) * std::sqrt(R) * std::pow(depth, 1.5);
  for (const double h : {0.05, 0.025}) {
    CAPTURE(h);
    Model<2> model =
        cylinder(fmt::format(R"({{"region": {{"sphere": {{"centre": [0, 1.5], "radius": 0.5}}}},
                       "velocity": [0, {}], "math_function_id": 0}})",
                             -10 * depth),
                 damped(0.5), h);
    model.rigid_bodies.at(0).friction = std::numeric_limits<double>::infinity();
    CHECK(mean_forces(std::move(model), 0.4)[1][1] ==
          test::within(h > 0.03 ? 0.06 : 0.03, hertz * layer));
  }
}
