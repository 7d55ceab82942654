#include <algorithm>

#include "physics/kernels/kernels.h"
#include "physics/particles/node_sums.h"

namespace lahar {

namespace {

void append(NodeArray& to, const NodeVector& values) {
  to.resize(to.size() + node_width);
  store(values, to.data() + to.size() - node_width);
}

/// {v, m} and {a, 0} of a node.
struct NodeMotion {
  NodeVector velocity, acceleration;
};

template <int Dim>
NodeMotion motion_of(const Patch<Dim>& patch, Local node) {
  return {load<NodeVector>(at(patch.velocity, node)),
          load<NodeVector>(at(patch.acceleration, node))};
}

/// Of bodies that meet at a node, all together: their mass, and means by mass.
template <int Dim>
NodeMotion mean_of_bodies(const Patch<Dim>& patch, Local node) {
  NodeVector momentum(0.0), force(0.0);
  double mass = 0.0;
  for (Local i = node; i < patch.n_nodes(); i += patch.body_nodes) {
    const NodeMotion own = motion_of(patch, i);
    const double m = own.velocity[mass_lane];
    mass += m;
    momentum += m * own.velocity;
    force += m * own.acceleration;
  }
  NodeVector with(0.0);
  if (mass == 0.0) return {with, with};
  double values[node_width] = {};
  values[mass_lane] = mass;
  with = load<NodeVector>(values);
  const NodeVector per_mass(1.0 / mass);
  return {with_mass(per_mass * momentum, with), with_mass(per_mass * force, NodeVector(0.0))};
}

}  // namespace

template <int Dim>
void show_nodes(Patch<Dim>& patch, const StepContext<Dim>& step) {
  ShownNodes& shown = patch.shown_nodes;
  shown.step = step.step;
  shown.node.clear();
  shown.velocity.clear();
  shown.acceleration.clear();
  const bool several = patch.bodies() > 1;
  const Local end = several ? patch.body_nodes : patch.n_nodes();
  for (const NodeRange& range : patch.active_nodes)
    for (Local i = range.begin; i < std::min(range.end, end); ++i) {
      const NodeMotion motion = several ? mean_of_bodies(patch, i) : motion_of(patch, i);
      if (motion.velocity[mass_lane] == 0.0) continue;
      shown.node.push_back(i);
      append(shown.velocity, motion.velocity);
      append(shown.acceleration, motion.acceleration);
    }
}

template void show_nodes<2>(Patch<2>&, const StepContext<2>&);
template void show_nodes<3>(Patch<3>&, const StepContext<3>&);

}  // namespace lahar
