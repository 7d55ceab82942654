/// \file Every copy of a node runs this very code, so that all are equal to the last bit.
#include "physics/kernels/velocity_transfer.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "physics/kernels/driven_nodes.h"
#include "physics/kernels/node_supports.h"
#include "physics/particles/node_sums.h"

namespace lahar {

namespace {

/// Velocities that are filtered: those before forces act, or (`after`) with their change.
template <int Dim>
LAHAR_INLINE NodeVector unfiltered(const Patch<Dim>& patch, Local i, bool after, double dt) {
  const auto v = load<NodeVector>(at(patch.velocity, i));
  return after ? v : v - dt * load<NodeVector>(at(patch.acceleration, i));
}

/// V_order + dt a becomes what is prescribed; with FMPM, V_order does.
template <int Dim>
void prescribe(Patch<Dim>& patch, const StepContext<Dim>& step) {
  const double dt = step.model->analysis.transfer.filters_change ? 0.0 : step.dt;
  const auto add = [&](Local i, double time) {  // a is zero along directions that are fixed
    store(load<NodeVector>(at(patch.transfer, i)) +
              NodeVector(time) * load<NodeVector>(at(patch.acceleration, i)),
          at(patch.transfer, i));
  };
  const auto add_change = [&](double time) {
    for (const auto& driven : patch.driven) add(driven.node, time);
    for (const auto& wall : patch.walls)
      if (!find_node(patch.driven, wall.node)) add(wall.node, time);
  };
  add_change(dt);
  prescribe_velocities(patch, patch.transfer);
  add_change(-dt);
}

/// prescribe() after the last order. Particles take a share of the velocities of this order. What
/// prescribe() adds to them is a force on what holds the nodes. Without it, all nodes together have
/// the momentum of unfiltered().
template <int Dim>
void prescribe_last(Patch<Dim>& patch, const StepContext<Dim>& step) {
  const VelocityTransfer& transfer = step.model->analysis.transfer;
  std::vector<std::pair<Local, NodeVector>> before;  // of measured nodes
  for (const auto& measured : patch.measured)
    if (patch.node_is_active[static_cast<std::size_t>(measured.node)] &&
        has_velocity(patch, at(patch.velocity, measured.node)[mass_lane]) &&
        (before.empty() || before.back().first != measured.node))
      before.push_back({measured.node, load<NodeVector>(at(patch.transfer, measured.node))});
  prescribe(patch, step);
  const double* own_mass = patch.own_sums(NodeSum::mass_momentum, step.step) + mass_lane;
  for (const auto& [node, free] : before) {
    const Local body = patch.bodies() == 1 ? 0 : node / patch.body_nodes;
    const double taken = 1.0 - transfer.kept(body, step.dt) - transfer.taken_by_viscosity(step.dt);
    const NodeVector given = own_mass[static_cast<std::ptrdiff_t>(node) * sum_stride] * taken *
                             (load<NodeVector>(at(patch.transfer, node)) - free);
    Vec<Dim> force;
    for (int d = 0; d < Dim; ++d) force[d] = -given[d] / step.dt;
    add_support(patch, *step.model, node, force);
  }
}

template <int Dim, class Node>
void for_each_active_node(const Patch<Dim>& patch, Node node) {
  for (const NodeRange& range : patch.active_nodes)
    for (Local i = range.begin; i < range.end; ++i) node(i);
}

}  // namespace

template <int Dim>
void velocities_before_forces(Patch<Dim>& patch, const StepContext<Dim>& step) {
  patch.transfer.resize(patch.velocity.size());
  for_each_active_node(
      patch, [&](Local i) { store(unfiltered(patch, i, false, step.dt), at(patch.transfer, i)); });
}

template <int Dim>
void begin_filter(Patch<Dim>& patch, const StepContext<Dim>& step) {
  const bool after = step.model->analysis.transfer.filters_change;
  patch.transfer.resize(patch.velocity.size());
  for_each_active_node(patch, [&](Local i) {
    store(with_mass(unfiltered(patch, i, after, step.dt), NodeVector(0.0)), at(patch.transfer, i));
  });
  prescribe(patch, step);
}

template <int Dim>
void raise_filter(Patch<Dim>& patch, const StepContext<Dim>& step, int order) {
  const bool after = step.model->analysis.transfer.filters_change;
  for_each_node(patch, SumOverPatches<Dim>(patch, sum_of_order(order), step.step),
                [&](Local i, const NodeVector&, const NodeVector& sum) {
                  const double m = at(patch.velocity, i)[mass_lane];
                  if (!has_velocity(patch, m)) return;
                  const auto lower = load<NodeVector>(at(patch.transfer, i));
                  store(with_mass(unfiltered(patch, i, after, step.dt) + (lower - (1.0 / m) * sum),
                                  order == 2 ? (1.0 / m) * sum : lower),
                        at(patch.transfer, i));
                });
  if (order == step.model->analysis.transfer.order)
    prescribe_last(patch, step);
  else
    prescribe(patch, step);
}

template <int Dim>
void finish_filter(Patch<Dim>& patch, const StepContext<Dim>& step) {
  const VelocityTransfer& transfer = step.model->analysis.transfer;
  const double viscous = transfer.taken_by_viscosity(step.dt);
  const double per_viscosity = transfer.per_viscosity;
  const auto bodies = static_cast<Local>(patch.bodies());
  const Local per_body = bodies == 1 ? patch.n_nodes() : patch.body_nodes;
  for (const NodeRange& range : patch.active_nodes)
    for (Local from = range.begin; from < range.end;) {  // node by node of one body
      const Local body = std::min(from / per_body, bodies - 1),
                  end = std::min(range.end, (body + 1) * per_body);
      const double kept = transfer.kept(body, step.dt), taken = 1.0 - kept - viscous;
      for (; from < end; ++from) {
        const auto filtered = load<NodeVector>(at(patch.transfer, from));
        // Where functions are negative in places, so may be a node's mean.
        const double of_node = std::clamp(step.dt * per_viscosity * filtered[mass_lane], 0.0, kept);
        const double change = transfer.filters_change ? (kept - of_node) * step.dt : step.dt;
        NodeVector given =
            taken * filtered + change * load<NodeVector>(at(patch.acceleration, from));
        if (viscous + of_node > 0.0)
          given += (viscous + of_node) * unfiltered(patch, from, transfer.filters_change, step.dt);
        store(with_mass(given, NodeVector(of_node)), at(patch.transfer, from));
      }
    }
}

#define LAHAR_INSTANTIATE(Dim)                                                       \
  template void velocities_before_forces<Dim>(Patch<Dim>&, const StepContext<Dim>&); \
  template void begin_filter<Dim>(Patch<Dim>&, const StepContext<Dim>&);             \
  template void raise_filter<Dim>(Patch<Dim>&, const StepContext<Dim>&, int);        \
  template void finish_filter<Dim>(Patch<Dim>&, const StepContext<Dim>&);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
