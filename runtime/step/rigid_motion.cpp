#include "runtime/step/rigid_motion.h"

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "physics/particles/loads.h"

namespace lahar {

namespace {

template <int Dim>
using Axes = Eigen::Matrix<double, Dim, Dim>;

/// Parts of a step in which bodies may touch each other: the step of particles is none of theirs.
constexpr int parts_of_contact = 16;

/// Columns of length one at right angles, next to those of a rotation with rounding errors.
template <int Dim>
Axes<Dim> orthonormal(Axes<Dim> axes) {
  for (int k = 0; k < Dim; ++k) {
    for (int j = 0; j < k; ++j) axes.col(k) -= axes.col(j).dot(axes.col(k)) * axes.col(j);
    axes.col(k).normalize();
  }
  return axes;
}

/// The rotation vector of axes [rad].
template <int Dim>
Vec<3> rotation_of(const Axes<Dim>& axes) {
  if constexpr (Dim == 2) {
    return Vec<3>(0, 0, std::atan2(axes(1, 0), axes(0, 0)));
  } else {
    const Eigen::AngleAxisd turn(axes);
    return turn.angle() * turn.axis();
  }
}

/// Change of the spin [rad/s^2] by a torque.
template <int Dim>
Vec<3> angular_acceleration(const RigidBody<Dim>& body, const Placement<Dim>& at,
                            const Vec<3>& torque) {
  if constexpr (Dim == 2) {
    return Vec<3>(0, 0, torque[2] / body.inertia(2, 2));
  } else {
    const Eigen::Matrix3d inertia = at.axes * body.inertia * at.axes.transpose();
    const Vec<3> spin = at.spin;
    return inertia.inverse() * (torque - spin.cross(Vec<3>(inertia * spin)));
  }
}

template <int Dim>
Placement<Dim> moved(const RigidBody<Dim>& body, Placement<Dim> at, const Reaction& on,
                     const Vec<Dim>& gravity, double dt) {
  Vec<Dim> force;
  for (int d = 0; d < Dim; ++d) force[d] = on.force[static_cast<std::size_t>(d)];
  const Vec<Dim> free = Vec<Dim>::Ones() - body.held;
  at.velocity += dt * (force / body.mass + gravity).cwiseProduct(free);
  const Vec<3> torque(on.torque[0], on.torque[1], on.torque[2]);
  at.spin +=
      dt * angular_acceleration(body, at, torque).cwiseProduct(Vec<3>::Ones() - body.held_spin);
  at.origin += dt * at.velocity;
  const Axes<Dim> turned = rotation_by<Dim>(dt * at.spin) * at.axes;
  at.axes = orthonormal<Dim>(turned);
  return at;
}

}  // namespace

template <int Dim>
void RigidMotion<Dim>::begin(Step first) {
  if (!any_free()) return;
  std::vector<Placement<Dim>> at;
  for (const RigidBody<Dim>& body : model_.rigid_bodies) {
    Placement<Dim> place;
    place.origin = body.centre;
    place.velocity = body.velocity;
    place.spin = body.spin;
    at.push_back(place);
  }
  after_[first + max_lead + 1] = at;  // the slot of the step before the first
  reactions_[first].assign(at.size(), {});
}

template <int Dim>
void RigidMotion<Dim>::resume(Step step, const std::vector<RigidBodyState>& bodies) {
  begin(step);
  if (!any_free()) return;
  auto& at = after_[step + max_lead + 1];
  if (bodies.size() != at.size())
    throw InputError("the state has other rigid bodies than the scenario");
  for (std::size_t k = 0; k < at.size(); ++k) {
    for (int d = 0; d < Dim; ++d) {
      const auto i = static_cast<std::size_t>(d);
      at[k].origin[d] = bodies[k].origin[i];
      at[k].velocity[d] = bodies[k].velocity[i];
      for (int e = 0; e < Dim; ++e)
        at[k].axes(d, e) = bodies[k].axes[3 * i + static_cast<std::size_t>(e)];
    }
    for (int d = 0; d < 3; ++d) at[k].spin[d] = bodies[k].spin[static_cast<std::size_t>(d)];
    reactions_[step][k] = {bodies[k].force, bodies[k].torque};
  }
}

template <int Dim>
std::vector<RigidBodyState> RigidMotion<Dim>::state(Step step) const {
  std::vector<RigidBodyState> states;
  if (!any_free()) return states;
  const auto& at = after_[step + max_lead + 1];
  for (std::size_t k = 0; k < at.size(); ++k) {
    RigidBodyState& state = states.emplace_back();
    for (int d = 0; d < Dim; ++d) {
      const auto i = static_cast<std::size_t>(d);
      state.origin[i] = at[k].origin[d];
      state.velocity[i] = at[k].velocity[d];
      for (int e = 0; e < Dim; ++e)
        state.axes[3 * i + static_cast<std::size_t>(e)] = at[k].axes(d, e);
    }
    for (int d = 0; d < 3; ++d) state.spin[static_cast<std::size_t>(d)] = at[k].spin[d];
    state.force = reactions_[step][k].force;
    state.torque = reactions_[step][k].torque;
  }
  return states;
}

template <int Dim>
std::span<const Index> RigidMotion<Dim>::sums(const PatchSet<Dim>& patches) {
  const std::size_t bodies = model_.rigid_bodies.size();
  std::vector<ExactSum> sums(n_sums * bodies);
  for (int p = 0; p < patches.size(); ++p) {
    const auto& reactions = patches[p].reactions;
    for (std::size_t k = 0; k < reactions.size(); ++k)
      for (std::size_t d = 0; d < 3; ++d) {
        if (reactions[k].force[d] != 0) sums[n_sums * k + d] += reactions[k].force[d];
        if (reactions[k].torque[d] != 0) sums[n_sums * k + 3 + d] += reactions[k].torque[d];
      }
  }
  elements_.clear();
  for (const ExactSum& sum : sums)
    elements_.insert(elements_.end(), sum.elements().begin(), sum.elements().end());
  return elements_;
}

template <int Dim>
void RigidMotion<Dim>::take(Step step, std::span<const Index> elements) {
  auto& reactions = reactions_[step];
  reactions.assign(model_.rigid_bodies.size(), {});
  const auto value = [&](std::size_t i) {
    return ExactSum(elements.subspan(i * ExactSum::size).template first<ExactSum::size>()).value();
  };
  for (std::size_t k = 0; k < reactions.size(); ++k)
    for (std::size_t d = 0; d < 3; ++d) {
      reactions[k].force[d] = value(n_sums * k + d);
      reactions[k].torque[d] = value(n_sums * k + 3 + d);
    }
}

template <int Dim>
void RigidMotion<Dim>::move(Step step, double time, double dt) {
  if (!any_free()) return;
  auto& now = after_[step];
  now = after_[step + max_lead + 1];
  const Vec<Dim> gravity = load_factor(model_, model_.gravity_function, time) * model_.gravity;
  const auto near = collisions_.near(now, gravity.norm(), dt);
  const int parts = near.empty() ? 1 : parts_of_contact;
  for (int part = 1; part <= parts; ++part) {
    std::vector<Reaction> forces = reactions_[step];
    collisions_.add(near, now, dt / parts, forces);
    for (std::size_t k = 0; k < now.size(); ++k) {
      const RigidBody<Dim>& body = model_.rigid_bodies[k];
      now[k] = body.motion == RigidBody<Dim>::Motion::free
                   ? moved(body, now[k], forces[k], gravity, dt / parts)
                   : placement_at(body, model_.functions, time + part * (dt / parts));
    }
  }
}

template <int Dim>
void RigidMotion<Dim>::describe(Step step, double time, HistoryRow& row) const {
  for (std::size_t k = 0; k < row.bodies.size(); ++k) {
    const RigidBody<Dim>& body = model_.rigid_bodies[k];
    const Placement<Dim> at =
        any_free() ? after_[step][k] : placement_at(body, model_.functions, time);
    RigidBodyRow& to = row.bodies[k];
    to.name = body.name;
    for (int d = 0; d < Dim; ++d) {
      to.place[static_cast<std::size_t>(d)] = at.origin[d];
      to.velocity[static_cast<std::size_t>(d)] = at.velocity[d];
    }
    const Vec<3> rotation = rotation_of<Dim>(at.axes);
    for (int d = 0; d < 3; ++d) {
      to.rotation[static_cast<std::size_t>(d)] = rotation[d];
      to.spin[static_cast<std::size_t>(d)] = at.spin[d];
    }
  }
}

template class RigidMotion<2>;
template class RigidMotion<3>;

}  // namespace lahar
