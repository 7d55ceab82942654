/// \file Nodal kernels. Every patch that holds a node does the same arithmetic in the same order on
/// the same sums, so that all copies of a node are identical.
#include <algorithm>
#include <cmath>
#include <limits>

#include "physics/contact/contact.h"
#include "physics/contact/contact_surface.h"
#include "physics/kernels/driven_nodes.h"
#include "physics/kernels/kernels.h"
#include "physics/kernels/nodal_motion.h"
#include "physics/kernels/timed_velocities.h"
#include "physics/kernels/two_phase.h"
#include "physics/kernels/velocity_transfer.h"
#include "physics/particles/damping_force.h"
#include "physics/particles/loads.h"
#include "physics/particles/node_place.h"
#include "physics/particles/node_sums.h"

namespace lahar {

namespace {

LAHAR_INLINE NodeVector with_component(const NodeVector& v, int component, double value) {
  double values[node_width];
  store(v, values);
  values[component] = value;
  return load<NodeVector>(values);
}

/// The state of nodes exists where there are, or were, particles: most patches of the ring around
/// them never need it.
template <int Dim>
void make_room(Patch<Dim>& patch) {
  const std::size_t size = static_cast<std::size_t>(patch.n_nodes()) * node_width;
  if (patch.velocity.size() >= size) return;
  patch.velocity.assign(size, 0.0);
  patch.acceleration.assign(size, 0.0);
}

/// Ranges of the nodes that are marked as active. Sums exist from the first of them on: most
/// patches around a body never have one.
template <int Dim>
void collect_active_nodes(Patch<Dim>& patch) {
  const auto& shared = patch.topology.shared_node;
  auto& ranges = patch.active_nodes;
  ranges.clear();
  for (Local i = 0; i < patch.n_nodes(); ++i) {
    if (!patch.node_is_active[static_cast<std::size_t>(i)]) continue;
    if (ranges.empty() || ranges.back().end != i) {
      const auto s = std::lower_bound(shared.begin(), shared.end(), i) - shared.begin();
      ranges.push_back({i, i, static_cast<std::size_t>(s)});
    }
    ranges.back().end = i + 1;
  }
  if (ranges.empty()) return;
  for (auto& copies : patch.sums)
    for (NodeArray& sums : copies)
      if (sums.empty()) sums.assign(static_cast<std::size_t>(patch.n_nodes()) * sum_stride, 0.0);
}

template <int Dim>
void mark_nodes(Patch<Dim>& patch, std::size_t cell) {
  const auto mark = [&](std::span<const Local> nodes) {
    for (const Local node : nodes) patch.node_is_active[static_cast<std::size_t>(node)] = 1;
  };
  // The cells of all bodies: contact asks for them all.
  const std::size_t bodies = patch.bodies(), cells = patch.topology.cells.size() / bodies;
  for (std::size_t c = cell % cells; c < cells * bodies; c += cells) {
    if (!patch.topology.corner_nodes.empty()) mark(patch.topology.corner_nodes[c]);
    mark(patch.topology.support(c));
  }
}

}  // namespace

template <int Dim>
void find_active_nodes(Patch<Dim>& patch) {
  const std::vector<char> before = std::move(patch.node_is_active);
  patch.node_is_active.assign(static_cast<std::size_t>(patch.n_nodes()), 0);
  for (std::size_t c = 0; c < patch.first_bin.size(); ++c)
    if (patch.first_bin[c] >= 0) mark_nodes(patch, c);
  for (std::size_t i = 0; i < before.size(); ++i)
    if (before[i] && !patch.node_is_active[i])
      for (auto& copies : patch.sums)
        for (NodeArray& sums : copies) std::fill_n(&sums[i * sum_stride], sum_stride, 0.0);
  patch.cells_to_activate.clear();
  collect_active_nodes(patch);
}

template <int Dim>
void activate_nodes(Patch<Dim>& patch) {
  if (patch.cells_to_activate.empty()) return;
  for (const Local cell : patch.cells_to_activate)
    mark_nodes(patch, static_cast<std::size_t>(cell));
  patch.cells_to_activate.clear();
  collect_active_nodes(patch);
}

template <int Dim>
void meet_bodies(Patch<Dim>& patch, const StepContext<Dim>& step) {
  patch.contact.meetings.clear();
  const SumOverPatches<Dim> near(patch, NodeSum::surface, step.step),
      around(patch, NodeSum::surface_around, step.step);
  const double offset = surface_offset(*step.model);
  std::vector<SurfaceEnds> by_body;
  for (const NodeBetween<Dim>& at : patch.contact.nodes_between) {
    by_body.clear();
    for (Local f = at.node; f < patch.n_nodes(); f += patch.body_nodes)
      by_body.push_back({near.most_at(f), around.most_at(f)});
    add_meetings<Dim>(patch, at, by_body, offset);
  }
}

template <int Dim>
void nodal_velocity(Patch<Dim>& patch, const StepContext<Dim>& step) {
  make_room(patch);
  set_timed_velocities(patch, step);
  take_velocity(patch, step, NodeSum::mass_momentum, patch.velocity);
  prescribe_velocities(patch, patch.velocity, true);
}

namespace {

/// Hold what walls pressed (hold_at_walls()), and count their work anew.
template <int Dim>
void hold_pressed(Patch<Dim>& patch, const StepContext<Dim>& step) {
  const double* own = patch.own_sums(NodeSum::mass_momentum, step.step) + mass_lane;
  for (std::size_t k = 0; k < patch.wall_pushes.size(); ++k) {
    const WallPush<Dim>& push = patch.wall_pushes[k];
    if (!push.any()) continue;
    const ConstrainedNode<Dim>& wall = patch.walls[k];
    double* v = at(patch.velocity, wall.node);
    hold_at_walls(wall, push, v);
    const double m = own[static_cast<std::ptrdiff_t>(wall.node) * sum_stride];
    patch.work.damping += m * push.by.taken_again(push.mapped, Eigen::Map<Vec<Dim>>(v));
    patch.work.friction -= 0.5 * m * push.rubbed.dot(push.mapped - push.by.after);
  }
}

/// Power of nodal forces per mass, `force(node, mass)` [m/s^2], of this patch's share of the mass
/// at the present velocities [W].
template <int Dim, class Force>
double power_of(Patch<Dim>& patch, const StepContext<Dim>& step, Force force) {
  const double* own = patch.own_sums(NodeSum::mass_momentum, step.step) + mass_lane;
  NodeVector power(0.0);
  for (const NodeRange& range : patch.active_nodes)
    for (Local i = range.begin; i < range.end; ++i) {
      const auto v = load<NodeVector>(at(patch.velocity, i));
      const double m = v[mass_lane];
      if (m > patch.least_mass)
        power += own[static_cast<std::ptrdiff_t>(i) * sum_stride] * (force(i, m) * v);
    }
  double sum = 0.0;
  for (int d = 0; d < Dim; ++d) sum += power[d];
  return sum;
}

template <int Dim>
double power_of_point_forces(const Patch<Dim>& patch, const StepContext<Dim>& step) {
  const double* own = patch.own_sums(NodeSum::mass_momentum, step.step) + mass_lane;
  double power = 0.0;
  for (const auto& point : patch.forces) {
    const double* v = at(patch.velocity, point.node);
    if (!(v[mass_lane] > patch.least_mass) || !is_first_body(patch, point.node)) continue;
    power += own[static_cast<std::ptrdiff_t>(point.node) * sum_stride] / v[mass_lane] *
             point.force * load_factor(*step.model, point.function, step.time) * v[point.dir];
  }
  return power;
}

}  // namespace

// With FLIP particles get the energy f dt . (start + mapped) / 2 of a nodal force f (NodeImpulse),
// not what integrate() counted, which has the velocity before the mapping. So it is of forces that
// are given at nodes, of damping forces, and of all of them where a transfer's loss is what nodes
// got and particles did not: strains are taken from the mapped velocities. Energy that particles do
// not have is else counted.
template <int Dim>
void nodal_velocity_again(Patch<Dim>& patch, const StepContext<Dim>& step) {
  if (patch.active_nodes.empty()) return;
  const Analysis& analysis = step.model->analysis;
  const bool damps = analysis.damping > 0.0, transfer = counts_at_nodes(analysis);
  const auto of_all = [&] {
    return power_of(patch, step,
                    [&](Local i, double) { return load<NodeVector>(at(patch.acceleration, i)); });
  };
  const auto of_damping = [&] {
    return power_of(patch, step, [&](Local i, double m) {
      return load<NodeVector>(at(patch.damping, i)) * NodeVector(1.0 / m);
    });
  };
  const double counted = (transfer ? of_all() : 0.0) + (damps ? of_damping() : 0.0);
  double power = 0.0;
  patch.work.external -= 0.5 * step.dt * power_of_point_forces(patch, step);
  take_velocity_again(patch, step, NodeSum::momentum, patch.velocity);
  for (std::size_t k = 0; k < patch.wall_pushes.size(); ++k)
    patch.wall_pushes[k].mapped =
        Eigen::Map<const Vec<Dim>>(at(patch.velocity, patch.walls[k].node));
  if (transfer) power += of_all();
  prescribe_velocities(patch, patch.velocity);
  if (damps) power += of_damping();
  patch.work.damping += 0.5 * step.dt * (power - counted);
  patch.work.external += 0.5 * step.dt * power_of_point_forces(patch, step);
  hold_pressed(patch, step);
  if (patch.bodies() > 1) hold_together(patch, step);
}

template <int Dim>
void nodal_pressure(Patch<Dim>& patch, const StepContext<Dim>& step) {
  for_each_node(patch, SumOverPatches<Dim>(patch, NodeSum::pressure, step.step),
                [&](Local i, const NodeVector&, const NodeVector& sum) {
                  const double m = at(patch.velocity, i)[mass_lane];
                  patch.pressure[static_cast<std::size_t>(i)] =
                      has_velocity(patch, m) ? sum[0] / m : 0.0;
                });
}

namespace {

/// Integrates one node after the other. Work at the nodes over the step is taken with the mean of
/// the velocities before and after it, v - dt a / 2: the kinetic energy of the nodes changes by
/// exactly this work. A node's work is shared among its patches as its mass is: those without
/// particles, which may not get here, have none of it.
template <int Dim>
class Integrator {
 public:
  Integrator(Patch<Dim>& patch, const StepContext<Dim>& step)
      : patch_(patch),
        step_(step),
        gravity_(gravity_in(step)),
        two_phase_(step.model->analysis.two_phase),
        point_(patch.forces.begin()),
        wall_(patch.walls.begin()),
        fixed_(patch.fixed.begin()),
        driven_(patch.driven.begin()),
        next_acting_(next_acting(patch.acting, 0)) {
    for_each_acting_list(patch.acting, [](auto& list) {
      for (auto& at : list) {
        at.action = {};
        at.drag.setZero();
      }
    });
    if (maps_velocities_again(step.model->analysis))
      patch.wall_pushes.assign(patch.walls.size(), WallPush<Dim>());
    if (patch.bodies() > 1) patch.contact.wall_change.assign(patch.walls.size(), Vec<Dim>::Zero());
  }

