// Impulses of bodies on each other, by themselves: laws that hold for any bodies and points.
#include "runtime/step/rigid_impulses.h"

#include <doctest/doctest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>
#include <vector>

using namespace lahar;

namespace {

struct Bodies {
  std::vector<StruckBody> bodies;
  std::vector<double> mass;
  std::vector<Eigen::Matrix3d> inertia;

  Vec<3> momentum() const {
    Vec<3> sum = Vec<3>::Zero();
    for (std::size_t k = 0; k < bodies.size(); ++k) sum += mass[k] * bodies[k].velocity;
    return sum;
  }
  double kinetic() const {
    double sum = 0;
    for (std::size_t k = 0; k < bodies.size(); ++k)
      sum += 0.5 * (mass[k] * bodies[k].velocity.squaredNorm() +
                    bodies[k].spin.dot(inertia[k] * bodies[k].spin));
    return sum;
  }
};

Vec<3> random_vector(std::mt19937& draw, int dimension) {
  std::uniform_real_distribution<double> even(-1, 1);
  Vec<3> v(even(draw), even(draw), even(draw));
  if (dimension == 2) v[2] = 0;
  return v;
}

Bodies random_bodies(std::mt19937& draw, int dimension, int count) {
  std::uniform_real_distribution<double> decades(-1, 1);
  Bodies all;
  for (int k = 0; k < count; ++k) {
    StruckBody body;
    all.mass.push_back(std::pow(10, decades(draw)));
    Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
    for (int d = 0; d < 3; ++d) moments(d, d) = all.mass.back() * (0.3 + 0.2 * decades(draw));
    const Vec<3> turn = random_vector(draw, 3);
    const Eigen::Matrix3d axes =
        dimension == 2 ? Eigen::Matrix3d(Eigen::Matrix3d::Identity())
                       : Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix();
    all.inertia.push_back(axes * moments * axes.transpose());
    body.inverse_mass.setConstant(1 / all.mass.back());
    body.inverse_inertia = all.inertia.back().inverse();
    body.velocity = random_vector(draw, dimension);
    body.spin = dimension == 2 ? Vec<3>(0, 0, decades(draw)) : random_vector(draw, 3);
    all.bodies.push_back(body);
  }
  return all;
}

Touch random_touch(std::mt19937& draw, int dimension, std::size_t body, std::size_t other) {
  Touch touch{.body = body, .other = other};
  touch.arm = random_vector(draw, dimension);
  touch.other_arm = random_vector(draw, dimension);
  touch.normal = random_vector(draw, dimension).normalized();
  touch.friction = std::uniform_real_distribution<double>(0, 1)(draw);
  return touch;
}

double speed(const Bodies& of, const Touch& touch) {
  return (of.bodies[touch.body].velocity_at(touch.arm) -
          of.bodies[touch.other].velocity_at(touch.other_arm))
      .dot(touch.normal);
}

}  // namespace

TEST_CASE("impulses part bodies, keep their momentum, and make no energy") {
  std::mt19937 draw(7);
  for (int n = 0; n < 400; ++n) {
    const int dimension = 2 + n % 2;
    Bodies all = random_bodies(draw, dimension, 4);
    std::vector<Touch> touches;
    for (const auto& [one, two] : {std::pair{0, 1}, {1, 2}, {2, 3}})
      touches.push_back(random_touch(draw, dimension, static_cast<std::size_t>(one),
                                     static_cast<std::size_t>(two)));
    const Vec<3> momentum = all.momentum();
    const double kinetic = all.kinetic();
    const double work = strike(all.bodies, touches, dimension, 1e-12).work;
    CAPTURE(n);
    CHECK(all.kinetic() - kinetic == doctest::Approx(work).epsilon(1e-9));
    CHECK((all.momentum() - momentum).norm() < 1e-13 * (1 + momentum.norm()));
    CHECK(all.kinetic() <= kinetic * (1 + 1e-12));
    for (const Touch& touch : touches) CHECK(speed(all, touch) > -1e-8);
  }
}

// One point: N = (least - w.n) / C along the normal, where there is no friction.
TEST_CASE("an impulse without friction is that of the compliance of both bodies") {
  std::mt19937 draw(11);
  for (int n = 0; n < 100; ++n) {
    const int dimension = 2 + n % 2;
    Bodies all = random_bodies(draw, dimension, 2);
    Touch touch = random_touch(draw, dimension, 0, 1);
    touch.friction = 0;
    touch.least = 0.3;
    const double before = speed(all, touch);
    double compliance = 0;
    for (const int k : {0, 1}) {
      const auto i = static_cast<std::size_t>(k);
      const Vec<3> moment = (k == 0 ? touch.arm : touch.other_arm).cross(touch.normal);
      compliance += 1 / all.mass[i] + moment.dot(all.inertia[i].inverse() * moment);
    }
    const Vec<3> velocity = all.bodies[0].velocity;
    strike(all.bodies, {&touch, 1}, dimension, 1e-14);
    const double impulse = std::max(0.0, (0.3 - before) / compliance);
    CHECK((all.mass[0] * (all.bodies[0].velocity - velocity) - impulse * touch.normal).norm() <
          1e-12);
    CHECK(speed(all, touch) == doctest::Approx(std::max(before, 0.3)));
  }
}

TEST_CASE("an impulse across is against the slip, at Coulomb's limit while it slips") {
  Bodies ball;
  ball.mass = {2};
  ball.inertia = {0.4 * 2 * Eigen::Matrix3d::Identity()};  // radius 1
  StruckBody body;
  body.inverse_mass.setConstant(0.5);
  body.inverse_inertia = ball.inertia[0].inverse();
  body.velocity = {3, 4, -2};
  ball.bodies = {body, StruckBody{}};
  Touch touch{.body = 0, .other = 1};
  touch.arm = {0, 0, -1};
  touch.other_arm = Vec<3>::Zero();
  touch.normal = {0, 0, 1};
  // It slips: the normal impulse is 4, the slip 5 m/s along (3, 4).
  touch.friction = 0.1;
  strike(ball.bodies, {&touch, 1}, 3, 1e-14);
  CHECK((ball.bodies[0].velocity - Vec<3>(3 - 0.6 * 0.2, 4 - 0.8 * 0.2, 0)).norm() < 1e-12);
  // It sticks: v = r w, with the moment of momentum about the point that it had.
  ball.bodies = {body, StruckBody{}};
  touch.friction = 10;
  strike(ball.bodies, {&touch, 1}, 3, 1e-14);
  CHECK((ball.bodies[0].velocity - Vec<3>(3, 4, 0) / 1.4).norm() < 1e-12);
  CHECK(ball.bodies[0].velocity_at(touch.arm).norm() < 1e-12);
}

TEST_CASE("what nothing moves stays, and so does what only parts") {
  std::vector<StruckBody> bodies(2);
  bodies[0].velocity = {0, 0, 1};
  Touch touch{.body = 0, .other = 1};
  touch.arm = touch.other_arm = Vec<3>::Zero();
  touch.normal = {0, 0, -1};
  touch.friction = std::numeric_limits<double>::infinity();
  strike(bodies, {&touch, 1}, 3, 1e-12);  // both are held
  CHECK(bodies[0].velocity == Vec<3>(0, 0, 1));
  bodies[0].inverse_mass.setOnes();
  touch.normal = {0, 0, 1};
  CHECK(strike(bodies, {&touch, 1}, 3, 1e-12).sweeps == 1);
  CHECK(bodies[0].velocity == Vec<3>(0, 0, 1));
}
