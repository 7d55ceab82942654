// Friction and rotated axes of one node.
#include <doctest/doctest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>

#include "physics/boundary/constrained_node.h"
#include "tests/physics/mesh/mesh_fixtures.h"
#include "tests/within.h"

using namespace lahar;
using namespace lahar::test;

namespace {

constexpr double dt = 0.01;

/// A floor below: normal along the last axis, held.
template <int Dim>
ConstrainedNode<Dim> floor_of(double friction) {
  ConstrainedNode<Dim> wall;
  wall.fixed[Dim - 1] = true;
  wall.normal = Dim - 1;
  wall.outward = -1;
  wall.friction = friction;
  return wall;
}

template <int Dim>
struct After {
  Vec<Dim> v, a;
  WallWork work;
};
template <int Dim>
After<Dim> advance(const ConstrainedNode<Dim>& wall, Vec<Dim> v, Vec<Dim> a,
                   bool as_cbgeo = false) {
  const WallWork work = advance_at_wall(wall, dt, as_cbgeo, v.data(), a.data());
  return {v, a, work};
}

void random_turn(Eigen::Matrix2d& turn, std::mt19937& random) {
  turn = Eigen::Rotation2D<double>(uniform(random, -3, 3)).toRotationMatrix();
}
void random_turn(Eigen::Matrix3d& turn, std::mt19937& random) {
  turn = Eigen::AngleAxis<double>(
             uniform(random, -3, 3),
             random_point<3>(random, -Vec<3>::Ones(), Vec<3>::Ones()).normalized())
             .toRotationMatrix();
}

}  // namespace

TEST_CASE("a node that slides is slowed by mu times the acceleration that presses it") {
  const After<2> after = advance<2>(floor_of<2>(0.25), {2, 0}, {1, -8});
  CHECK(after.a == Vec<2>(1 - 0.25 * 8, 0));
  CHECK(after.v[0] == doctest::Approx(2 - dt));
  CHECK(after.v[1] == 0);
  // Along the velocity that it would get: (3, 4) / 5.
  const After<3> slide = advance<3>(floor_of<3>(0.5), {3, 4 - 10 * dt, 0}, {0, 10, -2});
  CHECK((slide.a - Vec<3>(-0.6, 10 - 0.8, 0)).norm() < 1e-13);
}

TEST_CASE("a node that is slow enough stops, and does not begin to slide back") {
  const After<2> after = advance<2>(floor_of<2>(0.25), {0.015, 0}, {0.3, -8});
  CHECK(after.v == Vec<2>(0, 0));
  CHECK(after.a[0] == doctest::Approx(-1.5));
  CHECK(advance<3>(floor_of<3>(0.25), {0.01, -0.01, 0}, {0.3, 0, -8}).v == Vec<3>(0, 0, 0));
}

TEST_CASE("a node at rest stays where friction holds it, else the pull that is left moves it") {
  CHECK(advance<2>(floor_of<2>(0.25), {0, 0}, {-1.9, -8}).a == Vec<2>(0, 0));
  CHECK(advance<2>(floor_of<2>(0.25), {0, 0}, {-2.5, -8}).a == Vec<2>(-0.5, 0));
  CHECK(advance<3>(floor_of<3>(0.25), {0, 0, 0}, {1.1, -1.6, -8}).a == Vec<3>(0, 0, 0));
  const After<3> slip = advance<3>(floor_of<3>(0.25), {0, 0, 0}, {3, -4, -8});
  CHECK((slip.a - Vec<3>(3 - 1.2, -4 + 1.6, 0)).norm() < 1e-13);
  // The reference code divides by 5 - 2 instead of 5.
  const After<3> there = advance<3>(floor_of<3>(0.25), {0, 0, 0}, {3, -4, -8}, true);
  CHECK((there.a - Vec<3>(3 - 2, -4 + 8.0 / 3, 0)).norm() < 1e-13);
  CHECK(advance<2>(floor_of<2>(0.25), {0, 0}, {-2.5, -8}, true).a == Vec<2>(-0.5, 0));
}

TEST_CASE("a node that is pulled off its wall has no friction") {
  CHECK(advance<2>(floor_of<2>(0.25), {2, 0}, {1, 8}).a == Vec<2>(1, 0));
  ConstrainedNode<2> ceiling = floor_of<2>(0.25);
  ceiling.outward = 1;
  CHECK(advance<2>(ceiling, {2, 0}, {1, 8}).a == Vec<2>(1 - 2, 0));
  CHECK(advance<2>(ceiling, {2, 0}, {1, -8}).a == Vec<2>(1, 0));
  CHECK(advance<3>(floor_of<3>(0.25), {2, 1, 0}, {1, 0, 8}).a == Vec<3>(1, 0, 0));
}