  /// {v, m} with the prescribed velocities of a wall; nodes in order.
  LAHAR_INLINE NodeVector prescribed_at_wall(Local i, const NodeVector& v) {
    return i < next_wall() ? v : at_wall(i, v);
  }

  /// `old` is {v, m} before the step, `own` this patch's {., m}.
  LAHAR_INLINE void node(Local i, const NodeVector& own, const NodeVector& old, NodeVector force) {
    const double m = old[mass_lane];
    while (point_ != patch_.forces.end() && point_->node < i) ++point_;  // not active
    while (point_ != patch_.forces.end() && point_->node == i) {
      double f[node_width] = {};
      f[point_->dir] = is_first_body(patch_, i) ? point_force(*point_) : 0.0;
      force += load<NodeVector>(f);
      ++point_;
    }
    if (!more_than(m, patch_.least_mass)) {
      store(NodeVector(0.0), at(patch_.acceleration, i));
      store(old, at(patch_.velocity, i));
      return;
    }
    if (i >= next_acting_) force -= against_conditions(i, old);
    force += gravity_ * m;
    if (two_phase_) force += before_damping(patch_, step_, i, old);
    const NodeVector per_mass(1.0 / m), share = own[mass_lane] * per_mass;
    NodeVector against(0.0);
    if (damped()) {
      against = damping(i, old, force);
      store(against, at(patch_.damping, i));
      force -= against;
    }
    if (two_phase_) force += drag_on_skeleton(patch_, step_, i, old, force, gravity_);
    NodeVector a = force * per_mass;
    NodeVector v = with_mass(flushed(old + step_.dt * a, least_nodal_velocity), old);
    if (i >= next_wall()) advance_at_wall(i, own[mass_lane], old, a, v);
    store(a, at(patch_.acceleration, i));
    store(v, at(patch_.velocity, i));
    const NodeVector mean = v - (0.5 * step_.dt) * a;
    weight_work_ += own[mass_lane] * mean;
    damping_work_ += share * against * mean;
  }

