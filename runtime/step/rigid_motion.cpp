#include "runtime/step/rigid_motion.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>

#include "io/base/text.h"
#include "physics/model/body_overlap.h"
#include "physics/particles/loads.h"
#include "runtime/step/rigid_impulses.h"

namespace lahar {

namespace {

template <int Dim>
using Axes = Eigen::Matrix<double, Dim, Dim>;

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

/// The spin [rad/s] of a body with an angular momentum L [kg m^2 / s], about the axes that are
/// free: w = I^-1 L. What holds the others has its part of L.
inline Vec<3> spin_with(const RigidBody<3>& body, const Eigen::Matrix3d& axes,
                        const Vec<3>& momentum) {
  Eigen::Matrix3d inertia = axes * body.inertia * axes.transpose();
  Vec<3> free = momentum;
  for (int k = 0; k < 3; ++k) {
    if (body.held_spin[k] == 0) continue;
    inertia.row(k).setZero();
    inertia.col(k).setZero();
    inertia(k, k) = 1;
    free[k] = 0;
  }
  return inertia.inverse() * free;
}

/// What gives a body its spin from its angular momentum [1/(kg m^2)]: none about axes that are
/// held.
template <int Dim>
Eigen::Matrix3d inverse_inertia(const RigidBody<Dim>& body, const Axes<Dim>& axes) {
  Eigen::Matrix3d inverse = Eigen::Matrix3d::Zero();
  if constexpr (Dim == 2)
    inverse(2, 2) = (1 - body.held_spin[2]) / body.inertia(2, 2);
  else
    for (int k = 0; k < 3; ++k) inverse.col(k) = spin_with(body, axes, Vec<3>::Unit(k));
  return inverse;
}

/// Turn a body over dt by a torque. In three dimensions the angular momentum changes by dt T, and
/// the body turns with the spin in the middle of the step: without a torque it keeps the momentum,
/// and its energy to the second order of dt.
template <int Dim>
void turn(const RigidBody<Dim>& body, Placement<Dim>& at, const Vec<3>& torque, double dt) {
  if constexpr (Dim == 2) {
    at.spin[2] += dt * torque[2] / body.inertia(2, 2) * (1 - body.held_spin[2]);
    const Axes<2> turned = rotation_by<2>(dt * Vec<3>(at.spin)) * at.axes;
    at.axes = orthonormal<2>(turned);
  } else {
    const Eigen::Matrix3d axes = at.axes;
    const Vec<3> spin = at.spin, momentum = axes * (body.inertia * (axes.transpose() * spin));
    const Vec<3> middle =
        spin_with(body, rotation_by<3>(0.5 * dt * spin) * axes, momentum + 0.5 * dt * torque);
    at.axes = orthonormal<3>(rotation_by<3>(dt * middle) * axes);
    at.spin = spin_with(body, at.axes, momentum + dt * torque);
  }
}

// Vectors and axes of states have three components in two dimensions, too.
template <int Dim>
Vec<Dim> components(const std::array<double, 3>& from) {
  Vec<Dim> to;
  for (int d = 0; d < Dim; ++d) to[d] = from[static_cast<std::size_t>(d)];
  return to;
}
template <int Dim>
void put(const Vec<Dim>& from, std::array<double, 3>& to) {
  for (int d = 0; d < Dim; ++d) to[static_cast<std::size_t>(d)] = from[d];
}
template <int Dim>
Axes<Dim> axes_of(const std::array<double, 9>& from) {
  Axes<Dim> to;
  for (int d = 0; d < Dim; ++d)
    for (int e = 0; e < Dim; ++e) to(d, e) = from[static_cast<std::size_t>(3 * d + e)];
  return to;
}
template <int Dim>
void put_axes(const Axes<Dim>& from, std::array<double, 9>& to) {
  for (int d = 0; d < Dim; ++d)
    for (int e = 0; e < Dim; ++e) to[static_cast<std::size_t>(3 * d + e)] = from(d, e);
}

template <int Dim>
Placement<Dim> placement_of(const RigidBodyState& state) {
  Placement<Dim> at;
  at.origin = components<Dim>(state.origin);
  at.axes = axes_of<Dim>(state.axes);
  at.velocity = components<Dim>(state.velocity);
  for (int d = 0; d < 3; ++d) at.spin[d] = state.spin[static_cast<std::size_t>(d)];
  return at;
}

template <int Dim>
Placement<Dim> moved(const RigidBody<Dim>& body, Placement<Dim> at, const Reaction& on,
                     const Vec<Dim>& gravity, double dt) {
  Vec<Dim> force;
  for (int d = 0; d < Dim; ++d) force[d] = on.force[static_cast<std::size_t>(d)];
  const Vec<Dim> free = Vec<Dim>::Ones() - body.held;
  at.velocity += dt * (force / body.mass + gravity).cwiseProduct(free);
  const Vec<3> torque(on.torque[0], on.torque[1], on.torque[2]);
  at.origin += dt * at.velocity;
  turn(body, at, torque, dt);
  return at;
}

}  // namespace

template <int Dim>
void RigidMotion<Dim>::begin(Step first, double time) {
  if (!any_free()) return;
  collisions_.begin();
  std::vector<Placement<Dim>> at;
  for (const RigidBody<Dim>& body : model_.rigid_bodies) {
    Placement<Dim> place;
    place.origin = body.centre + body.moved;
    place.axes = body.turned;
    // A stage may hold what was moving.
    place.velocity = body.velocity.cwiseProduct(Vec<Dim>::Ones() - body.held);
    place.spin = body.spin.cwiseProduct(Vec<3>::Ones() - body.held_spin);
    const bool is_free = body.motion == RigidBody<Dim>::Motion::free;
    at.push_back(is_free ? place : placement_at(body, model_.functions, time));
  }
  after_[first + max_lead + 1] = at;  // the slot of the step before the first
  reactions_[first] = taken_;
  reactions_[first].resize(at.size());
}

template <int Dim>
void RigidMotion<Dim>::need_room(const RigidBody<Dim>& body, const PatchSet<Dim>& patches,
                                 const Communicator& ranks) const {
  using Overlap = BodyOverlap<Dim>;
  Overlap own, all;
  for (int i = 0; i < patches.size(); ++i) {
    const Patch<Dim>& patch = patches[i];
    patch.for_each_particle([&](Local p) {
      Vec<Dim> x;
      for (int d = 0; d < Dim; ++d) x[d] = patch.particles.row(Column::x, d)[p];
      const double depth = -body.solid->nearest(x).distance;
      if (depth > Overlap::least_share * patch.smallest_cell) own.add(x, depth);
    });
  }
  for (const Overlap& of_rank : ranks.gather_all<Overlap>(std::span(&own, 1))) all.add(of_rank);
  if (all.count == 0) return;
  throw InputError({{.where = "/rigid_bodies",
                     .message = fmt::format("{} particles are inside of the rigid body '{}' when "
                                            "the stage begins, up to {:.3g} m deep at ({:.6g})",
                                            format_count(all.count), body.name, all.depth,
                                            fmt::join(all.x, ", ")),
                     .hint = "\"remove\" the particles there, or bring the body from outside"}});
}

template <int Dim>
void RigidMotion<Dim>::take_over(const std::vector<RigidBodyState>& bodies,
                                 const PatchSet<Dim>& patches, const Communicator& ranks) {
  taken_.clear();
  for (RigidBody<Dim>& body : model_.rigid_bodies) {
    taken_.emplace_back();
    const auto before = std::find_if(bodies.begin(), bodies.end(),
                                     [&](const auto& other) { return other.name == body.name; });
    if (before == bodies.end()) {
      need_room(body, patches, ranks);
      continue;
    }
    const Placement<Dim> at = placement_of<Dim>(*before);
    body.moved = Vec<Dim>(at.origin) - body.centre;
    body.turned = at.axes;
    taken_.back() = {before->force, before->torque};
    if (body.motion != RigidBody<Dim>::Motion::free) continue;
    body.velocity = at.velocity;
    body.spin = at.spin;
  }
}

template <int Dim>
void RigidMotion<Dim>::resume(Step step, double time, const std::vector<RigidBodyState>& bodies) {
  auto& own = model_.rigid_bodies;
  if (bodies.size() != own.size() && (any_free() || !bodies.empty()))
    throw InputError("the state has other rigid bodies than the scenario");
  for (std::size_t k = 0; k < bodies.size(); ++k) {
    own[k].moved = components<Dim>(bodies[k].moved);
    own[k].turned = axes_of<Dim>(bodies[k].turned);
  }
  begin(step, time);
  if (!any_free()) return;
  for (std::size_t k = 0; k < own.size(); ++k) {
    after_[step + max_lead + 1][k] = placement_of<Dim>(bodies[k]);
    reactions_[step][k] = {bodies[k].force, bodies[k].torque};
  }
}

template <int Dim>
Placement<Dim> RigidMotion<Dim>::placement(std::size_t body, Step slot, double time) const {
  return any_free() ? after_[slot][body]
                    : placement_at(model_.rigid_bodies[body], model_.functions, time);
}

template <int Dim>
std::vector<RigidBodyState> RigidMotion<Dim>::state(Step step, double time) const {
  std::vector<RigidBodyState> states;
  for (std::size_t k = 0; k < model_.rigid_bodies.size(); ++k) {
    const RigidBody<Dim>& body = model_.rigid_bodies[k];
    const Placement<Dim> at = placement(k, step + max_lead + 1, time);
    RigidBodyState& state = states.emplace_back();
    state.name = body.name;
    put<Dim>(at.origin, state.origin);
    put<Dim>(at.velocity, state.velocity);
    put<Dim>(body.moved, state.moved);
    put_axes<Dim>(at.axes, state.axes);
    put_axes<Dim>(body.turned, state.turned);
    for (int d = 0; d < 3; ++d) state.spin[static_cast<std::size_t>(d)] = at.spin[d];
    if (!any_free()) continue;
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
  const auto after = [&](const std::vector<Placement<Dim>>& from) {
    std::vector<Placement<Dim>> to;
    for (std::size_t k = 0; k < from.size(); ++k) {
      const RigidBody<Dim>& body = model_.rigid_bodies[k];
      to.push_back(body.motion == RigidBody<Dim>::Motion::free
                       ? moved(body, from[k], reactions_[step][k], gravity, dt)
                       : placement_at(body, model_.functions, time + dt, dt));
    }
    return to;
  };
  const std::vector<Placement<Dim>> apart = after(now);
  const auto encounters = collisions_.encounters(now, apart, dt);
  if (encounters.empty()) {
    now = apart;
    return;
  }
  const std::vector<StruckBody> out = collide(encounters, apart, dt, now);
  now = after(now);
  for (std::size_t k = 0; k < now.size(); ++k) {
    if (model_.rigid_bodies[k].motion != RigidBody<Dim>::Motion::free) continue;
    now[k].origin += dt * out[k].velocity.template head<Dim>();
    if (out[k].spin.isZero(0)) continue;
    const Axes<Dim> turned = rotation_by<Dim>(dt * out[k].spin) * now[k].axes;
    now[k].axes = orthonormal<Dim>(turned);
  }
}

/// What impulses at the beginning of a step of `dt` [s] do to bodies that come to `apart` without
/// them: the velocities of those that are `now`. Returns the velocities with which those that are
/// inside of others are brought out in this step.
template <int Dim>
std::vector<StruckBody> RigidMotion<Dim>::collide(const std::vector<Encounter<Dim>>& encounters,
                                                  const std::vector<Placement<Dim>>& apart,
                                                  double dt,
                                                  std::vector<Placement<Dim>>& now) const {
  constexpr double rounding = 1e-10;  // of speeds
  constexpr double out_in_step = 0.2, out_of_spacing = 0.1;
  std::vector<StruckBody> before, struck, out;
  for (std::size_t k = 0; k < now.size(); ++k) {
    const RigidBody<Dim>& body = model_.rigid_bodies[k];
    StruckBody at;
    if (body.motion == RigidBody<Dim>::Motion::free) {
      at.inverse_mass.template head<Dim>() = (Vec<Dim>::Ones() - body.held) / body.mass;
      at.inverse_inertia = inverse_inertia<Dim>(body, now[k].axes);
    }
    out.push_back(at);
    at.velocity.template head<Dim>() = now[k].velocity;
    at.spin = now[k].spin;
    before.push_back(at);
    at.velocity.template head<Dim>() = apart[k].velocity;
    at.spin = apart[k].spin;
    struck.push_back(at);
    if (body.motion != RigidBody<Dim>::Motion::prescribed) continue;
    // Its mean velocity in the step brings it to where it is then.
    at.velocity.template head<Dim>() = (apart[k].origin - now[k].origin) / dt;
    before.back() = struck.back() = at;
  }
  for (auto* const all : {&before, &struck, &out}) all->resize(now.size() + model_.sides.size());
  double fastest = 0, deepest = 0;
  std::vector<Touch> touches, inside;
  std::vector<double> jumps;  // [m/s] with which bodies part, by touch; 0: they need not
  for (const Encounter<Dim>& encounter : encounters) {
    const RigidBody<Dim>&body = collisions_.body(encounter.body),
          &other = collisions_.body(encounter.other);
    Touch touch{.body = encounter.body, .other = encounter.other};
    touch.arm.template head<Dim>() = encounter.x - now[encounter.body].origin;
    if (encounter.other < now.size())
      touch.other_arm.template head<Dim>() = encounter.x - now[encounter.other].origin;
    touch.normal.template head<Dim>() = encounter.normal;
    touch.friction = std::max(body.friction, other.friction);
    const auto relative = [&](const std::vector<StruckBody>& at) {
      return Vec<3>(at[touch.body].velocity_at(touch.arm) -
                    at[touch.other].velocity_at(touch.other_arm));
    };
    const Vec<3> first = relative(before), last = relative(struck);
    fastest = std::max({fastest, first.norm(), last.norm()});
    const double approach = -first.dot(touch.normal), by_forces = (last - first).dot(touch.normal);
    // What rests on another body does not jump: forces brought its speed in the last two steps.
    const bool strikes = approach > 2 * std::abs(by_forces);
    const bool meets = encounter.gap + dt * last.dot(touch.normal) < 0;
    jumps.push_back(strikes && meets ? std::max(body.restitution, other.restitution) * approach
                                     : 0);
    touch.least = -std::max(0.0, encounter.gap) / dt;
    touches.push_back(touch);
    if (encounter.gap < 0) {
      const double furthest = out_of_spacing * collisions_.spacing(encounter.body);
      touch.least = std::min(-out_in_step * encounter.gap, furthest) / dt;
      deepest = std::max(deepest, touch.least);
    }
    touch.friction = 0;
    inside.push_back(touch);
  }
  // Restitution by speeds may make energy where friction turns the slip around: then it is less.
  const auto struck_with = [&](double share) {
    std::vector<Touch> all = touches;
    for (std::size_t k = 0; k < all.size(); ++k)
      if (jumps[k] > 0) all[k].least = share * jumps[k];
    std::vector<StruckBody> bodies = struck;
    const bool makes_energy = strike(bodies, all, Dim, rounding * fastest).makes_energy();
    return std::pair(std::move(bodies), makes_energy);
  };
  auto result = struck_with(1);
  if (result.second && std::ranges::any_of(jumps, [](double jump) { return jump > 0; })) {
    constexpr double finest = 1e-3;
    result = struck_with(0);
    double most = 0;
    for (double half = 0.5; half > finest; half /= 2)
      if (auto more = struck_with(most + half); !more.second) {
        most += half;
        result = std::move(more);
      }
  }
  struck = std::move(result.first);
  if (deepest > 0) strike(out, inside, Dim, 1e-6 * deepest);
  for (std::size_t k = 0; k < now.size(); ++k) {
    if (model_.rigid_bodies[k].motion != RigidBody<Dim>::Motion::free) continue;
    const Vec<3> jump = struck[k].velocity;
    now[k].velocity += jump.template head<Dim>() - Vec<Dim>(apart[k].velocity);
    now[k].spin += struck[k].spin - Vec<3>(apart[k].spin);
  }
  return out;
}

template <int Dim>
RestOfBodies RigidMotion<Dim>::rest(Step step, double time, double dt) const {
  RestOfBodies rest;
  const double gravity =
      (load_factor(model_, model_.gravity_function, time) * model_.gravity).norm();
  for (std::size_t k = 0; k < model_.rigid_bodies.size(); ++k) {
    const RigidBody<Dim>& body = model_.rigid_bodies[k];
    const Placement<Dim> at = placement(k, step + max_lead + 1, time);
    const Vec<3> spin = at.spin;
    if (body.motion != RigidBody<Dim>::Motion::free) {
      rest.moved |= !at.velocity.isZero(0) || !spin.isZero(0);
      continue;
    }
    const Vec<Dim> before = after_[step + max_lead][k].velocity;
    Eigen::Matrix3d inertia = body.inertia;
    if constexpr (Dim == 3) inertia = at.axes * inertia * at.axes.transpose();
    rest.kinetic += 0.5 * (body.mass * at.velocity.squaredNorm() + spin.dot(inertia * spin));
    rest.unbalanced += body.mass * (at.velocity - before).norm() / dt;
    rest.loads += body.mass * gravity;
  }
  return rest;
}

template <int Dim>
void RigidMotion<Dim>::describe(Step step, double time, HistoryRow& row) const {
  for (std::size_t k = 0; k < row.bodies.size(); ++k) {
    const RigidBody<Dim>& body = model_.rigid_bodies[k];
    const Placement<Dim> at = placement(k, step, time);
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
