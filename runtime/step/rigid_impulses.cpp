#include "runtime/step/rigid_impulses.h"

#include <Eigen/Geometry>
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
  double across;                        ///< [1/kg] largest compliance across the normal
  std::array<double, 3> impulse{};      ///< [N s] along the directions

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
      touch, body, other, {along(touch.normal), along(first), along(touch.normal.cross(first))}, 0};
  // The larger eigenvalue of the compliance across the normal.
  const auto& [normal, one, two] = point.directions;
  if (dimension == 2) {
    point.across = one.compliance;
  } else {
    const double mixed =
        one.along.cwiseProduct(two.along).dot(body.inverse_mass + other.inverse_mass) +
        touch.arm.cross(one.along).dot(two.turn) +
        touch.other_arm.cross(one.along).dot(two.other_turn);
    point.across = 0.5 * (one.compliance + two.compliance) +
                   std::hypot(0.5 * (one.compliance - two.compliance), mixed);
  }
  return point;
}

/// Returns the largest change of a speed [m/s].
double strike_at(Point& point, int dimension) {
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

}  // namespace

int strike(std::span<StruckBody> bodies, std::span<const Touch> touches, int dimension,
           double tolerance) {
  std::vector<Point> points;
  for (const Touch& touch : touches) {
    const Point point = point_of(touch, bodies, dimension);
    if (point.directions[0].compliance > 0) points.push_back(point);
  }
  int sweeps = 0;
  for (double change = 2 * tolerance; change > tolerance && sweeps < most_sweeps; ++sweeps) {
    change = 0;
    for (std::size_t k = 0; k < points.size(); ++k) {
      Point& point = points[sweeps % 2 == 0 ? k : points.size() - 1 - k];
      change = std::max(change, strike_at(point, dimension));
    }
  }
  return sweeps;
}

}  // namespace lahar