  /// Constraints, and the work of everything.
  void finish() {
    for (int d = 0; d < Dim; ++d) {
      patch_.work.external += step_.dt * gravity_[d] * weight_work_[d];
      patch_.work.damping += step_.dt * damping_work_[d];
    }
    Vec<Dim> g;
    for (int d = 0; d < Dim; ++d) g[d] = gravity_[d];
    // Nodal constraints win over what particles prescribe; contact keeps both.
    if (!patch_.driven.empty()) finish_driven_nodes(patch_, step_, g);
    const double* own_mass = patch_.own_sums(NodeSum::mass_momentum, step_.step) + mass_lane;
    for (const auto& fixed : patch_.fixed) {
      double& v = at(patch_.velocity, fixed.node)[fixed.dir];
      double& a = at(patch_.acceleration, fixed.node)[fixed.dir];
      const double own = own_mass[fixed.node * sum_stride];
      const double m = at(patch_.velocity, fixed.node)[mass_lane];
      // A node that is not active has anything as its state.
      if (own != 0.0)
        patch_.work.external += own * (fixed.velocity - v) * fixed.velocity;  // of the reaction
      if (own != 0.0 && more_than(m, patch_.least_mass)) {
        // Weight and damping do their work along the prescribed velocity.
        const double other = step_.dt * (fixed.velocity - (v - 0.5 * step_.dt * a));
        patch_.work.external += own * gravity_[fixed.dir] * other;
        if (damped())
          patch_.work.damping += own / m * at(patch_.damping, fixed.node)[fixed.dir] * other;
      }
      v = fixed.velocity;
      a = 0.0;
    }
    if (patch_.bodies() > 1) apply_contact(patch_, step_, g);
    for (const auto& point : patch_.forces)
      if (const double m = at(patch_.velocity, point.node)[mass_lane];
          more_than(m, patch_.least_mass) && is_first_body(patch_, point.node))
        patch_.work.external += own_mass[point.node * sum_stride] / m * point_force(point) *
                                mean_move(point.node, point.dir);
    for_each_acting_list(patch_.acting, [&](const auto& list) {
      for (const auto& at : list) count_work(at, own_mass[at.node * sum_stride]);
    });
    add_timed_acceleration(patch_, step_);
    if (counts_at_nodes(step_.model->analysis))
      count_transfer(patch_, step_, own_mass, patch_.velocity, patch_.acceleration);
  }

