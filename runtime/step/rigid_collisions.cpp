#include "runtime/step/rigid_collisions.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

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

template <int Dim>
void add_force(Reaction& to, const Vec<Dim>& force, const Vec<Dim>& arm) {
  for (int d = 0; d < Dim; ++d) to.force[static_cast<std::size_t>(d)] += force[d];
  if constexpr (Dim == 2) {
    to.torque[2] += arm.x() * force.y() - arm.y() * force.x();
  } else {
    const Vec<3> torque = arm.cross(force);
    for (std::size_t d = 0; d < 3; ++d) to.torque[d] += torque[static_cast<int>(d)];
  }
}

}  // namespace

template <int Dim>
std::vector<Vec<Dim>> surface_points(const Solid<Dim>& solid, int cuts) {
  const auto [low, high] = solid.bounds();
  const double h = (high - low).maxCoeff() / cuts;
  std::array<int, 3> n{1, 1, 1};
  for (int d = 0; d < Dim; ++d)
    n[static_cast<std::size_t>(d)] = static_cast<int>(std::ceil((high - low)[d] / h)) + 1;
  std::vector<Vec<Dim>> points;
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i) {
        const std::array<int, 3> at{i, j, k};
        Vec<Dim> x;
        for (int d = 0; d < Dim; ++d) x[d] = low[d] + at[static_cast<std::size_t>(d)] * h;
        const auto near = solid.nearest(x);
        if (std::abs(near.distance) <= 0.5 * h) points.push_back(x - near.distance * near.normal);
      }
  return points;
}

template <int Dim>
RigidCollisions<Dim>::RigidCollisions(const Model<Dim>& model) : model_(model) {
  for (const RigidBody<Dim>& body : model.rigid_bodies)
    points_.push_back(is_free(body) ? surface_points(*body.solid, cuts_of(Dim))
                                    : std::vector<Vec<Dim>>{});
}

template <int Dim>
void RigidCollisions<Dim>::add(const std::vector<Placement<Dim>>& at, double dt,
                               std::vector<Reaction>& reactions) const {
  for (std::size_t k = 0; k < at.size(); ++k)
    for (std::size_t j = 0; j < at.size(); ++j)
      if (j != k && !points_[k].empty()) add_pair(k, j, at, dt, reactions);
}

template <int Dim>
void RigidCollisions<Dim>::add_pair(std::size_t free, std::size_t other,
                                    const std::vector<Placement<Dim>>& at, double dt,
                                    std::vector<Reaction>& reactions) const {
  const RigidBody<Dim>&body = model_.rigid_bodies[free], &wall = model_.rigid_bodies[other];
  const Placement<Dim>&here = at[free], &there = at[other];
  const double mass = is_free(wall) ? body.mass * wall.mass / (body.mass + wall.mass) : body.mass;
  const double omega = 1 / (steps_of_contact * dt);
  const double friction = std::max(body.friction, wall.friction);
  for (const Vec<Dim>& point : points_[free]) {
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
    add_force<Dim>(reactions[free], force, x - here.origin);
    add_force<Dim>(reactions[other], -force, x - there.origin);
  }
}

template class RigidCollisions<2>;
template class RigidCollisions<3>;
template std::vector<Vec<2>> surface_points<2>(const Solid<2>&, int);
template std::vector<Vec<3>> surface_points<3>(const Solid<3>&, int);

}  // namespace lahar
