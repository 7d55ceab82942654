#include "runtime/step/rigid_impulses.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace lahar {

namespace {

constexpr int most_sweeps = 500;

/// What an impulse of one along a direction at a point does to both bodies.
struct Direction {
  Vec<3> along, turn, other_turn;  ///< turn [rad/s]
  double compliance;               ///< [1/kg] of the point along it
};

/// A point with the impulses that have acted there.
struct Point {
  const Touch& touch;
  StruckBody &body, &other;
  std::array<Direction, 3> directions;  ///< the normal, then those across
  double across = 0;                    ///< [1/kg] largest compliance across the normal
  bool may_stick = false;               ///< it can move along all directions
  Eigen::Matrix3d sticking{};           ///< [kg] impulses that change the speeds by one
  std::array<double, 3> impulse{};      ///< [N s] along the directions
  std::array<double, 3> before{};       ///< that of the sweep before
  std::array<double, 3> start{};        ///< [m/s] speeds along the directions before all impulses
  std::array<double, 3> further{};      ///< so far further would conjugate gradients go

  double speed(int k) const {
    const Vec<3> w = body.velocity_at(touch.arm) - other.velocity_at(touch.other_arm);
    return w.dot(directions[static_cast<std::size_t>(k)].along);
  }
  /// Returns by how much [m/s] the speed along the direction changes.
  double change_impulse(int k, double to) {
    const auto i = static_cast<std::size_t>(k);
    const Direction& d = directions[i];
    const double by = to - impulse[i];
    impulse[i] = to;
    body.velocity += by * body.inverse_mass.cwiseProduct(d.along);
    body.spin += by * d.turn;
    other.velocity -= by * other.inverse_mass.cwiseProduct(d.along);
    other.spin -= by * d.other_turn;
    return std::abs(by) * d.compliance;
  }
};

Direction direction_of(const Touch& touch, const StruckBody& body, const StruckBody& other,
                       const Vec<3>& along) {
  const Vec<3> moment = touch.arm.cross(along), other_moment = touch.other_arm.cross(along);
  Direction d{along, body.inverse_inertia * moment, other.inverse_inertia * other_moment, 0};
  d.compliance = along.cwiseAbs2().dot(body.inverse_mass + other.inverse_mass) +
                 moment.dot(d.turn) + other_moment.dot(d.other_turn);
  return d;
}

Point point_of(const Touch& touch, std::span<StruckBody> bodies, int dimension) {
  StruckBody &body = bodies[touch.body], &other = bodies[touch.other];
  const Vec<3> first = dimension == 2 ? Vec<3>(-touch.normal.y(), touch.normal.x(), 0)
                                      : Vec<3>(touch.normal.unitOrthogonal());
  const auto along = [&](const Vec<3>& axis) { return direction_of(touch, body, other, axis); };
  Point point{
      touch, body, other, {along(touch.normal), along(first), along(touch.normal.cross(first))}};
  Eigen::Matrix3d compliance = Eigen::Matrix3d::Identity();  // of the point, along the directions
  for (int i = 0; i < dimension; ++i)
    for (int j = 0; j < dimension; ++j) {
      const Direction &on = point.directions[static_cast<std::size_t>(i)],
                      &by = point.directions[static_cast<std::size_t>(j)];
      const Vec<3> w = (body.inverse_mass + other.inverse_mass).cwiseProduct(by.along) +
                       by.turn.cross(touch.arm) + by.other_turn.cross(touch.other_arm);
      compliance(i, j) = on.along.dot(w);
    }
  // The larger eigenvalue of the compliance across the normal.
  const double c11 = compliance(1, 1), c22 = compliance(2, 2);
  point.across =
      dimension == 2 ? c11 : 0.5 * (c11 + c22) + std::hypot(0.5 * (c11 - c22), compliance(1, 2));
  constexpr double least_share = 1e-9;  // of a body that nothing holds
  const double determinant = compliance.determinant();
  double product = 1;
  for (int i = 0; i < dimension; ++i) product *= compliance(i, i);
  point.may_stick = touch.friction > 0 && determinant > least_share * product && product > 0;
  if (point.may_stick) point.sticking = compliance.inverse();
  return point;
}

/// Returns the largest change of a speed [m/s].
double strike_at(Point& point, int dimension) {
  if (point.may_stick) {  // where friction holds, all directions at once
    Vec<3> wanted(point.touch.least - point.speed(0), -point.speed(1),
                  dimension == 2 ? 0.0 : -point.speed(2));
    wanted = Vec<3>(point.impulse[0], point.impulse[1], point.impulse[2]) + point.sticking * wanted;
    if (wanted[0] >= 0 && wanted.tail<2>().norm() <= point.touch.friction * wanted[0]) {
      double change = 0;
      for (int k = 0; k < dimension; ++k)
        change = std::max(change, point.change_impulse(k, wanted[k]));
      return change;
    }
  }
  const double push = std::max(0.0, point.impulse[0] + (point.touch.least - point.speed(0)) /
                                                           point.directions[0].compliance);
  double change = point.change_impulse(0, push);
  if (point.touch.friction == 0 || point.across == 0) return change;
  const double most = push > 0 ? point.touch.friction * push : 0.0;
  const double one = point.impulse[1] - point.speed(1) / point.across;
  const double two = dimension == 2 ? 0.0 : point.impulse[2] - point.speed(2) / point.across;
  const double wanted = std::hypot(one, two);
  const double share = wanted > most ? most / wanted : 1.0;
  change = std::max(change, point.change_impulse(1, share * one));
  return dimension == 2 ? change : std::max(change, point.change_impulse(2, share * two));
}

/// Goes on along the conjugate direction of what the last sweep changed, whose square was
/// `last_square` in the sweep before (Silcowitz-Hansen, Niebe and Erleben 2010). Points that share
/// a load, as those of a tall body at its foot, need ten to a hundred times as many sweeps without.
void accelerate(std::vector<Point>& points, double& last_square, int dimension) {
  double square = 0;
  for (const Point& point : points)
    for (std::size_t k = 0; k < 3; ++k)
      square += (point.impulse[k] - point.before[k]) * (point.impulse[k] - point.before[k]);
  const double share = last_square > 0 ? square / last_square : 0;
  last_square = square;
  for (Point& point : points)
    for (std::size_t k = 0; k < static_cast<std::size_t>(dimension); ++k) {
      const double change = point.impulse[k] - point.before[k];
      if (share > 1) {
        point.further[k] = 0;
        continue;
      }
      const double jump = share * point.further[k];
      point.further[k] = jump + change;
      if (jump != 0) point.change_impulse(static_cast<int>(k), point.impulse[k] + jump);
    }
}

}  // namespace