 private:
  using PointForce = typename Patch<Dim>::PointForce;

  bool damped() const { return step_.model->analysis.damping > 0.0; }

  /// The damping force at node i, {v, m}, of what is out of balance there, along directions that
  /// nothing prescribes: it would only change the force that holds them.
  [[gnu::noinline]] NodeVector damping(Local i, const NodeVector& v, NodeVector force) {
    const Analysis& analysis = step_.model->analysis;
    if (two_phase_ && !analysis.explicit_drag)
      force += drag_before_damping(patch_, step_, i, v, force, gravity_);
    double against[node_width];
    if (i >= next_wall() && !analysis.damping_as_cbgeo && is_at_wall(i))
      store(damping_at_wall(i, v, force), against);
    else
      store(damping_force(analysis, step_.dt, v, force), against);
    while (fixed_ != patch_.fixed.end() && fixed_->node < i) ++fixed_;  // not active
    for (; fixed_ != patch_.fixed.end() && fixed_->node == i; ++fixed_) against[fixed_->dir] = 0.0;
    while (driven_ != patch_.driven.end() && driven_->node < i) ++driven_;
    if (driven_ != patch_.driven.end() && driven_->node == i)
      for (std::size_t d = 0; d < Dim; ++d)
        if (driven_->driven[d]) against[d] = 0.0;
    return load<NodeVector>(against);
  }

