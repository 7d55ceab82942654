#include "physics/kernels/imbalance.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "physics/kernels/given_pressure.h"
#include "physics/materials/pore_liquid.h"
#include "physics/model/transfer_options.h"
#include "physics/particles/loads.h"
#include "physics/particles/node_sums.h"

namespace lahar {

namespace {

/// What local damping leaves of a force that moves a node on, at least a tenth [-].
double share_after_damping(const Analysis& analysis) {
  return analysis.viscous_damping ? 1.0 : std::max(0.1, 1.0 - analysis.damping);
}

/// Force on the liquid in the pores at a node [N], with `components` of them.
template <int Dim>
Vec<Dim> liquid_force(const Patch<Dim>& patch, Local i) {
  if (patch.liquid.velocity.empty()) return Vec<Dim>::Zero();
  return at(patch.liquid.velocity, i)[mass_lane] *
         Eigen::Map<const Vec<Dim>>(at(patch.liquid.acceleration, i));
}

}  // namespace

template <int Dim>
void find_unbalanced(Patch<Dim>& patch, const StepContext<Dim>& step) {
  if (!tests_rest(step.step + 1)) return;
  double sum = 0;
  if (!patch.active_nodes.empty()) {
    const double* own = patch.own_sums(NodeSum::mass_momentum, step.step) + mass_lane;
    for (const NodeRange& range : patch.active_nodes)
      for (Local i = range.begin; i < range.end; ++i) {
        const double m = at(patch.velocity, i)[mass_lane];
        if (!(m > patch.least_mass)) continue;
        const Vec<Dim> force =
            m * Eigen::Map<const Vec<Dim>>(at(patch.acceleration, i)) + liquid_force(patch, i);
        sum += own[static_cast<std::ptrdiff_t>(i) * sum_stride] / m * force.norm();
      }
  }
  patch.unbalanced = sum / share_after_damping(step.model->analysis);
}

template <int Dim>
double unbalanced_in_system(const Patch<Dim>& patch) {
  double sum = 0;
  if (patch.system.right_side.empty()) return sum;
  for (const NodeRange& range : patch.active_nodes)
    for (Local i = range.begin; i < range.end; ++i) {
      const auto node = static_cast<std::size_t>(i);
      const double m = at(patch.velocity, i)[mass_lane];
      if (!(m > 0)) continue;
      Vec<Dim> force = Vec<Dim>::Zero();
      for (int d = 0; d < Dim; ++d)
        if (!(patch.system.held[node] >> d & 1)) force[d] = at(patch.system.right_side, i)[d];
      sum += patch.implicit.own_mass[node] / m * force.norm();
    }
  return sum;
}

template <int Dim>
double loads_on(const Patch<Dim>& patch, const StepContext<Dim>& step) {
  const NodeVector g = gravity_in(step);
  Vec<Dim> gravity;
  for (int d = 0; d < Dim; ++d) gravity[d] = g[d];
  const Particles<Dim>& particles = patch.particles;
  const double *mass = particles.row(Column::mass), *volume = particles.row(Column::volume);
  double sum = 0;
  for (const ParticleBin& bin : patch.bins) {
    const auto& liquid = step.model->materials[bin.material].liquid;
    for (Local p = bin.begin; p < bin.end; ++p) {
      const double all = mass[p] + liquid_mass_of(liquid, mass[p], volume[p]);
      sum += all * gravity.norm();
      if (has_particle_forces(patch, bin, *step.model))
        sum += applied_force_on(particles, p, step).force.norm();
    }
  }
  for (const auto& point : patch.forces)
    if (patch.topology.owned[static_cast<std::size_t>(point.node)])
      sum += std::abs(point.force * load_factor(*step.model, point.function, step.time));
  if (given_pressures_press(step.model->analysis)) {
    std::vector<ParticleBin> bins = patch.bins;  // kernels take such as they may change
    for_given_pressures<Dim>(patch, step, bins,
                             [&](const ParticleBin&, const Local*, const auto& forces) {
                               for (const Vec<Dim>& force : forces)
                                 sum += force.template lpNorm<1>();
                             });
  }
  return sum;
}

#define LAHAR_INSTANTIATE(Dim)                                              \
  template void find_unbalanced<Dim>(Patch<Dim>&, const StepContext<Dim>&); \
  template double unbalanced_in_system<Dim>(const Patch<Dim>&);             \
  template double loads_on<Dim>(const Patch<Dim>&, const StepContext<Dim>&);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
