// Nodes of a liquid in pores. Every copy of a node runs this very code, so that all are equal to
// the last bit.
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "physics/boundary/wall_axes.h"
#include "physics/kernels/nodal_motion.h"
#include "physics/kernels/timed_velocities.h"
#include "physics/kernels/two_phase.h"
#include "physics/model/transfer_options.h"
#include "physics/particles/damping_force.h"
#include "physics/particles/loads.h"
#include "physics/particles/node_sums.h"

namespace lahar {

namespace {

template <int Dim>
void prescribe_liquid(Patch<Dim>& patch) {
  for (const auto& fixed : patch.fixed_liquid)
    at(patch.liquid.velocity, fixed.node)[fixed.dir] = fixed.velocity;
}

/// Both phases of a node after the step, but for the drag: their velocities, and by how much a unit
/// impulse changes them, which is zero where they are held.
struct WithoutDrag {
  double skeleton[node_width], liquid[node_width];          ///< [m/s]
  double per_skeleton[node_width], per_liquid[node_width];  ///< [1/kg]
};

/// Where the liquid is held along the normal of a wall, drag does not press the skeleton on it, nor
/// carry it: both move with the wall.
template <int Dim>
void hold_at_wall(const ConstrainedNode<Dim>& wall, WithoutDrag& free) {
  for (int k = 0; k < Dim; ++k) {
    const auto local = static_cast<std::size_t>(k);
    const auto axis = global_axis(wall, k);
    if (!axis || free.per_liquid[axis->dir] > 0) continue;
    double& v = free.skeleton[axis->dir];
    const double into = (axis->sign * v - wall.velocity[local]) * wall.pushes[local];
    if (!wall.fixed[local] && !(into > 0)) continue;
    v = axis->sign * wall.velocity[local];
    free.per_skeleton[axis->dir] = 0;
  }
}

template <int Dim>
void hold_phases(const Patch<Dim>& patch, Local node, WithoutDrag& free) {
  for_entries(patch.fixed_liquid, node, [&](const auto& fixed) {
    free.liquid[fixed.dir] = fixed.velocity;
    free.per_liquid[fixed.dir] = 0;
  });
  for_entries(patch.fixed, node, [&](const auto& fixed) {
    free.skeleton[fixed.dir] = fixed.velocity;
    free.per_skeleton[fixed.dir] = 0;
  });
  if (const auto* wall = find_node(patch.walls, node)) hold_at_wall(*wall, free);
}

/// Force on the liquid of a node [N] but for drag and damping: pressure and weight.
template <int Dim>
NodeVector undamped_force(const Patch<Dim>& patch, const StepContext<Dim>& step, Local node,
                          const NodeVector& gravity) {
  const auto v = load<NodeVector>(at(patch.liquid.velocity, node));
  const NodeVector force = load<NodeVector>(at(patch.liquid.force, node)) + v[mass_lane] * gravity;
  if (!step.model->analysis.liquid_advection) return force;
  return force - patch.liquid.advection[static_cast<std::size_t>(node)] * with_mass(v, gravity);
}

/// The same with damping. Cundall's is that of what `drag` leaves out of balance: a steady flow is
/// not damped.
template <int Dim>
NodeVector damped_force(const Patch<Dim>& patch, const StepContext<Dim>& step, Local node,
                        const NodeVector& gravity, const NodeVector& drag) {
  const NodeVector force = undamped_force(patch, step, node, gravity);
  const Analysis& analysis = step.model->analysis;
  if (analysis.damping == 0.0) return force;
  const auto v = load<NodeVector>(at(patch.liquid.velocity, node));
  return force - damping_force(analysis, step.dt, v, force - drag);
}

/// Q (v_l - v) after the step, of the forces that act on skeleton and liquid beside it.
template <int Dim>
NodeVector implicit_drag(const Patch<Dim>& patch, double dt, Local node, const NodeVector& old,
                         const NodeVector& on_skeleton, const NodeVector& on_liquid) {
  const auto v_l = load<NodeVector>(at(patch.liquid.velocity, node));
  const double m = old[mass_lane], m_l = v_l[mass_lane];
  const auto Q = load<NodeVector>(at(patch.liquid.drag, node));
  const NodeVector after = old + dt / m * on_skeleton, liquid = v_l + dt / m_l * on_liquid;
  WithoutDrag free;
  store(after, free.skeleton);
  store(liquid, free.liquid);
  store(NodeVector(1.0 / m), free.per_skeleton);
  store(NodeVector(1.0 / m_l), free.per_liquid);
  hold_phases(patch, node, free);
  const NodeVector difference = load<NodeVector>(free.liquid) - load<NodeVector>(free.skeleton);
  const NodeVector inverse =
      load<NodeVector>(free.per_skeleton) + load<NodeVector>(free.per_liquid);
  return Q * (difference / (1.0 + dt * Q * inverse));
}

}  // namespace

template <int Dim>
void liquid_velocity(Patch<Dim>& patch, const StepContext<Dim>& step) {
  set_timed_velocities(patch, step);
  take_velocity(patch, step, NodeSum::liquid_mass_momentum, patch.liquid.velocity);
  prescribe_liquid(patch);
}

template <int Dim>
void liquid_velocity_again(Patch<Dim>& patch, const StepContext<Dim>& step) {
  if (patch.active_nodes.empty()) return;
  take_velocity_again(patch, step, NodeSum::liquid_momentum, patch.liquid.velocity);
  prescribe_liquid(patch);
}

template <int Dim>
void liquid_forces(Patch<Dim>& patch, const StepContext<Dim>& step) {
  const NodeVector zero(0.0);
  const auto take = [&](NodeSum which, NodeArray& to) {
    for_each_node(patch, SumOverPatches<Dim>(patch, which, step.step),
                  [&](Local i, const NodeVector&, const NodeVector& sum) {
                    store(with_mass(sum, zero), at(to, i));
                  });
  };
  take(NodeSum::liquid_force, patch.liquid.force);
  if (patch.liquid.porosity.empty()) {
    take(NodeSum::drag, patch.liquid.drag);
  } else {
    for_each_node(patch, SumOverPatches<Dim>(patch, NodeSum::drag, step.step),
                  [&](Local i, const NodeVector&, const NodeVector& sum) {
                    store(with_mass(sum, zero), at(patch.liquid.drag, i));
                    const double m = at(patch.liquid.velocity, i)[mass_lane], all = sum[mass_lane];
                    const double porosity = all > 0 ? m / all : 0.0;
                    patch.liquid.porosity[static_cast<std::size_t>(i)] = porosity;
                    double* force = at(patch.liquid.force, i);
                    store(NodeVector(porosity * load<NodeVector>(force)), force);
                  });
  }
  if (step.model->analysis.liquid_advection)
    for_each_node(patch, SumOverPatches<Dim>(patch, NodeSum::advection, step.step),
                  [&](Local i, const NodeVector&, const NodeVector& sum) {
                    patch.liquid.advection[static_cast<std::size_t>(i)] = sum[0];
                  });
}

template <int Dim>
NodeVector before_damping(const Patch<Dim>& patch, const StepContext<Dim>& step, Local node,
                          const NodeVector& old) {
  const auto f_l = load<NodeVector>(at(patch.liquid.force, node));
  if (!step.model->analysis.explicit_drag) return -f_l;
  const auto v_l = load<NodeVector>(at(patch.liquid.velocity, node));
  if (!more_than(v_l[mass_lane], patch.least_mass)) return -f_l;
  return load<NodeVector>(at(patch.liquid.drag, node)) * (v_l - old) - f_l;
}

template <int Dim>
NodeVector drag_before_damping(Patch<Dim>& patch, const StepContext<Dim>& step, Local node,
                               const NodeVector& old, const NodeVector& force,
                               const NodeVector& gravity) {
  const double m_l = at(patch.liquid.velocity, node)[mass_lane];
  NodeVector drag(0.0);
  if (more_than(m_l, patch.least_mass))
    drag =
        implicit_drag(patch, step.dt, node, old, force, undamped_force(patch, step, node, gravity));
  store(drag, at(patch.liquid.acceleration, node));
  return drag;
}

template <int Dim>
NodeVector drag_on_skeleton(const Patch<Dim>& patch, const StepContext<Dim>& step, Local node,
                            const NodeVector& old, const NodeVector& force,
                            const NodeVector& gravity) {
  const double m_l = at(patch.liquid.velocity, node)[mass_lane];
  if (step.model->analysis.explicit_drag || !more_than(m_l, patch.least_mass))
    return NodeVector(0.0);
  const auto before_damping = load<NodeVector>(at(patch.liquid.acceleration, node));
  return implicit_drag(patch, step.dt, node, old, force,
                       damped_force(patch, step, node, gravity, before_damping));
}

template <int Dim>
double meet_wall_with_liquid(const Patch<Dim>& patch, const StepContext<Dim>& step,
                             const NodeVector& gravity, double m, const Vec<Dim>& after,
                             ConstrainedNode<Dim>& wall) {
  const Local i = wall.node;
  if (patch.liquid.porosity.empty() || !find_node(patch.fixed_liquid, i)) return 1.0;
  const auto v_l = load<NodeVector>(at(patch.liquid.velocity, i));
  const auto f_l = load<NodeVector>(at(patch.liquid.force, i));
  const double m_l = v_l[mass_lane], n = patch.liquid.porosity[static_cast<std::size_t>(i)];
  if (!more_than(m_l, patch.least_mass)) return 1.0;
  const NodeVector liquid = v_l + step.dt / m_l * (f_l + m_l * gravity);
  std::array<double, Dim> held, per_liquid;  // velocity [m/s], 1/m_l or 0 [1/kg]
  per_liquid.fill(1.0 / m_l);
  for_entries(patch.fixed_liquid, i, [&](const auto& fixed) {
    held[static_cast<std::size_t>(fixed.dir)] = fixed.velocity;
    per_liquid[static_cast<std::size_t>(fixed.dir)] = 0;
  });
  double most = 1;
  for (int k = 0; k < Dim; ++k) {
    const auto local = static_cast<std::size_t>(k);
    const auto axis = global_axis(wall, k);
    if (!axis || wall.pushes[local] == 0) continue;
    const auto normal = static_cast<std::size_t>(axis->dir);
    if (per_liquid[normal] > 0) continue;
    const double into = (axis->sign * after[axis->dir] - wall.velocity[local]) * wall.pushes[local];
    if (!(into > 0)) continue;
    const double of_liquid = axis->sign * (liquid[axis->dir] - held[normal]) * wall.pushes[local];
    const double lift = (1.0 - n) / n * m_l / m * of_liquid;
    double together = 1;  // what friction moves, over m
    for (int t = 0; t < Dim; ++t) {
      if (t == axis->dir || step.model->analysis.explicit_drag) continue;
      const double Q = step.dt * at(patch.liquid.drag, i)[t];
      const double free = 1.0 + Q * per_liquid[static_cast<std::size_t>(t)];
      together = std::max(together, 1.0 + Q / m / free);
    }
    if (std::isfinite(wall.rubs[local]))  // else rough: nothing slides
      wall.rubs[local] *= std::clamp(1.0 - lift / into, 0.0, 1.0) / together;
    most = std::max(most, together);
  }
  return most;
}

template <int Dim>
void integrate_liquid(Patch<Dim>& patch, const StepContext<Dim>& step) {
  if (patch.active_nodes.empty()) return;
  const Analysis& analysis = step.model->analysis;
  const NodeVector g = gravity_in(step), zero(0.0);
  const double dt = step.dt;
  const double* own_mass = patch.own_sums(NodeSum::liquid_mass_momentum, step.step) + mass_lane;
  if (spreads_before_forces(analysis)) patch.liquid.before = patch.liquid.velocity;
  NodeVector external(0.0), lost(0.0);  // power [W]
  for (const NodeRange& range : patch.active_nodes)
    for (Local i = range.begin; i < range.end; ++i) {
      double* velocity = at(patch.liquid.velocity, i);
      double* acceleration = at(patch.liquid.acceleration, i);
      const auto old = load<NodeVector>(velocity);
      const double m = old[mass_lane];
      const auto before_damping = load<NodeVector>(acceleration);
      store(zero, acceleration);
      if (!more_than(m, patch.least_mass)) continue;
      const auto Q = load<NodeVector>(at(patch.liquid.drag, i));
      const auto v_s = load<NodeVector>(at(patch.velocity, i));
      const auto a_s = load<NodeVector>(at(patch.acceleration, i));
      NodeVector drag =
          analysis.explicit_drag ? NodeVector(Q * (old - (v_s - dt * a_s))) : before_damping;
      const NodeVector force = damped_force(patch, step, i, g, drag);
      if (!analysis.explicit_drag) {
        const NodeVector after = (m * old + dt * (force + Q * v_s)) / (m + dt * Q);
        drag = Q * (after - v_s);
      }
      const NodeVector a = (force - drag) / m;
      store(a, acceleration);
      store(with_mass(flushed(old + dt * a, least_nodal_velocity), old), velocity);
      const NodeVector mean = old + (0.5 * dt) * a, mean_s = v_s - (0.5 * dt) * a_s;
      const double own = own_mass[static_cast<std::ptrdiff_t>(i) * sum_stride];
      external += own * (g * mean);
      const NodeVector given = load<NodeVector>(at(patch.liquid.force, i)) + m * g;
      lost += (own / m) * ((given - force) * mean + drag * (mean - mean_s));
    }
  PatchWork& work = patch.work;
  for (int d = 0; d < Dim; ++d) {
    work.external += dt * external[d];
    work.damping += dt * lost[d];
  }
  for (const auto& fixed : patch.fixed_liquid) {
    double& v = at(patch.liquid.velocity, fixed.node)[fixed.dir];
    double& a = at(patch.liquid.acceleration, fixed.node)[fixed.dir];
    const double own = own_mass[static_cast<std::ptrdiff_t>(fixed.node) * sum_stride];
    const double m = at(patch.liquid.velocity, fixed.node)[mass_lane];
    if (own != 0.0 && more_than(m, patch.least_mass)) {
      // The reaction works along the prescribed velocity; so does everything that moved v before:
      // weight, and what drag and damping left of the forces.
      const double other = dt * (fixed.velocity - (v - 0.5 * dt * a));
      const double g_d = g[fixed.dir], f = at(patch.liquid.force, fixed.node)[fixed.dir];
      // The drag is that of the velocity which is held, not of v.
      const double Q =
          analysis.explicit_drag ? 0.0 : dt * at(patch.liquid.drag, fixed.node)[fixed.dir];
      const double v_s = at(patch.velocity, fixed.node)[fixed.dir] -
                         0.5 * dt * at(patch.acceleration, fixed.node)[fixed.dir];
      const double held = (fixed.velocity - v) / m;
      work.external += own * ((m + Q) * held * fixed.velocity + g_d * other);
      work.damping += own * ((f / m + g_d - a) * other + Q * held * (fixed.velocity - v_s));
    }
    v = fixed.velocity;
    a = 0.0;
  }
  add_timed_acceleration_of_liquid(patch, step);
  if (counts_at_nodes(analysis))
    count_transfer(patch, step, own_mass, patch.liquid.velocity, patch.liquid.acceleration);
}

template <int Dim>
void liquid_discharge(Patch<Dim>& patch) {
  if (patch.liquid.porosity.empty()) return;
  const NodeVector zero(0.0);
  for (const NodeRange& range : patch.active_nodes)
    for (Local i = range.begin; i < range.end; ++i) {
      const auto v = load<NodeVector>(at(patch.velocity, i)),
                 v_l = load<NodeVector>(at(patch.liquid.velocity, i));
      const double n = patch.liquid.porosity[static_cast<std::size_t>(i)];
      store(with_mass(NodeVector(v + n * (v_l - v)), zero), at(patch.liquid.discharge, i));
    }
}

template <int Dim>
void nodal_pore_pressure(Patch<Dim>& patch, const StepContext<Dim>& step) {
  const bool smooths = step.model->analysis.pore_pressure_smoothing;
  auto fixed = patch.fixed_pressure.begin();
  for_each_node(patch, SumOverPatches<Dim>(patch, NodeSum::pore_pressure, step.step),
                [&](Local i, const NodeVector&, const NodeVector& sum) {
                  const double m = sum[mass_lane];
                  const double mean = has_velocity(patch, m) ? sum[0] / m : 0.0;
                  double& pressure = patch.liquid.pressure[static_cast<std::size_t>(i)];
                  pressure = smooths ? mean : 0.0;
                  while (fixed != patch.fixed_pressure.end() && fixed->node < i)
                    ++fixed;  // not active
                  for (; fixed != patch.fixed_pressure.end() && fixed->node == i; ++fixed) {
                    const double given = pressure_given(*step.model, *fixed, step.time);
                    pressure = smooths ? given : fixed->inside ? given - mean : 0.0;
                  }
                });
}

#define LAHAR_INSTANTIATE(Dim)                                                                 \
  template void liquid_velocity<Dim>(Patch<Dim>&, const StepContext<Dim>&);                    \
  template void liquid_velocity_again<Dim>(Patch<Dim>&, const StepContext<Dim>&);              \
  template void liquid_forces<Dim>(Patch<Dim>&, const StepContext<Dim>&);                      \
  template NodeVector before_damping<Dim>(const Patch<Dim>&, const StepContext<Dim>&, Local,   \
                                          const NodeVector&);                                  \
  template NodeVector drag_before_damping<Dim>(Patch<Dim>&, const StepContext<Dim>&, Local,    \
                                               const NodeVector&, const NodeVector&,           \
                                               const NodeVector&);                             \
  template NodeVector drag_on_skeleton<Dim>(const Patch<Dim>&, const StepContext<Dim>&, Local, \
                                            const NodeVector&, const NodeVector&,              \
                                            const NodeVector&);                                \
  template void integrate_liquid<Dim>(Patch<Dim>&, const StepContext<Dim>&);                   \
  template double meet_wall_with_liquid<Dim>(const Patch<Dim>&, const StepContext<Dim>&,       \
                                             const NodeVector&, double, const Vec<Dim>&,       \
                                             ConstrainedNode<Dim>&);                           \
  template void liquid_discharge<Dim>(Patch<Dim>&);                                            \
  template void nodal_pore_pressure<Dim>(Patch<Dim>&, const StepContext<Dim>&);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
