// Every copy of a node runs this very code, so that all are equal to the last bit.
#include "physics/boundary/constrained_node.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "physics/base/nodal_limits.h"

namespace lahar {

namespace {

/// Acceleration `a` with friction, in the wall's axes; `v` is the velocity before the step.
template <int Dim>
Vec<Dim> with_friction(const ConstrainedNode<Dim>& wall, const Vec<Dim>& v, const Vec<Dim>& a,
                       double dt, bool as_cbgeo) {
  const double pressed = a[wall.normal];
  if (!(pressed * wall.outward > 0.0)) return a;
  const double most = wall.friction * std::abs(pressed);
  Vec<Dim> v_t = v, a_t = a;
  v_t[wall.normal] = a_t[wall.normal] = 0.0;
  if (!v_t.isZero(0.0)) {
    const Vec<Dim> next = v_t + dt * a_t;
    const double speed = next.norm();
    if (speed <= dt * most)
      a_t = -v_t / dt;
    else
      a_t -= most * (next / speed);
  } else {
    const double pull = a_t.norm();
    if (pull <= most)
      a_t.setZero();
    else
      a_t -= most * (a_t / (Dim == 3 && as_cbgeo ? pull - most : pull));
  }
  a_t[wall.normal] = pressed;
  return a_t;
}

/// Speed [m/s] at which a velocity, in the wall's axes, moves into the one-sided wall of an axis.
template <int Dim>
double speed_into(const ConstrainedNode<Dim>& wall, const Vec<Dim>& v, std::size_t axis) {
  return wall.pushes[axis] * (v[static_cast<int>(axis)] - wall.velocity[axis]);
}

/// One-sided walls on `v`, the velocity at the end of the step without them, in the wall's axes.
template <int Dim>
void push(const ConstrainedNode<Dim>& wall, Vec<Dim>& v, WallPush<Dim>* done) {
  std::array<double, Dim> pressed{};
  for (std::size_t k = 0; k < Dim; ++k) {
    if (wall.pushes[k] == 0) continue;
    pressed[k] = std::max(0.0, speed_into<Dim>(wall, v, k));
    if (pressed[k] > 0) v[static_cast<int>(k)] = wall.velocity[k];
  }
  for (std::size_t k = 0; k < Dim; ++k) {
    if (!(pressed[k] > 0)) continue;
    if (done) done->pressed[k] = true;
    Vec<Dim> slip = Vec<Dim>::Zero();
    for (std::size_t t = 0; t < Dim; ++t)
      if (t != k && !wall.fixed[t] && !(pressed[t] > 0))
        slip[static_cast<int>(t)] = v[static_cast<int>(t)];
    const double speed = slip.norm(), most = wall.rubs[k] * pressed[k];
    if (speed <= most)
      v -= slip;
    else
      v -= most / speed * slip;
    if (done) done->stuck = done->stuck || (speed <= most && wall.rubs[k] > 0);
  }
}

/// The reference code's threshold, for velocities and accelerations alike.
template <int Dim>
void store_flushed(const Vec<Dim>& values, double* to) {
  for (int d = 0; d < Dim; ++d)
    to[d] = std::abs(values[d]) < least_nodal_velocity ? 0.0 : values[d];
}

}  // namespace

template <int Dim>
void prescribe_velocity(const ConstrainedNode<Dim>& wall, double* velocity) {
  Eigen::Map<Vec<Dim>> global(velocity);
  Vec<Dim> v = wall.axes.transpose() * global;
  bool any = false;
  for (std::size_t d = 0; d < Dim; ++d)
    if (wall.fixed[d]) v[static_cast<int>(d)] = wall.velocity[d], any = true;
  if (any) global = wall.axes * v;  // else not even rounding changes it
}

template <int Dim>
Vec<Dim> stop_at_wall(const ConstrainedNode<Dim>& wall, double* velocity) {
  Eigen::Map<Vec<Dim>> global(velocity);
  const Vec<Dim> v = wall.axes.transpose() * global;
  Vec<Dim> taken = Vec<Dim>::Zero();
  for (std::size_t k = 0; k < Dim; ++k)
    if (wall.pushes[k] != 0 && speed_into<Dim>(wall, v, k) > 0)
      taken[static_cast<int>(k)] = v[static_cast<int>(k)] - wall.velocity[k];
  if (taken.isZero(0.0)) return taken;
  taken = wall.axes * taken;
  global -= taken;
  return taken;
}

template <int Dim>
double hold_velocity(const ConstrainedNode<Dim>& wall, double dt, double* velocity,
                     double* acceleration) {
  Eigen::Map<Vec<Dim>> global_v(velocity), global_a(acceleration);
  Vec<Dim> v = wall.axes.transpose() * global_v, a = wall.axes.transpose() * global_a;
  double work = 0;
  for (std::size_t k = 0; k < Dim; ++k) {
    if (!wall.fixed[k]) continue;
    const int d = static_cast<int>(k);
    work += (wall.velocity[k] - v[d]) * wall.velocity[k];
    v[d] = wall.velocity[k];
    a[d] = 0.0;
  }
  for (std::size_t k = 0; k < Dim; ++k) {
    const double into = wall.pushes[k] != 0 ? speed_into<Dim>(wall, v, k) : 0.0;
    if (!(into > 0)) continue;
    const int d = static_cast<int>(k);
    work -= wall.pushes[k] * into * wall.velocity[k];
    v[d] = wall.velocity[k];
    a[d] -= wall.pushes[k] * into / dt;
  }
  store_flushed<Dim>(wall.axes * v, velocity);
  store_flushed<Dim>(wall.axes * a, acceleration);
  return work;
}

template <int Dim>
WallWork advance_at_wall(const ConstrainedNode<Dim>& wall, double dt, bool as_cbgeo,
                         double* velocity, double* acceleration, WallPush<Dim>* done) {
  Eigen::Map<Vec<Dim>> global_v(velocity), global_a(acceleration);
  const Vec<Dim> before = wall.axes.transpose() * global_v;
  const Vec<Dim> free = wall.axes.transpose() * global_a;
  Vec<Dim> a = wall.normal < 0 ? free : with_friction<Dim>(wall, before, free, dt, as_cbgeo);
  const Vec<Dim> rubbed = free - a;
  Vec<Dim> accelerated = Vec<Dim>::Zero();
  for (std::size_t k = 0; k < Dim; ++k) {
    if (!wall.accelerated[k]) continue;
    const int d = static_cast<int>(k);
    accelerated[d] = wall.acceleration[k] - a[d];
    a[d] = wall.acceleration[k];
  }
  Vec<Dim> v = before + dt * a;
  const Vec<Dim> alone = v;
  push<Dim>(wall, v, done);
  const Vec<Dim> pushed = v - alone;
  a += pushed / dt;
  WallWork work;
  for (std::size_t k = 0; k < Dim; ++k) {
    if (!wall.fixed[k]) continue;
    const int d = static_cast<int>(k);
    work.reaction += (wall.velocity[k] - v[d]) * wall.velocity[k];
    v[d] = wall.velocity[k];
    a[d] = 0.0;
  }
  const Vec<Dim> mean = v - 0.5 * dt * a;  // velocity of the step
  // A moving wall pushes along its own velocity; the rest of its work is lost.
  Vec<Dim> walls = Vec<Dim>::Zero(), slowed = pushed;
  for (std::size_t k = 0; k < Dim; ++k)
    if (wall.pushes[k] != 0) {
      walls[static_cast<int>(k)] = wall.velocity[k];
      slowed[static_cast<int>(k)] = 0.0;
    }
  work.reaction += pushed.dot(walls);
  work.taken = dt * rubbed.dot(mean) - pushed.dot(mean - walls);
  work.friction = dt * rubbed.dot(mean) - slowed.dot(mean);
  work.reaction += dt * accelerated.dot(mean);
  store_flushed<Dim>(wall.axes * v, velocity);
  store_flushed<Dim>(wall.axes * a, acceleration);
  if (done) {
    done->by = {wall.axes * before, wall.axes * pushed, global_v};
    done->rubbed = wall.axes * slowed;
  }
  return work;
}

template <int Dim>
void hold_at_walls(const ConstrainedNode<Dim>& wall, const WallPush<Dim>& push, double* velocity) {
  Eigen::Map<Vec<Dim>> global(velocity);
  Vec<Dim> v = wall.axes.transpose() * global;
  for (std::size_t k = 0; k < Dim; ++k) {
    const int d = static_cast<int>(k);
    if (push.pressed[k])
      v[d] = wall.velocity[k];
    else if (push.stuck && !wall.fixed[k] && wall.pushes[k] == 0)
      v[d] = 0.0;
  }
  global = wall.axes * v;
}

template void prescribe_velocity(const ConstrainedNode<2>&, double*);
template void prescribe_velocity(const ConstrainedNode<3>&, double*);
template Vec<2> stop_at_wall(const ConstrainedNode<2>&, double*);
template Vec<3> stop_at_wall(const ConstrainedNode<3>&, double*);
template double hold_velocity(const ConstrainedNode<2>&, double, double*, double*);
template double hold_velocity(const ConstrainedNode<3>&, double, double*, double*);
template WallWork advance_at_wall(const ConstrainedNode<2>&, double, bool, double*, double*,
                                  WallPush<2>*);
template WallWork advance_at_wall(const ConstrainedNode<3>&, double, bool, double*, double*,
                                  WallPush<3>*);
template void hold_at_walls(const ConstrainedNode<2>&, const WallPush<2>&, double*);
template void hold_at_walls(const ConstrainedNode<3>&, const WallPush<3>&, double*);

}  // namespace lahar