Impulses strike(std::span<StruckBody> bodies, std::span<const Touch> touches, int dimension,
                double tolerance) {
  constexpr double least_compliance = 1e-6;  // of that across the normal
  std::vector<Point> points;
  for (const Touch& touch : touches) {
    const Point point = point_of(touch, bodies, dimension);
    if (point.directions[0].compliance > least_compliance * point.across) points.push_back(point);
  }
  for (Point& point : points)
    for (int k = 0; k < dimension; ++k) point.start[static_cast<std::size_t>(k)] = point.speed(k);
  Impulses all;
  double last_square = 0;
  for (double change = 2 * tolerance; change > tolerance && all.sweeps < most_sweeps;) {
    if (all.sweeps > 0) accelerate(points, last_square, dimension);
    for (Point& point : points) point.before = point.impulse;
    change = 0;
    for (Point& point : points) change = std::max(change, strike_at(point, dimension));
    for (std::size_t k = points.size(); k-- > 0;)
      change = std::max(change, strike_at(points[k], dimension));
    ++all.sweeps;
  }
  // An impulse works with the mean of the speeds before and after it.
  for (const Point& point : points)
    for (int k = 0; k < dimension; ++k) {
      const auto i = static_cast<std::size_t>(k);
      for (const double speed : {point.start[i], point.speed(k)}) {
        const double part = 0.5 * point.impulse[i] * speed;
        all.work += part;
        all.exchanged += std::abs(part);
      }
    }
  return all;
}

}  // namespace lahar
