/// \file Viscous damping of nodes, as of a body in a thick liquid.
#pragma once

#include "physics/kernels/driven_nodes.h"
#include "physics/particles/node_sums.h"
#include "runtime/step/stages.h"

namespace lahar {

/// Rate at which nodes lose velocity [1/s].
inline constexpr double damping_rate = 2.0;

/// The kernel: dv/dt = -rate v, implicit in time. Velocities that are prescribed stay as they are.
template <int Dim>
void damp_nodes(Patch<Dim>& patch, const StepContext<Dim>& step) {
  static thread_local NodeArray before;  // no memory is taken in a step
  before = patch.velocity;
  const auto each_node = [&](auto node) {
    for (const NodeRange& range : patch.active_nodes)
      for (Local i = range.begin; i < range.end; ++i)
        node(i, load<NodeVector>(at(before, i)), at(patch.velocity, i), at(patch.acceleration, i));
  };
  const NodeVector keep(1.0 / (1.0 + damping_rate * step.dt)), per_dt(1.0 / step.dt);
  each_node([&](Local, const NodeVector& old, double* v, double*) {
    store(with_mass(keep * old, old), v);
  });
  prescribe_velocities(patch, patch.velocity);
  // This patch's share of the work: all patches that have a node do the same to it.
  const double* own_mass = patch.own_sums(NodeSum::mass_momentum, step.step) + mass_lane;
  NodeVector twice_work(0.0);
  each_node([&](Local i, const NodeVector& old, double* v, double* a) {
    const auto now = load<NodeVector>(v);
    store(load<NodeVector>(a) + per_dt * (now - old), a);
    const NodeVector own(own_mass[static_cast<std::ptrdiff_t>(i) * sum_stride]);
    twice_work += own * (old * old - now * now);
  });
  for (int d = 0; d < Dim; ++d) patch.work.damping += 0.5 * twice_work[d];
}

/// The stage: once per patch, with nothing from neighbours.
template <int Dim>
Stages<Dim> viscous_damping(const Analysis&) {
  return {TimestepStage<Dim>{
      .stage = {.name = "damping"},
      .begin = [](Patch<Dim>& p, const StepContext<Dim>& s) { damp_nodes(p, s); }}};
}

}  // namespace lahar