  /// The same at the present wall, by its axes: the wall's reaction and friction are part of what
  /// is in balance. Else damping would hold what friction does not.
  NodeVector damping_at_wall(Local i, const NodeVector& v, const NodeVector& force) {
    double velocity[node_width], acceleration[node_width], against[node_width];
    store(v, velocity);
    store(NodeVector(force * NodeVector(1.0 / v[mass_lane])), acceleration);
    WallPush<Dim> push;
    meet_wall(i, velocity, acceleration, &push);
    const auto& axes = wall_->axes;
    const NodeVector net = load<NodeVector>(acceleration) * v[mass_lane];
    store(damping_force(step_.model->analysis, step_.dt, turned(axes.transpose(), v),
                        turned(axes.transpose(), net)),
          against);
    for (std::size_t k = 0; k < Dim; ++k)
      if (wall_->fixed[k] || wall_->accelerated[k] || push.pressed[k]) against[k] = 0.0;
    return turned(axes, load<NodeVector>(against));
  }

  /// `v` by other axes; its mass stays.
  static NodeVector turned(const Eigen::Matrix<double, Dim, Dim>& axes, const NodeVector& v) {
    double values[node_width];
    store(v, values);
    Eigen::Map<Vec<Dim>> vector(values);
    vector = (axes * vector).eval();
    return load<NodeVector>(values);
  }

  double point_force(const PointForce& point) const {
    return point.force * load_factor(*step_.model, point.function, step_.time);
  }

  /// Minus the force of the conditions of node i, {v, m}, if it has any. They act on the first of
  /// the bodies that are there.
  [[gnu::noinline]] NodeVector against_conditions(Local i, const NodeVector& v) {
    double f[node_width] = {};
    if (is_first_body(patch_, i)) {
      const auto lists = acting_at(patch_.acting, i);
      NodeComponents<Dim> all = NodeComponents<Dim>::Zero();
      for_each_acting_list(lists, [&](auto entries) {
        for (auto& at : entries) {
          set_action(at, v);
          all += at.action.dashpot;
        }
      });
      for_each_acting_list(lists, [&](auto entries) {
        for (auto& at : entries)
          for (int d = 0; d < Dim; ++d) {
            const double impulse = step_.dt * all[d];
            const double part = impulse > v[mass_lane] ? v[mass_lane] / impulse : 1.0;
            at.drag[d] = part * at.action.dashpot[d] * v[d];
            f[d] += at.drag[d] - at.action.force[d];
          }
      });
    }
    next_acting_ = next_acting(patch_.acting, i + 1);
    return load<NodeVector>(f);
  }

