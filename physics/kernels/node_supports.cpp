#include "physics/kernels/node_supports.h"

#include <algorithm>
#include <span>

#include "physics/boundary/wall_axes.h"
#include "physics/kernels/implicit_walls.h"
#include "physics/kernels/nodal_motion.h"
#include "physics/model/transfer_options.h"
#include "physics/particles/loads.h"
#include "physics/particles/node_place.h"

namespace lahar {

namespace {

/// Call body(gauge, its number among those of forces).
template <int Dim>
void for_each_force_gauge(const Model<Dim>& model, auto body) {
  std::size_t k = 0;
  for (const Gauge& gauge : model.output.measured.gauges)
    if (gauge.kind == Gauge::Kind::force) body(gauge, k++);
}

/// Share of the nodal velocity that particles take in a step.
template <int Dim>
double share_taken(const Patch<Dim>& patch, const StepContext<Dim>& step, Local node) {
  const VelocityTransfer& transfer = step.model->analysis.transfer;
  return 1.0 - transfer.kept(patch.bodies() == 1 ? 0 : node / patch.body_nodes, step.dt);
}

using Measured = std::span<const Gauge* const>;

template <int Dim>
void add_to_gauge(Patch<Dim>& patch, const Model<Dim>& model, Measured gauges,
                  const typename Patch<Dim>::MeasuredNode& at, const Vec<Dim>& force) {
  const Vec<Dim> x = place_of(patch, *model.mesh, at.node);
  Vec<Dim> arm, counted;
  for (int d = 0; d < Dim; ++d) {
    const auto k = static_cast<std::size_t>(d);
    arm[d] = x[d] - gauges[at.gauge]->origin[k];
    counted[d] = at.counts[k] ? force[d] : 0.0;
  }
  patch.supports[at.gauge].template add<Dim>(counted, arm);
}

/// By node: bit d says that the node is held along axis d. Walls along none of the axes hold none.
template <int Dim>
std::vector<unsigned> held_axes(const Patch<Dim>& patch) {
  std::vector<unsigned> held(static_cast<std::size_t>(patch.n_nodes()), 0);
  const auto hold = [&](Local node, int axis) {
    held[static_cast<std::size_t>(node)] |= 1U << static_cast<unsigned>(axis);
  };
  for (const auto& at : patch.fixed) hold(at.node, at.dir);
  for (const auto& at : patch.fixed_displacement) hold(at.node, at.dir);
  for_each_acting_list(patch.acting, [&](const auto& list) {
    for (const auto& at : list) hold(at.node, place_of(at.condition).second);
  });
  for (const ConstrainedNode<Dim>& wall : patch.walls)
    for (int k = 0; k < Dim; ++k) {
      const auto axis = static_cast<std::size_t>(k);
      if (!wall.fixed[axis] && !wall.accelerated[axis] && wall.pushes[axis] == 0 &&
          wall.normal != k)
        continue;
      if (const auto global = global_axis(wall, k)) hold(wall.node, global->dir);
    }
  return held;
}

template <int Dim>
std::vector<const Gauge*> force_gauges(const Model<Dim>& model) {
  std::vector<const Gauge*> gauges;
  for_each_force_gauge(model, [&](const Gauge& gauge, std::size_t) { gauges.push_back(&gauge); });
  return gauges;
}

/// Adds the force on the support of each measured node, force(node): this patch's part of it.
template <int Dim>
void add(Patch<Dim>& patch, const Model<Dim>& model, const NodeArray& velocity, auto force) {
  const auto gauges = force_gauges(model);
  for (const auto& measured : patch.measured) {
    const Local node = measured.node;
    if (!patch.node_is_active[static_cast<std::size_t>(node)]) continue;
    if (!more_than(at(velocity, node)[mass_lane], patch.least_mass)) continue;
    const NodeVector all = force(node);
    Vec<Dim> on_support;
    for (int d = 0; d < Dim; ++d) on_support[d] = all[d];
    add_to_gauge<Dim>(patch, model, gauges, measured, on_support);
  }
}

/// {p, m}, or another sum that this patch gave to a node.
template <int Dim>
NodeVector own_sum(const Patch<Dim>& patch, NodeSum which, const StepContext<Dim>& step,
                   Local node) {
  return load<NodeVector>(patch.own_sums(which, step.step) +
                          static_cast<std::ptrdiff_t>(node) * sum_stride);
}

/// m g - m a - c / dt (m v - p) of one phase, where v is held at the beginning of the step.
template <int Dim>
NodeVector inertia(const Patch<Dim>& patch, const StepContext<Dim>& step, Local node,
                   const NodeVector& given, const NodeArray& velocity,
                   const NodeArray& acceleration) {
  const double m = given[mass_lane];
  const auto a = load<NodeVector>(at(acceleration, node));
  const NodeVector before = load<NodeVector>(at(velocity, node)) - step.dt * a;
  return m * (gravity_in(step) - a) -
         share_taken(patch, step, node) / step.dt * (m * before - given);
}

template <int Dim>
bool measures(const Patch<Dim>& patch) {
  return !patch.measured.empty() && !patch.active_nodes.empty();
}

}  // namespace

template <int Dim>
void begin_supports(Patch<Dim>& patch) {
  std::fill(patch.supports.begin(), patch.supports.end(), Reaction{});
}

template <int Dim>
void add_support(Patch<Dim>& patch, const Model<Dim>& model, Local node, const Vec<Dim>& force) {
  auto at = std::lower_bound(patch.measured.begin(), patch.measured.end(), node,
                             [](const auto& measured, Local n) { return measured.node < n; });
  if (at == patch.measured.end() || at->node != node) return;
  const auto gauges = force_gauges(model);
  for (; at != patch.measured.end() && at->node == node; ++at)
    add_to_gauge<Dim>(patch, model, gauges, *at, force);
}

template <int Dim>
void set_measured_nodes(Patch<Dim>& patch, const Model<Dim>& model) {
  std::size_t gauges = 0;
  std::vector<unsigned> held;
  for_each_force_gauge(model, [&](const Gauge& gauge, std::size_t k) {
    gauges = k + 1;
    if (gauge.ids.empty()) return;
    const bool is_wall = std::ranges::find(gauge.held, true) != gauge.held.end();
    if (is_wall && held.empty()) held = held_axes(patch);
    for (Local i = 0; i < patch.n_nodes(); ++i) {
      if (!std::binary_search(gauge.ids.begin(), gauge.ids.end(),
                              node_of_mesh(patch, *model.mesh, i)))
        continue;
      typename Patch<Dim>::MeasuredNode measured{.node = i, .gauge = k};
      for (std::size_t d = 0; d < Dim; ++d)
        measured.counts[d] =
            !is_wall || gauge.held[d] || (held[static_cast<std::size_t>(i)] >> d & 1U) == 0;
      patch.measured.push_back(measured);
    }
  });
  std::stable_sort(patch.measured.begin(), patch.measured.end(),
                   [](const auto& a, const auto& b) { return a.node < b.node; });
  patch.supports.resize(gauges);
  // Those of a state are kept, but for one of a scenario that had other gauges.
  if (patch.impulses.size() != gauges) patch.impulses.assign(gauges, {});
}

template <int Dim>
void find_supports(Patch<Dim>& patch, const StepContext<Dim>& step) {
  if (!is_projection(step.model->analysis)) begin_supports(patch);
  if (!measures(patch)) return;
  const Model<Dim>& model = *step.model;
  add(patch, model, patch.velocity, [&](Local node) {
    const NodeVector given = own_sum(patch, NodeSum::mass_momentum, step, node);
    double loads[node_width] = {};
    if (is_first_body(patch, node))
      for (const auto* point = find_node(patch.forces, node);
           point && point != patch.forces.data() + patch.forces.size() && point->node == node;
           ++point)
        loads[point->dir] += point->force * load_factor(model, point->function, step.time);
    NodeVector other = load<NodeVector>(loads);
    if (model.analysis.damping > 0.0) other -= load<NodeVector>(at(patch.damping, node));
    const double share = given[mass_lane] / at(patch.velocity, node)[mass_lane];
    return own_sum(patch, NodeSum::force, step, node) + share * other +
           inertia(patch, step, node, given, patch.velocity, patch.acceleration);
  });
}

template <int Dim>
void add_supports_of_liquid(Patch<Dim>& patch, const StepContext<Dim>& step) {
  if (!measures(patch)) return;
  add(patch, *step.model, patch.liquid.velocity, [&](Local node) {
    const NodeVector given = own_sum(patch, NodeSum::liquid_mass_momentum, step, node);
    return inertia(patch, step, node, given, patch.liquid.velocity, patch.liquid.acceleration);
  });
}

template <int Dim>
void find_supports_of_implicit(Patch<Dim>& patch, const StepContext<Dim>& step) {
  begin_supports(patch);
  if (!measures(patch)) return;
  add(patch, *step.model, patch.velocity, [&](Local node) {
    return patch.implicit.own_mass[static_cast<std::size_t>(node)] /
           at(patch.velocity, node)[mass_lane] * node_vector<Dim>(force_on_support(patch, node));
  });
}

template <int Dim>
void add_impulses(Patch<Dim>& patch, const StepContext<Dim>& step) {
  for_each_force_gauge(*step.model, [&](const Gauge& gauge, std::size_t k) {
    const auto body = static_cast<std::size_t>(gauge.body);
    const bool on_body = gauge.body >= 0;
    if (on_body && body >= patch.reactions.size()) return;  // nothing has been near a body yet
    const Reaction& of_step = on_body ? patch.reactions[body] : patch.supports[k];
    for (std::size_t d = 0; d < 3; ++d) {
      patch.impulses[k].force[d] += step.dt * of_step.force[d];
      patch.impulses[k].torque[d] += step.dt * of_step.torque[d];
    }
  });
}

#define LAHAR_INSTANTIATE(Dim)                                                            \
  template void set_measured_nodes<Dim>(Patch<Dim>&, const Model<Dim>&);                  \
  template void begin_supports<Dim>(Patch<Dim>&);                                         \
  template void add_support<Dim>(Patch<Dim>&, const Model<Dim>&, Local, const Vec<Dim>&); \
  template void find_supports<Dim>(Patch<Dim>&, const StepContext<Dim>&);                 \
  template void add_supports_of_liquid<Dim>(Patch<Dim>&, const StepContext<Dim>&);        \
  template void find_supports_of_implicit<Dim>(Patch<Dim>&, const StepContext<Dim>&);     \
  template void add_impulses<Dim>(Patch<Dim>&, const StepContext<Dim>&);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
