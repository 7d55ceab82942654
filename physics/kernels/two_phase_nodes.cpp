// Nodes of a liquid in pores. Every copy of a node runs this very code, so that all are equal to
// the last bit.
#include <cmath>

#include "physics/kernels/two_phase.h"
#include "physics/model/transfer_options.h"
#include "physics/particles/loads.h"
#include "physics/particles/node_sums.h"

namespace lahar {

namespace {

template <int Dim>
void prescribe_liquid(Patch<Dim>& patch) {
  for (const auto& fixed : patch.fixed_liquid)
    at(patch.liquid.velocity, fixed.node)[fixed.dir] = fixed.velocity;
}

template <int Dim>
NodeVector gravity_at(const StepContext<Dim>& step) {
  double g[node_width] = {};
  const double factor = load_factor(*step.model, step.model->gravity_function, step.time);
  for (int d = 0; d < Dim; ++d) g[d] = factor * step.model->gravity[d];
  return load<NodeVector>(g);
}

/// Component d of v_l' where it is prescribed, else null.
template <int Dim>
const double* prescribed_liquid(const Patch<Dim>& patch, Local node, int d) {
  auto found = std::lower_bound(patch.fixed_liquid.begin(), patch.fixed_liquid.end(), node,
                                [](const auto& fixed, Local n) { return fixed.node < n; });
  for (; found != patch.fixed_liquid.end() && found->node == node; ++found)
    if (found->dir == d) return &found->velocity;
  return nullptr;
}

/// Cundall's force against the velocity v, of the force f [N].
double cundall(const Analysis& analysis, double f, double v) {
  return v == 0.0 ? 0.0 : std::copysign(analysis.damping * std::abs(f), v);
}

/// What nodes got, and particles did not: the transfer's loss is that
/// (Integrator::count_transfer()).
template <int Dim>
void count_transfer(Patch<Dim>& patch, const StepContext<Dim>& step) {
  const double* own = patch.own_sums(NodeSum::liquid_mass_momentum, step.step) + mass_lane;
  double got = 0;
  for (const NodeRange& range : patch.active_nodes)
    for (Local i = range.begin; i < range.end; ++i) {
      const double *v = at(patch.liquid.velocity, i), *a = at(patch.liquid.acceleration, i);
      const double m = own[static_cast<std::ptrdiff_t>(i) * sum_stride];
      for (int d = 0; d < Dim; ++d) got += m * a[d] * (v[d] - 0.5 * step.dt * a[d]);
    }
  patch.work.damping += step.dt * got;
}

}  // namespace

template <int Dim>
void liquid_velocity(Patch<Dim>& patch, const StepContext<Dim>& step) {
  for_each_node(patch, SumOverPatches<Dim>(patch, NodeSum::liquid_mass_momentum, step.step),
                [&](Local i, const NodeVector&, const NodeVector& sum) {
                  store(velocity_of(patch, sum, sum), at(patch.liquid.velocity, i));
                });
  prescribe_liquid(patch);
}

template <int Dim>
void liquid_velocity_again(Patch<Dim>& patch, const StepContext<Dim>& step) {
  for_each_node(patch, SumOverPatches<Dim>(patch, NodeSum::liquid_momentum, step.step),
                [&](Local i, const NodeVector&, const NodeVector& sum) {
                  double* v = at(patch.liquid.velocity, i);
                  store(velocity_of(patch, sum, load<NodeVector>(v)), v);
                });
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
  take(NodeSum::drag, patch.liquid.drag);
  if (step.model->analysis.liquid_advection)
    for_each_node(patch, SumOverPatches<Dim>(patch, NodeSum::advection, step.step),
                  [&](Local i, const NodeVector&, const NodeVector& sum) {
                    patch.liquid.advection[static_cast<std::size_t>(i)] = sum[0];
                  });
}

template <int Dim>
NodeVector on_skeleton(const Patch<Dim>& patch, const StepContext<Dim>& step, Local node,
                       const NodeVector& old, const NodeVector& force, const NodeVector& gravity) {
  const auto v_l = load<NodeVector>(at(patch.liquid.velocity, node));
  const auto f_l = load<NodeVector>(at(patch.liquid.force, node));
  const auto Q = load<NodeVector>(at(patch.liquid.drag, node));
  const double m = old[mass_lane], m_l = v_l[mass_lane], dt = step.dt;
  double added[node_width] = {};
  for (int d = 0; d < Dim; ++d) {
    added[d] = -f_l[d];
    if (!more_than(m_l, patch.least_mass)) continue;
    const double against = v_l[d] - old[d];
    if (step.model->analysis.explicit_drag) {
      added[d] += Q[d] * against;
      continue;
    }
    // Of the difference after the step, with no drag and with it.
    double free = against - dt * (force[d] - f_l[d]) / m, inverse = 1.0 / m;
    if (const double* given = prescribed_liquid(patch, node, d)) {
      free += *given - v_l[d];
    } else {
      free += dt * (f_l[d] / m_l + gravity[d]);
      inverse += 1.0 / m_l;
    }
    added[d] += Q[d] * (free / (1.0 + dt * Q[d] * inverse));
  }
  return load<NodeVector>(added);
}

template <int Dim>
void integrate_liquid(Patch<Dim>& patch, const StepContext<Dim>& step) {
  const Analysis& analysis = step.model->analysis;
  const NodeVector g = gravity_at(step), zero(0.0);
  const double dt = step.dt;
  const double* own_mass = patch.own_sums(NodeSum::liquid_mass_momentum, step.step) + mass_lane;
  if (spreads_before_forces(analysis)) patch.liquid.before = patch.liquid.velocity;
  PatchWork& work = patch.work;
  for (const NodeRange& range : patch.active_nodes)
    for (Local i = range.begin; i < range.end; ++i) {
      double* velocity = at(patch.liquid.velocity, i);
      double* acceleration = at(patch.liquid.acceleration, i);
      const auto old = load<NodeVector>(velocity);
      const double m = old[mass_lane];
      store(zero, acceleration);
      if (!more_than(m, patch.least_mass)) continue;
      const auto f = load<NodeVector>(at(patch.liquid.force, i));
      const auto Q = load<NodeVector>(at(patch.liquid.drag, i));
      const auto v_s = load<NodeVector>(at(patch.velocity, i));
      const auto a_s = load<NodeVector>(at(patch.acceleration, i));
      const double own = own_mass[static_cast<std::ptrdiff_t>(i) * sum_stride], share = own / m;
      for (int d = 0; d < Dim; ++d) {
        const double mean_s = v_s[d] - 0.5 * dt * a_s[d];
        double force = f[d] + m * g[d], drag;
        if (analysis.liquid_advection)
          force -= patch.liquid.advection[static_cast<std::size_t>(i)] * old[d];
        if (analysis.explicit_drag) {
          drag = Q[d] * (old[d] - (v_s[d] - dt * a_s[d]));
          const double against = cundall(analysis, force - drag, old[d]);
          acceleration[d] = (force - drag - against) / m;
          force -= against;
        } else {
          force -= cundall(analysis, force, old[d]);
          const double after = (m * old[d] + dt * (force + Q[d] * v_s[d])) / (m + dt * Q[d]);
          drag = Q[d] * (after - v_s[d]);
          acceleration[d] = (force - drag) / m;
        }
        const double mean = old[d] + 0.5 * dt * acceleration[d];
        work.external += dt * own * g[d] * mean;
        work.damping += dt * share * (f[d] + m * g[d] - force) * mean;
        work.damping += dt * share * drag * (mean - mean_s);
        velocity[d] = old[d] + dt * acceleration[d];
        if (std::abs(velocity[d]) < least_nodal_velocity) velocity[d] = 0.0;
      }
    }
  for (const auto& fixed : patch.fixed_liquid) {
    double& v = at(patch.liquid.velocity, fixed.node)[fixed.dir];
    double& a = at(patch.liquid.acceleration, fixed.node)[fixed.dir];
    const double own = own_mass[static_cast<std::ptrdiff_t>(fixed.node) * sum_stride];
    const double m = at(patch.liquid.velocity, fixed.node)[mass_lane];
    if (own != 0.0 && more_than(m, patch.least_mass)) {
      // The reaction works along the prescribed velocity; so does everything that moved v before.
      const double other = dt * (fixed.velocity - (v - 0.5 * dt * a));
      const double Q = at(patch.liquid.drag, fixed.node)[fixed.dir];
      const double v_s = at(patch.velocity, fixed.node)[fixed.dir];
      const double drag = own / m * Q * ((analysis.explicit_drag ? v - dt * a : v) - v_s);
      work.external += own * (fixed.velocity - v) * fixed.velocity + own * g[fixed.dir] * other;
      work.damping += drag * other;
    }
    v = fixed.velocity;
    a = 0.0;
  }
  if (counts_at_nodes(analysis)) count_transfer(patch, step);
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
                    const double given =
                        fixed->pressure * load_factor(*step.model, fixed->function, step.time);
                    pressure = smooths ? given : given - mean;
                  }
                });
}

#define LAHAR_INSTANTIATE(Dim)                                                                   \
  template void liquid_velocity<Dim>(Patch<Dim>&, const StepContext<Dim>&);                      \
  template void liquid_velocity_again<Dim>(Patch<Dim>&, const StepContext<Dim>&);                \
  template void liquid_forces<Dim>(Patch<Dim>&, const StepContext<Dim>&);                        \
  template NodeVector on_skeleton<Dim>(const Patch<Dim>&, const StepContext<Dim>&, Local,        \
                                       const NodeVector&, const NodeVector&, const NodeVector&); \
  template void integrate_liquid<Dim>(Patch<Dim>&, const StepContext<Dim>&);                     \
  template void nodal_pore_pressure<Dim>(Patch<Dim>&, const StepContext<Dim>&);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