  template <class T>
  void set_action(ActingNode<Dim, T>& at, const NodeVector& v) {
    if (takes_means<T> && at.means.mass == 0.0) return;
    NodeView<Dim> view{.mass = v[mass_lane],
                       .position = place_of(patch_, *step_.model->mesh, at.node),
                       .velocity = {},
                       .means = at.means,
                       .time = step_.time,
                       .dt = step_.dt,
                       .factor = 1.0};
    for (int d = 0; d < Dim; ++d) view.velocity[d] = v[d];
    if constexpr (HasFunction<T>)
      view.factor = load_factor(*step_.model, at.condition.function, step_.time);
    at.action = at.condition.template act<Dim>(view);
  }

  /// Work of a condition, this patch's share of it by its part `own` of the node's mass [kg].
  template <class T>
  void count_work(const ActingNode<Dim, T>& entry, double own) {
    if (own == 0.0) return;
    const double share = own / at(patch_.velocity, entry.node)[mass_lane];
    for (int d = 0; d < Dim; ++d) {
      const double move = share * mean_move(entry.node, d);
      patch_.work.external += entry.action.force[d] * move;
      patch_.work.damping += entry.drag[d] * move;
    }
  }

  /// The next node of a wall that has not been passed.
  Local next_wall() const {
    return wall_ == patch_.walls.end() ? std::numeric_limits<Local>::max() : wall_->node;
  }
  /// Whether node i is one; passes those before it, which are not active.
  bool is_at_wall(Local i) {
    while (next_wall() < i) ++wall_;
    return next_wall() == i;
  }
  [[gnu::noinline]] NodeVector at_wall(Local i, const NodeVector& v) {
    double values[node_width];
    store(v, values);
    if (is_at_wall(i)) prescribe_velocity(*wall_, values);
    return load<NodeVector>(values);
  }
  /// `a` is that of all forces but the wall's; `v` is written only.
  [[gnu::noinline]] void advance_at_wall(Local i, double own_mass, const NodeVector& old,
                                         NodeVector& a, NodeVector& v) {
    if (!is_at_wall(i)) return;
    double velocity[node_width], acceleration[node_width];
    store(old, velocity);
    store(a, acceleration);
    const auto at_walls = static_cast<std::size_t>(wall_ - patch_.walls.begin());
    WallPush<Dim>* push = patch_.wall_pushes.empty() ? nullptr : &patch_.wall_pushes[at_walls];
    const WallWork done = meet_wall(i, velocity, acceleration, push);
    if (!patch_.contact.wall_change.empty())
      for (int d = 0; d < Dim; ++d)
        patch_.contact.wall_change[at_walls][d] = step_.dt * (acceleration[d] - a[d]);
    patch_.work.external += own_mass * done.reaction;
    patch_.work.damping += own_mass * done.taken;
    patch_.work.friction += own_mass * done.friction;
    v = load<NodeVector>(velocity);
    a = load<NodeVector>(acceleration);
  }

  /// A step of node i at the present wall: velocity at its beginning, acceleration without the
  /// wall.
  WallWork meet_wall(Local i, double* velocity, double* acceleration, WallPush<Dim>* push) const {
    if (step_.model->analysis.scheme == Scheme::usf)  // what nodal_velocity() took
      Eigen::Map<Vec<Dim>>(velocity) += Eigen::Map<const Vec<Dim>>(at(patch_.acceleration, i));
    ConstrainedNode<Dim> wall = *wall_;
    for (std::size_t d = 0; d < Dim; ++d)
      if (wall.accelerated[d])
        wall.acceleration[d] *= load_factor(*step_.model, wall.function[d], step_.time);
    double together = 1.0;
    if (two_phase_) {
      const Eigen::Map<const Vec<Dim>> v(velocity), a(acceleration);
      together = meet_wall_with_liquid<Dim>(patch_, step_, gravity_, velocity[mass_lane],
                                            v + step_.dt * a, wall);
    }
    WallWork work = lahar::advance_at_wall(wall, step_.dt, step_.model->analysis.as_cbgeo, velocity,
                                           acceleration, push);
    work.taken += (together - 1.0) * work.friction;
    work.friction *= together;
    return work;
  }

