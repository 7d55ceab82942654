/// \file What the nodes of a body and of the liquid in its pores do alike, each with their arrays.
#pragma once

#include "physics/particles/node_sums.h"

namespace lahar {

/// A point force, and a condition, act on the first of the bodies that are at their node.
template <int Dim>
bool is_first_body(const Patch<Dim>& patch, Local node) {
  if (patch.bodies() == 1) return true;
  for (Local other = node - patch.body_nodes; other >= 0; other -= patch.body_nodes)
    if (at(patch.velocity, other)[mass_lane] > patch.least_mass) return false;
  return true;
}

/// {v, m} from sums of momentum and mass.
template <int Dim>
void take_velocity(Patch<Dim>& patch, const StepContext<Dim>& step, NodeSum which,
                   NodeArray& velocity) {
  for_each_node(patch, SumOverPatches<Dim>(patch, which, step.step),
                [&](Local i, const NodeVector&, const NodeVector& sum) {
                  store(velocity_of(patch, sum, sum), at(velocity, i));
                });
}

/// v from sums of momentum, with the masses that `velocity` has.
template <int Dim>
void take_velocity_again(Patch<Dim>& patch, const StepContext<Dim>& step, NodeSum which,
                         NodeArray& velocity) {
  for_each_node(patch, SumOverPatches<Dim>(patch, which, step.step),
                [&](Local i, const NodeVector&, const NodeVector& sum) {
                  double* v = at(velocity, i);
                  store(velocity_of(patch, sum, load<NodeVector>(v)), v);
                });
}

/// What a velocity transfer takes that does not blend is what nodes got in the step, counted here,
/// and particles did not (Advanced::lost). `own_mass` are the masses that this patch gave.
template <int Dim>
void count_transfer(Patch<Dim>& patch, const StepContext<Dim>& step, const double* own_mass,
                    const NodeArray& velocity, const NodeArray& acceleration) {
  NodeVector got(0.0);
  for (const NodeRange& range : patch.active_nodes)
    for (Local i = range.begin; i < range.end; ++i) {
      const auto a = load<NodeVector>(at(acceleration, i));
      const auto mean = load<NodeVector>(at(velocity, i)) - (0.5 * step.dt) * a;
      got += own_mass[static_cast<std::ptrdiff_t>(i) * sum_stride] * (a * mean);
    }
  for (int d = 0; d < Dim; ++d) patch.work.damping += step.dt * got[d];
}

}  // namespace lahar
