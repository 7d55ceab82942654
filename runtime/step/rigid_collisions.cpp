#include "runtime/step/rigid_collisions.h"

#include <algorithm>
#include <cmath>

#include "physics/geometry/solid_samples.h"

namespace lahar {

namespace {

constexpr int cuts_of(int dim) {
  return dim == 2 ? 64 : 20;
}
constexpr double steps_of_contact = 20;  ///< 1 / (omega dt)
constexpr double damping_ratio = 0.3;
constexpr double share_of_point = 0.25;

template <int Dim>
bool is_free(const RigidBody<Dim>& body) {
  return body.motion == RigidBody<Dim>::Motion::free;
}

/// Distance [m] of the points on a surface.
template <int Dim>
double spacing_of(const Solid<Dim>& solid) {
  const auto [low, high] = solid.bounds();
  return (high - low).maxCoeff() / cuts_of(Dim);
}

/// Move a point on a round surface to where the surface looks along `down`, if that is not further
/// than `reach` [m]: by the curvature on the way there. False where it is flat, or has an edge.
template <int Dim>
bool move_to_extreme(const Solid<Dim>& solid, const Vec<Dim>& down, double reach, Vec<Dim>& point) {
  constexpr double least_bend = 0.01, close = 1e-5;  // [rad] over `reach`, and from `down`
  struct Place {
    Vec<Dim> x, normal;
  };
  const auto on_surface = [&](const Vec<Dim>& x) {
    const auto near = solid.nearest(x);
    return Place{x - near.distance * near.normal, near.normal};
  };
  Place at = on_surface(point);
  for (int k = 0; k < 4; ++k) {
    Vec<Dim> along = down - down.dot(at.normal) * at.normal;
    if (along.norm() < close) {  // any way will do
      along =
          Vec<Dim>::Unit(at.normal.cwiseAbs().minCoeff() == std::abs(at.normal[0]) ? 0 : Dim - 1);
      along -= along.dot(at.normal) * at.normal;
    }
    along.normalize();
    const auto angle = [&](const Vec<Dim>& normal) {
      return std::atan2(
          down.dot(along) * normal.dot(at.normal) - down.dot(at.normal) * normal.dot(along),
          down.dot(normal));
    };
    const double before = angle(at.normal), probe = 0.05 * reach;
    if (!(std::abs(before) < 1)) return false;
    const double bend = (before - angle(on_surface(at.x + probe * along).normal)) / probe;
    if (!(bend * reach > least_bend) || before > 1.5 * bend * reach) return false;
    if (std::abs(before) < close) {
      point = at.x;
      return true;
    }
    at = on_surface(at.x + std::tan(before) / bend * along);
  }
  return false;
}

}  // namespace

template <int Dim>
RigidCollisions<Dim>::RigidCollisions(const Model<Dim>& model) : model_(model) {
  for (const RigidBody<Dim>& body : model.rigid_bodies) {
    points_.push_back(is_free(body) ? surface_points(*body.solid, cuts_of(Dim))
                                    : std::vector<Vec<Dim>>{});
    spacing_.push_back(is_free(body) ? spacing_of(*body.solid) : 0.0);
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
      for (const Vec<Dim>& point : points_[k]) {
        const Vec<Dim> x = here.origin + here.axes * (point - model_.rigid_bodies[k].centre);
        const double speed = (here.velocity_at(x) - there.velocity_at(x)).norm();
        const double way = spare * dt * (speed + dt * gravity) + spacing_[k];
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
  for (Vec<Dim> point : points) {
    Touch at{place_of(point), nearest(place_of(point)), false};
    if (!(at.near.distance < spacing)) continue;
    const Vec<Dim> down = -(here.axes.transpose() * at.near.normal);
    at.round = move_to_extreme<Dim>(*body.solid, down, spacing, point);
    if (at.round) {
      const auto is_here = [&](const Vec<Dim>& other) {
        return (other - point).norm() < 0.1 * spacing;
      };
      if (std::any_of(extremes.begin(), extremes.end(), is_here)) continue;
      extremes.push_back(point);
      at.x = place_of(point);
      at.near = nearest(at.x);
    }
    if (!(at.near.distance < 0)) continue;
    round += at.round;
    touches.push_back(at);
  }
  for (const auto& [x, near, is_round] : touches) {
    const Vec<Dim>& normal = near.normal;
    const double part = is_round ? std::max(share_of_point, 1 / round) : share_of_point;
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
