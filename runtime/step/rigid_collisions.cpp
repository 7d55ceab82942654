#include "runtime/step/rigid_collisions.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iterator>

#include "physics/geometry/solid_samples.h"

namespace lahar {

namespace {

constexpr int cuts_of(int dim) {
  return dim == 2 ? 64 : 20;
}
constexpr double steps_of_contact = 20;  ///< 1 / (omega dt)
constexpr double damping_ratio = 0.3;
constexpr double share_of_point = 0.25;
/// The sum of the shares of all points of flat faces that touch the other body is not more.
constexpr double most_of_flat = 16;

template <int Dim>
bool is_free(const RigidBody<Dim>& body) {
  return body.motion == RigidBody<Dim>::Motion::free;
}

template <int Dim>
struct SurfacePlace {
  Vec<Dim> x, normal;
};

template <int Dim>
SurfacePlace<Dim> on_surface(const Solid<Dim>& solid, const Vec<Dim>& x) {
  const auto near = solid.nearest(x);
  return {x - near.distance * near.normal, near.normal};
}

constexpr double probe = 0.05;       ///< of the distance of points: so far off bends are measured
constexpr double least_bend = 0.01;  ///< [rad] over the distance of points

/// Whether a surface bends outwards at a point in some direction: by more than a hundredth, and
/// less than an edge, over the distance `reach` [m] of points.
template <int Dim>
bool is_round(const Solid<Dim>& solid, const Vec<Dim>& point, double reach) {
  constexpr double edge = 3;  // [rad]
  const SurfacePlace<Dim> at = on_surface(solid, point);
  const auto bends = [&](const Vec<Dim>& along) {
    const double angle = on_surface<Dim>(solid, at.x + probe * reach * along).normal.dot(along);
    return angle > least_bend * probe && angle < edge * probe;
  };
  const Vec<Dim> along = at.normal.unitOrthogonal();
  if constexpr (Dim == 3)
    if (bends(at.normal.cross(along))) return true;
  return bends(along);
}

/// Move a point on a round surface to where the surface looks along `down`, if that is not further
/// than 1.5 times `reach` [m]: by the curvature on the way there. False where it finds none.
template <int Dim>
bool move_to_extreme(const Solid<Dim>& solid, const Vec<Dim>& down, double reach, Vec<Dim>& point) {
  constexpr double close = 1e-5, furthest = 1;  // [rad] from `down`
  SurfacePlace<Dim> at = on_surface(solid, point);
  for (int k = 0; k < 4; ++k) {
    const Vec<Dim> sideways = down - down.dot(at.normal) * at.normal;
    const double angle = std::atan2(sideways.norm(), down.dot(at.normal));
    if (angle > furthest) return false;
    const Vec<Dim> along = sideways.normalized();
    const double bend =
        on_surface<Dim>(solid, at.x + probe * reach * along).normal.dot(along) / (probe * reach);
    if (angle < close || bend * reach < least_bend) {  // or flat along that way, as a roller
      point = at.x;
      return true;
    }
    if (angle > 1.5 * bend * reach) return false;
    at = on_surface<Dim>(solid, at.x + std::tan(angle) / bend * along);
  }
  return false;
}

}  // namespace

template <int Dim>
RigidCollisions<Dim>::RigidCollisions(const Model<Dim>& model) : model_(model) {
  for (const RigidBody<Dim>& body : model.rigid_bodies) {
    auto& points = points_.emplace_back();
    spacing_.push_back(0.0);
    if (!is_free(body)) continue;
    const auto [low, high] = body.solid->bounds();
    spacing_.back() = (high - low).maxCoeff() / cuts_of(Dim);
    for (const Vec<Dim>& x : surface_points(*body.solid, cuts_of(Dim)))
      points.push_back({x, is_round(*body.solid, x, spacing_.back())});
  }
}

template <int Dim>
auto RigidCollisions<Dim>::near(const std::vector<Placement<Dim>>& at, double gravity,
                                double dt) const -> std::vector<Near> {
  constexpr double spare = 2;
  std::vector<Near> all;
  for (std::size_t k = 0; k < at.size(); ++k)
    for (std::size_t j = 0; j < at.size(); ++j) {
      if (j == k || points_[k].empty()) continue;
      const RigidBody<Dim>& wall = model_.rigid_bodies[j];
      const Placement<Dim>&here = at[k], &there = at[j];
      Near pair{k, j, {}};
      for (const Point& point : points_[k]) {
        const Vec<Dim> x = here.origin + here.axes * (point.x - model_.rigid_bodies[k].centre);
        const double speed = (here.velocity_at(x) - there.velocity_at(x)).norm();
        const double way = spare * dt * (speed + dt * gravity) + (point.round ? spacing_[k] : 0.0);
        const Vec<Dim> there_x = wall.centre + there.axes.transpose() * (x - there.origin);
        if (wall.solid->nearest(there_x).distance < way) pair.points.push_back(point);
      }
      if (!pair.points.empty()) all.push_back(std::move(pair));
    }
  return all;
}

template <int Dim>
void RigidCollisions<Dim>::add(const std::vector<Near>& near, const std::vector<Placement<Dim>>& at,
                               double dt, std::vector<Reaction>& reactions) const {
  for (const Near& pair : near) add_pair(pair, at, dt, reactions);
}

template <int Dim>
void RigidCollisions<Dim>::add_pair(const Near& pair, const std::vector<Placement<Dim>>& at,
                                    double dt, std::vector<Reaction>& reactions) const {
  const auto& [free, other, points] = pair;
  const RigidBody<Dim>&body = model_.rigid_bodies[free], &wall = model_.rigid_bodies[other];
  const Placement<Dim>&here = at[free], &there = at[other];
  const double mass = is_free(wall) ? body.mass * wall.mass / (body.mass + wall.mass) : body.mass;
  const double omega = 1 / (steps_of_contact * dt);
  const double friction = std::max(body.friction, wall.friction);
  const double spacing = spacing_[free];
  const auto place_of = [&](const Vec<Dim>& point) {
    return Vec<Dim>(here.origin + here.axes * (point - body.centre));
  };
  const auto nearest = [&](const Vec<Dim>& x) {
    auto near = wall.solid->nearest(wall.centre + there.axes.transpose() * (x - there.origin));
    near.normal = there.axes * near.normal;
    return near;
  };
  struct Touch {
    Vec<Dim> x;
    typename Solid<Dim>::Nearest near;
    bool round;
  };
  std::vector<Touch> touches;
  std::vector<Vec<Dim>> extremes;
  double round = 0;
  for (const auto& [at_start, bends] : points) {
    Touch at{place_of(at_start), nearest(place_of(at_start)), false};
    if (Vec<Dim> point = at_start; bends && at.near.distance < spacing) {
      const Vec<Dim> down = -(here.axes.transpose() * at.near.normal);
      at.round = move_to_extreme<Dim>(*body.solid, down, spacing, point);
      const auto is_here = [&](const Vec<Dim>& other) {
        return (other - point).norm() < 0.1 * spacing;
      };
      if (at.round) {
        if (std::any_of(extremes.begin(), extremes.end(), is_here)) continue;
        extremes.push_back(point);
        at.x = place_of(point);
        at.near = nearest(at.x);
      }
    }
    if (!(at.near.distance < 0)) continue;
    round += at.round;
    touches.push_back(at);
  }
  // Points on an edge beside a round place that touches, as on the rim of a roller, are part of it.
  const auto beside_round = [&](const Touch& touch) {
    return !touch.round && std::any_of(touches.begin(), touches.end(), [&](const Touch& other) {
      return other.round && (other.x - touch.x).norm() < 1.5 * spacing;
    });
  };
  std::vector<Touch> counting;
  std::copy_if(touches.begin(), touches.end(), std::back_inserter(counting),
               [&](const Touch& touch) { return !beside_round(touch); });
  const double flat = static_cast<double>(counting.size()) - round;
  const double of_round = std::max(share_of_point, 1 / round);
  const double of_flat = std::min(share_of_point, most_of_flat / (is_free(wall) ? 2 * flat : flat));
  for (const auto& [x, near, is_round] : counting) {
    const Vec<Dim>& normal = near.normal;
    const double part = is_round ? of_round : of_flat;
    const Vec<Dim> w = here.velocity_at(x) - there.velocity_at(x);
    const double along = w.dot(normal);
    const double push =
        part * mass * omega * std::max(0.0, -omega * near.distance - 2 * damping_ratio * along);
    const Vec<Dim> slip = w - along * normal;
    // So much would stop it within some steps; friction allows less.
    const double drag = part * 2 * damping_ratio * mass * omega;
    const double speed = slip.norm();
    const double share = speed > 0 ? std::min(drag, friction * push / speed) : 0.0;
    const Vec<Dim> force = push * normal - share * slip;
    reactions[free].template add<Dim>(force, x - here.origin);
    reactions[other].template add<Dim>(-force, x - there.origin);
  }
}

template class RigidCollisions<2>;
template class RigidCollisions<3>;

}  // namespace lahar
