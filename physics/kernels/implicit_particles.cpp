/// \file Particles in implicit steps: what they bring to nodes, and what they take when the step
/// has converged.
#include <algorithm>
#include <cmath>
#include <utility>

#include "physics/basis/any_basis.h"
#include "physics/basis/nodal_fields.h"
#include "physics/kernels/implicit.h"
#include "physics/kernels/kernels.h"
#include "physics/kernels/mean_gradients.h"
#include "physics/kernels/mean_volume.h"
#include "physics/kernels/particle_forces.h"
#include "physics/kernels/particle_sums.h"
#include "physics/kernels/particle_update.h"
#include "physics/kernels/ring.h"
#include "physics/particles/loads.h"

namespace lahar {

template <int Dim>
void deliver(Patch<Dim>& patch) {
  receive(patch);
  activate_nodes(patch);
  patch.unmapped.clear();
  patch.idle = false;
  sort_if_scattered(patch);
}

template <int Dim>
void map_inertia(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins) {
  general::ParticleMomentum<Dim> particle;
  particle.m = patch.particles.row(Column::mass);
  particle.v = std::as_const(patch.particles).template rows<Dim>(Column::acceleration);
  map_momentum_of<Dim, Pack>(patch, bins, particle, patch.own_sums(NodeSum::inertia, step.step));
}

template <int Dim>
void find_displacement_gradients(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins,
                                 VelocityGradients<Dim>& gradients) {
  gradients.make_room(bins, lanes<Pack>);
  const bool ring = step.model->analysis.plane == Plane::axisymmetric,
             takes_mean = step.model->analysis.mean_volume && !ring;
  const double* V = patch.particles.row(Column::volume);
  for_each_bin_with_basis(
      patch, bins, [](const ParticleBin&) { return true; },
      [&](const auto& basis, const ParticleBin& bin, const Local* nodes) {
        constexpr int n = std::decay_t<decltype(basis)>::nodes;
        double mean[Dim][n] = {};
        if (takes_mean) mean_gradients<Dim>(basis, bin, V, mean);
        std::size_t to = gradients.begin(bin, bins);
        for (Local p = bin.begin; p < bin.end; ++p, ++to) {
          double g[Dim][n], H[Dim][Dim];
          gradients_at<Dim>(basis, p, g);
          gradient_of<Dim>(g, takes_mean ? mean : nullptr, patch.implicit.increment.data(), nodes,
                           H);
          double trace = 0;
          for (int a = 0; a < Dim; ++a) {
            for (int b = 0; b < Dim; ++b)
              gradients.L[static_cast<std::size_t>(Dim * a + b)][to] = H[a][b] / step.dt;
            trace += H[a][a] / step.dt;
          }
          gradients.trace[to] = trace;
        }
        // Lanes beyond the bin hold what laws can work with.
        for (; to % static_cast<std::size_t>(lanes<Pack>) != 0; ++to) {
          for (auto& row : gradients.L) row[to] = 0.0;
          gradients.trace[to] = 0.0;
        }
      });
  if constexpr (Dim == 2) {
    if (!ring) return;
    add_hoop_rates(patch, bins, patch.implicit.increment.data(), gradients, 1.0 / step.dt);
    if (step.model->analysis.mean_volume) take_mean_volume(patch, step, bins, gradients);
  }
}

template <int Dim>
void move_particles(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins) {
  const Analysis& analysis = step.model->analysis;
  if (!step.model->tractions.empty() || step.model->body_force) {
    const NodeArray none(patch.velocity.size(), 0.0);
    StepContext<Dim> at_end = step;
    at_end.time += step.dt;
    add_work_of_forces(
        patch, step, bins, patch.velocity, none,
        [&](const ParticleBin& bin) { return has_particle_forces(patch, bin, *step.model); },
        [&](Local p) {  // the mean does work
          return mean(applied_force_on(patch.particles, p, step),
                      applied_force_on(patch.particles, p, at_end));
        });
  }
  const bool moves = !analysis.implicit.quasi_static;
  const MovedRows<Dim> rows(patch.particles);
  std::array<double*, Dim> acceleration{};
  if (moves) acceleration = patch.particles.template rows<Dim>(Column::acceleration);
  const double* const fields[3] = {patch.implicit.increment.data(), patch.acceleration.data(),
                                   patch.system.solution.data()};
  Pack fastest(0.0);
  for_each_bin_with_basis(
      patch, bins, [](const ParticleBin&) { return true; },
      [&](const auto& basis, const ParticleBin& bin, const Local* nodes) {
        for (Local p = bin.begin; p < bin.end; p += lanes<Pack>) {
          const Local n = bin.end - p;
          Pack sum[3][Dim], speed2(0.0);
          general::interpolate<Dim, 3, Pack>(basis, p, fields, nodes, sum);
          for (std::size_t d = 0; d < Dim; ++d) {
            store_first(load<Pack>(rows.x[d] + p) + sum[0][d], rows.x[d] + p, n);
            store_first(load<Pack>(rows.u[d] + p) + sum[0][d], rows.u[d] + p, n);
            Pack v(0.0);
            if (moves) {
              Pack change = sum[1][d];
              // The mean of the particle's own acceleration before and the nodes' after.
              if (analysis.as_cbgeo) change = 0.5 * (load<Pack>(acceleration[d] + p) + sum[2][d]);
              v = load<Pack>(rows.v[d] + p) + step.dt * change;
              store_first(sum[2][d], acceleration[d] + p, n);
            }
            store_first(v, rows.v[d] + p, n);
            speed2 += v * v;
          }
          fastest = max(fastest, first_lanes(speed2, n));
        }
      });
  for (int lane = 0; lane < lanes<Pack>; ++lane)
    patch.max_speed = std::max(patch.max_speed, std::sqrt(fastest[lane]));
}

#define LAHAR_INSTANTIATE(Dim)                                                           \
  template void deliver<Dim>(Patch<Dim>&);                                               \
  template void map_inertia<Dim>(Patch<Dim>&, const StepContext<Dim>&, ParticleBins);    \
  template void find_displacement_gradients<Dim>(Patch<Dim>&, const StepContext<Dim>&,   \
                                                 ParticleBins, VelocityGradients<Dim>&); \
  template void move_particles<Dim>(Patch<Dim>&, const StepContext<Dim>&, ParticleBins);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