TEST_CASE("a wall without friction only holds") {
  ConstrainedNode<3> wall;
  wall.fixed = {false, true, false};
  wall.velocity = {9, -0.5, 9};
  const After<3> after = advance<3>(wall, {1, -0.5, 3}, {10, 20, 30});
  CHECK(after.v == Vec<3>(1 + 10 * dt, -0.5, 3 + 30 * dt));
  CHECK(after.a == Vec<3>(10, 0, 30));
  Vec<3> v(1, 2, 3);
  prescribe_velocity(wall, v.data());
  CHECK(v == Vec<3>(1, -0.5, 3));
}

TEST_CASE("constraints in rotated axes are those of the axes, rotated") {
  std::mt19937 random(5);
  const auto check = [&]<int Dim>(std::integral_constant<int, Dim>) {
    for (int k = 0; k < 200; ++k) {
      ConstrainedNode<Dim> plain = floor_of<Dim>(uniform(random, 0, 1));
      plain.velocity[Dim - 1] = k % 3 == 0 ? 0.1 : 0.0;
      ConstrainedNode<Dim> turned = plain;
      Eigen::Matrix<double, Dim, Dim> turn;
      random_turn(turn, random);
      turned.axes = turn;
      const Vec<Dim> a = random_point<Dim>(random, -3 * Vec<Dim>::Ones(), 3 * Vec<Dim>::Ones());
      Vec<Dim> v = random_point<Dim>(random, -0.1 * Vec<Dim>::Ones(), 0.1 * Vec<Dim>::Ones());
      if (k % 4 == 0) v.setZero();
      Vec<Dim> straight = v, rotated = turn * v;
      prescribe_velocity(plain, straight.data());
      prescribe_velocity(turned, rotated.data());
      CHECK((rotated - turn * straight).norm() < 1e-15);
      if (v.isZero(0)) straight = rotated = v;  // rounding would make a moving node of it
      const After<Dim> one = advance<Dim>(plain, straight, a);
      const After<Dim> other = advance<Dim>(turned, rotated, turn * a);
      CHECK((other.v - turn * one.v).norm() < 1e-14);
      CHECK((other.a - turn * one.a).norm() < 1e-13);
      CHECK(other.work.friction == doctest::Approx(one.work.friction).epsilon(1e-10));
      CHECK(other.work.reaction == doctest::Approx(one.work.reaction).epsilon(1e-10));
    }
  };
  check(std::integral_constant<int, 2>());
  check(std::integral_constant<int, 3>());
}

TEST_CASE("what friction takes and the wall gives is what the kinetic energy is short of") {
  std::mt19937 random(6);
  for (int k = 0; k < 200; ++k) {
    ConstrainedNode<3> wall = floor_of<3>(uniform(random, 0, 1));
    wall.velocity[2] = uniform(random, -0.1, 0.1);
    const Vec<3> a = random_point<3>(random, -3 * Vec<3>::Ones(), 3 * Vec<3>::Ones());
    Vec<3> v = random_point<3>(random, -0.1 * Vec<3>::Ones(), 0.1 * Vec<3>::Ones());
    v[2] = wall.velocity[2];
    const After<3> after = advance<3>(wall, v, a);
    const Vec<3> mean = 0.5 * (v + after.v);
    const double gained = 0.5 * (after.v.squaredNorm() - v.squaredNorm());
    CHECK(
        gained ==
        doctest::Approx(dt * a.dot(mean) + after.work.reaction - after.work.taken).epsilon(1e-10));
    CHECK(after.work.taken >= 0);
    CHECK(after.work.friction == after.work.taken);  // two-sided walls give no shocks
  }
}

TEST_CASE("an accelerated node has its prescribed acceleration, in its own axes, after friction") {
  ConstrainedNode<2> wall = floor_of<2>(0.25);
  wall.accelerated[0] = true;
  wall.acceleration[0] = 3;
  const After<2> after = advance<2>(wall, {2, 0}, {1, -8});
  CHECK(after.a == Vec<2>(3, 0));
  CHECK(after.v[0] == doctest::Approx(2 + 3 * dt));
  // What pushes it, against friction too, does work with the mean velocity.
  CHECK(after.work.reaction == doctest::Approx(dt * (3 - (1 - 2)) * (2 + 1.5 * dt)));
  CHECK(after.work.friction == doctest::Approx(dt * 2 * (2 + 1.5 * dt)));
  wall.normal = -1;
  wall.fixed[1] = false;
  std::mt19937 random(3);
  Eigen::Matrix2d turn;
  random_turn(turn, random);
  wall.axes = turn;
  const After<2> turned = advance<2>(wall, {2, 1}, {1, -8});
  const Vec<2> local = wall.axes.transpose() * turned.a;
  CHECK(local[0] == doctest::Approx(3));
  CHECK(local[1] == doctest::Approx((wall.axes.transpose() * Vec<2>(1, -8))[1]));
  CHECK((turned.v - (Vec<2>(2, 1) + dt * turned.a)).norm() < 1e-14);
}