  double mean_move(Local i, int d) const {
    return step_.dt * (at(patch_.velocity, i)[d] - 0.5 * step_.dt * at(patch_.acceleration, i)[d]);
  }

  Patch<Dim>& patch_;
  const StepContext<Dim>& step_;
  NodeVector gravity_;
  bool two_phase_;
  typename std::vector<PointForce>::const_iterator point_;
  typename std::vector<ConstrainedNode<Dim>>::const_iterator wall_;
  typename std::vector<typename Patch<Dim>::FixedVelocity>::const_iterator fixed_;
  typename std::vector<DrivenNode<Dim>>::const_iterator driven_;
  Local next_acting_;                          ///< the next node on which conditions act
  NodeVector weight_work_ = NodeVector(0.0);   ///< of unit gravity and a step of 1 s
  NodeVector damping_work_ = NodeVector(0.0);  ///< of a step of 1 s
};

}  // namespace

template <int Dim>
void integrate(Patch<Dim>& patch, const StepContext<Dim>& step) {
  Integrator<Dim> integrator(patch, step);
  for_each_node(
      patch, SumOverPatches<Dim>(patch, NodeSum::force, step.step),
      [&](Local i, const NodeVector&, const NodeVector& force) __attribute__((always_inline)) {
        const double* own = patch.own_sums(NodeSum::mass_momentum, step.step);
        integrator.node(i, load<NodeVector>(own + static_cast<std::ptrdiff_t>(i) * sum_stride),
                        load<NodeVector>(at(patch.velocity, i)), force);
      });
  integrator.finish();
}

template <int Dim>
void velocity_and_integrate(Patch<Dim>& patch, const StepContext<Dim>& step) {
  if (patch.active_nodes.empty()) return;
  make_room(patch);
  set_timed_velocities(patch, step);
  Integrator<Dim> integrator(patch, step);
  auto fixed = patch.fixed.begin();  // ascending nodes
  for_each_node(
      patch, SumOverPatches<Dim, SumLine>(patch, NodeSum::mass_momentum, step.step),  // and force
      [&](Local i, const SumLine& own, const SumLine& sum) __attribute__((always_inline)) {
        NodeVector v = velocity_of(patch, first_of(sum), first_of(sum));
        while (fixed != patch.fixed.end() && fixed->node < i) ++fixed;  // not active
        for (; fixed != patch.fixed.end() && fixed->node == i; ++fixed)
          v = with_component(v, fixed->dir, fixed->velocity);
        integrator.node(i, first_of(own), integrator.prescribed_at_wall(i, v), second_of(sum));
      });
  integrator.finish();
}

#define LAHAR_INSTANTIATE(Dim)                                                   \
  template void find_active_nodes<Dim>(Patch<Dim>&);                             \
  template void activate_nodes<Dim>(Patch<Dim>&);                                \
  template void meet_bodies<Dim>(Patch<Dim>&, const StepContext<Dim>&);          \
  template void nodal_velocity<Dim>(Patch<Dim>&, const StepContext<Dim>&);       \
  template void nodal_velocity_again<Dim>(Patch<Dim>&, const StepContext<Dim>&); \
  template void nodal_pressure<Dim>(Patch<Dim>&, const StepContext<Dim>&);       \
  template void integrate<Dim>(Patch<Dim>&, const StepContext<Dim>&);            \
  template void velocity_and_integrate<Dim>(Patch<Dim>&, const StepContext<Dim>&);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)

}  // namespace lahar
