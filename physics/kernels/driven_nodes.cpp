// Every copy of a node runs this very code, so that all are equal to the last bit.
#include "physics/kernels/driven_nodes.h"

#include <algorithm>

#include "physics/basis/any_basis.h"
#include "physics/kernels/kernels.h"
#include "physics/kernels/particle_sums.h"
#include "physics/particles/loads.h"
#include "physics/particles/node_sums.h"

namespace lahar {

namespace {

template <int Dim, class Basis>
void scatter(const Basis& basis, const Particles<Dim>& particles, const ParticleBin& bin,
             const Local* nodes, const StepContext<Dim>& step, double* sums) {
  for (Local p = bin.begin; p < bin.end; ++p) {
    const auto prescribed = prescribed_velocity(particles, p, step);
    if (!prescribed.any()) continue;
    const double m = particles.row(Column::mass)[p];
    double mass[node_width] = {}, momentum[node_width] = {};
    for (std::size_t d = 0; d < Dim; ++d) {
      mass[d] = prescribed.along[d] ? m : 0.0;
      momentum[d] = mass[d] * prescribed.velocity[d];
    }
    Scalar N[Basis::nodes];
    basis.functions(p, N);
    for (int i = 0; i < Basis::nodes; ++i) {
      const NodeVector share(N[i][0]);
      general::add_to_node(sums, nodes[i], share * load<NodeVector>(mass));
      general::add_to_node(sums + sum_offset(NodeSum::prescribed_momentum), nodes[i],
                           share * load<NodeVector>(momentum));
    }
  }
}

/// Hold the prescribed velocities of a wall at a driven node. Returns the work of what holds them
/// per mass [J/kg].
template <int Dim>
double hold_at_wall(Patch<Dim>& patch, double dt, Local node) {
  const ConstrainedNode<Dim>* wall = find_node(patch.walls, node);
  if (!wall) return 0.0;
  return hold_velocity(*wall, dt, at(patch.velocity, node), at(patch.acceleration, node));
}

}  // namespace

template <int Dim>
void map_prescribed(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins) {
  static_assert(sum_array(NodeSum::prescribed_mass) == sum_array(NodeSum::prescribed_momentum));
  static_assert(sum_offset(NodeSum::prescribed_mass) == 0);
  if (std::none_of(bins.begin(), bins.end(), [](const ParticleBin& bin) { return bin.loaded; }))
    return;
  double* sums = patch.own_sums(NodeSum::prescribed_mass, step.step);
  for_each_bin_with_basis(
      patch, bins, [](const ParticleBin& bin) { return bin.loaded; },
      [&](const auto& basis, const ParticleBin& bin, const Local* nodes) {
        scatter<Dim>(basis, patch.particles, bin, nodes, step, sums);
      });
}

template <int Dim>
void clear_prescribed(Patch<Dim>& patch, const StepContext<Dim>& step) {
  clear_sums_with(patch, step, NodeSum::prescribed_mass);
}

template <int Dim>
void find_driven_nodes(Patch<Dim>& patch, const StepContext<Dim>& step) {
  patch.driven.clear();
  for_each_node(patch, SumOverPatches<Dim, SumLine>(patch, NodeSum::prescribed_mass, step.step),
                [&](Local i, const SumLine&, const SumLine& sum) {
                  const NodeVector mass = first_of(sum), momentum = second_of(sum);
                  DrivenNode<Dim> node{.node = i};
                  bool any = false;
                  for (std::size_t d = 0; d < Dim; ++d) {
                    const int k = static_cast<int>(d);
                    if (!(mass[k] > patch.least_mass)) continue;
                    node.driven[d] = any = true;
                    node.velocity[d] = momentum[k] / mass[k];
                  }
                  if (any) patch.driven.push_back(node);
                });
}

template <int Dim>
void prescribe_velocities(Patch<Dim>& patch, NodeArray& velocity, bool begins) {
  for (auto& driven : patch.driven) {
    double* v = at(velocity, driven.node);
    for (std::size_t d = 0; d < Dim; ++d) {
      if (!driven.driven[d]) continue;
      if (begins) driven.taken[d] = v[d] - driven.velocity[d];
      v[d] = driven.velocity[d];
    }
  }
  for (const auto& fixed : patch.fixed) at(velocity, fixed.node)[fixed.dir] = fixed.velocity;
  for (const auto& wall : patch.walls) {
    prescribe_velocity(wall, at(velocity, wall.node));
    const Vec<Dim> taken = stop_at_wall(wall, at(velocity, wall.node));
    if (begins) Eigen::Map<Vec<Dim>>(at(patch.acceleration, wall.node)) = taken;
  }
}

template <int Dim>
void finish_driven_nodes(Patch<Dim>& patch, const StepContext<Dim>& step, const Vec<Dim>& gravity) {
  const double* own_mass = patch.own_sums(NodeSum::mass_momentum, step.step) + mass_lane;
  const double dt = step.dt;
  for (const auto& driven : patch.driven) {
    double* v = at(patch.velocity, driven.node);
    double* a = at(patch.acceleration, driven.node);
    const double own = own_mass[static_cast<std::ptrdiff_t>(driven.node) * sum_stride];
    const double m = v[mass_lane];
    for (std::size_t d = 0; d < Dim; ++d) {
      if (!driven.driven[d]) continue;
      if (m > patch.least_mass) {
        const double change = driven.velocity[d] - (v[d] + driven.taken[d]);  // impulse per mass
        const double before = v[d] - 0.5 * dt * a[d];  // mean velocities of the step
        a[d] += change / dt;
        const double mean = driven.velocity[d] - 0.5 * dt * a[d];
        patch.work.external += own * change * driven.velocity[d];
        patch.work.damping += own * change * (driven.velocity[d] - mean);
        patch.work.external += dt * own * gravity[static_cast<int>(d)] * (mean - before);
        if (step.model->analysis.damping > 0.0)
          patch.work.damping += dt * own / m * at(patch.damping, driven.node)[d] * (mean - before);
      }
      v[d] = driven.velocity[d];
    }
    if (m > patch.least_mass) patch.work.external += own * hold_at_wall(patch, dt, driven.node);
  }
}

#define LAHAR_INSTANTIATE(Dim)                                                           \
  template void map_prescribed<Dim>(Patch<Dim>&, const StepContext<Dim>&, ParticleBins); \
  template void clear_prescribed<Dim>(Patch<Dim>&, const StepContext<Dim>&);             \
  template void find_driven_nodes<Dim>(Patch<Dim>&, const StepContext<Dim>&);            \
  template void prescribe_velocities<Dim>(Patch<Dim>&, NodeArray&, bool);                \
  template void finish_driven_nodes<Dim>(Patch<Dim>&, const StepContext<Dim>&, const Vec<Dim>&);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
