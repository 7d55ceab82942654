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

}  // namespace

template <int Dim>
RigidCollisions<Dim>::RigidCollisions(const Model<Dim>& model) : model_(model) {
  for (const RigidBody<Dim>& body : model.rigid_bodies)
    points_.push_back(is_free(body) ? surface_points(*body.solid, cuts_of(Dim))
                                    : std::vector<Vec<Dim>>{});
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
        const double way = spare * dt * (speed + dt * gravity);
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
  for (const Vec<Dim>& point : points) {
    const Vec<Dim> x = here.origin + here.axes * (point - body.centre);
    auto near = wall.solid->nearest(wall.centre + there.axes.transpose() * (x - there.origin));
    if (!(near.distance < 0)) continue;
    const Vec<Dim> normal = there.axes * near.normal;
    const Vec<Dim> w = here.velocity_at(x) - there.velocity_at(x);
    const double along = w.dot(normal);
    const double push = share_of_point * mass * omega *
                        std::max(0.0, -omega * near.distance - 2 * damping_ratio * along);
    const Vec<Dim> slip = w - along * normal;
    // So much would stop it within some steps; friction allows less.
    const double drag = share_of_point * 2 * damping_ratio * mass * omega;
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