namespace {

/// A one-sided floor below.
template <int Dim>
ConstrainedNode<Dim> one_sided_floor(double friction) {
  ConstrainedNode<Dim> wall;
  wall.pushes[Dim - 1] = -1;
  wall.rubs[Dim - 1] = friction;
  return wall;
}

}  // namespace

TEST_CASE(
    "a one-sided wall stops what moves into it, rubs by mu times that impulse, lets go else") {
  const ConstrainedNode<2> wall = one_sided_floor<2>(0.25);
  // Momentum that a node brings counts as what accelerates it does.
  const After<2> brings = advance<2>(wall, {2, -0.4}, {0, 0});
  CHECK((brings.v - Vec<2>(2 - 0.1, 0)).norm() < 1e-15);
  CHECK((brings.a - Vec<2>(-0.1, 0.4) / dt).norm() < 1e-12);
  CHECK((advance<2>(wall, {2, 0}, {1, -8}).v - Vec<2>(2 + dt - 2 * dt, 0)).norm() < 1e-15);
  CHECK(advance<2>(wall, {0.05, -0.4}, {0, 0}).v == Vec<2>(0, 0));
  const After<2> leaves = advance<2>(wall, {2, 0.1}, {0, -8});
  CHECK((leaves.v - Vec<2>(2, 0.1 - 8 * dt)).norm() < 1e-15);
  CHECK(leaves.work.friction == 0);
}

TEST_CASE("the kinetic energy of a node at a one-sided wall changes by the work of all forces") {
  std::mt19937 random(7);
  for (int k = 0; k < 1000; ++k) {
    ConstrainedNode<3> wall = one_sided_floor<3>(uniform(random, 0, 1));
    Eigen::Matrix3d turn;
    random_turn(turn, random);
    wall.axes = turn;
    wall.velocity[2] = k % 2 == 0 ? 0.0 : uniform(random, -1, 1);
    if (k % 6 == 0) wall.pushes[0] = 1, wall.rubs[0] = 0.3;  // a corner, of walls at rest
    if (k % 5 == 0) wall.fixed[1] = true;
    Vec<3> v = random_point<3>(random, -Vec<3>::Ones(), Vec<3>::Ones());
    prescribe_velocity(wall, v.data());
    const Vec<3> a = random_point<3>(random, -100 * Vec<3>::Ones(), 100 * Vec<3>::Ones());
    const After<3> after = advance<3>(wall, v, a);
    const Vec<3> mean = 0.5 * (v + after.v);
    // What holds a fixed direction at rest does no work, nor do forces along it.
    CHECK(0.5 * (after.v.squaredNorm() - v.squaredNorm()) ==
          within(1e-5, dt * a.dot(mean) + after.work.reaction - after.work.taken));
    Vec<3> local = wall.axes.transpose() * after.v;
    CHECK(local[2] >= wall.velocity[2] - 1e-13);
    if (wall.velocity[2] == 0 && k % 6 != 0) {
      Vec<3> free = wall.axes.transpose() * Vec<3>(v + dt * a);
      const double pressed = std::max(0.0, -free[2]);
      Vec<3> change = wall.axes.transpose() * (after.v - v - dt * a);
      if (k % 5 == 0) change[1] = 0;
      CHECK(change[2] == doctest::Approx(pressed).epsilon(1e-9));
      CHECK(change.head<2>().norm() <= wall.rubs[2] * pressed + 1e-13);
    }
  }
}

TEST_CASE("strains are taken with velocities that do not move into a one-sided wall") {
  const ConstrainedNode<2> wall = one_sided_floor<2>(0.5);
  Vec<2> v(3, -2);
  CHECK(stop_at_wall(wall, v.data()) == Vec<2>(0, -2));
  CHECK(v == Vec<2>(3, 0));
  Vec<2> up(3, 2);
  CHECK(stop_at_wall(wall, up.data()) == Vec<2>(0, 0));
  CHECK(up == Vec<2>(3, 2));
}
