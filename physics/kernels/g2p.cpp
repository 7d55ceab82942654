/// \file Grid to particle: velocities and positions, nodal pressure.
#include <algorithm>
#include <cmath>

#include "physics/basis/cell_map.h"
#include "physics/kernels/general_kernels.h"
#include "physics/kernels/kernels.h"
#include "physics/kernels/particle_forces.h"
#include "physics/kernels/particle_update.h"
#include "physics/materials/law.h"
#include "physics/particles/loads.h"

namespace lahar {

namespace {

template <int Dim, class Real, class Map>
LAHAR_INLINE void update_bin(const Patch<Dim>& patch, const Map& map, const ParticleBin& bin,
                             const MovedRows<Dim>& rows, VelocityUpdates<Dim>& updates, double dt,
                             Advanced<Real>& all) {
  const VelocityUpdate update = updates.of(bin);
  const double *change = updates.field(patch), *shares = updates.shares_of_nodes(patch);
  const auto& corner = patch.topology.corner_nodes[static_cast<std::size_t>(bin.cell)];
  const double *node_v[corners<Dim>], *node_a[corners<Dim>];
  LAHAR_UNROLL
  for (std::size_t i = 0; i < corners<Dim>; ++i) {
    node_v[i] = patch.velocity.data() + static_cast<std::ptrdiff_t>(corner[i]) * node_width;
    node_a[i] = change + static_cast<std::ptrdiff_t>(corner[i]) * node_width;
  }
  for (Local p = bin.begin; p < bin.end; p += lanes<Real>) {
    const Local n = bin.end - p;
    prefetch(rows.v, p);
    prefetch(rows.u, p);
    const auto w = weights_at<Dim, Real>(map, p);
    Real v[Dim], a[Dim];
    LAHAR_UNROLL
    for (int i = 0; i < corners<Dim>; ++i) {
      const Real N = w.N(i);
      LAHAR_UNROLL
      for (int d = 0; d < Dim; ++d)
        v[d] = i == 0 ? multiply(N, node_v[i] + d) : multiply_add(v[d], N, node_v[i] + d);
      LAHAR_UNROLL
      for (int d = 0; d < Dim; ++d)
        a[d] = i == 0 ? multiply(N, node_a[i] + d) : multiply_add(a[d], N, node_a[i] + d);
    }
    Real taken(0.0);
    if (shares) {
      LAHAR_UNROLL
      for (std::size_t i = 0; i < corners<Dim>; ++i)
        taken = multiply_add(taken, w.N(static_cast<int>(i)),
                             shares + static_cast<std::ptrdiff_t>(corner[i]) * node_width);
    }
    advance(rows, p, n, v, a, taken, update, dt, updates.mass(), all);
  }
}

}  // namespace

template <int Dim>
void PrescribedMotion<Dim>::keep_places(const ParticleBin& bin) {
  kept_.clear();
  const Particles<Dim>& particles = patch_.particles;
  for (Local p = bin.begin; p < bin.end; ++p) {
    const auto prescribed = prescribed_velocity(particles, p, step_);
    for (int d = 0; d < Dim; ++d)
      if (prescribed.along[static_cast<std::size_t>(d)])
        for (const Column column : {Column::x, Column::u})
          kept_.push_back(particles.row(column, d)[p]);
  }
}

template <int Dim>
void PrescribedMotion<Dim>::prescribe(const ParticleBin& bin) {
  Particles<Dim>& particles = patch_.particles;
  auto kept = kept_.begin();
  for (Local p = bin.begin; p < bin.end; ++p) {
    const auto prescribed = prescribed_velocity(particles, p, step_);
    const double m = particles.row(Column::mass)[p];
    for (int d = 0; d < Dim; ++d) {
      if (!prescribed.along[static_cast<std::size_t>(d)]) continue;
      const double w = prescribed.velocity[static_cast<std::size_t>(d)];
      double& v = particles.row(Column::v, d)[p];
      // What prescribes does work along w; the rest of its impulse's work is lost.
      patch_.work.external += m * (w - v) * w;
      patch_.work.damping += 0.5 * m * (w - v) * (w - v);
      v = w;
      patch_.max_speed = std::max(patch_.max_speed, std::sqrt(Dim) * std::abs(w));
      if (!step_.model->analysis.drives_nodes) continue;
      for (const Column column : {Column::x, Column::u})
        particles.row(column, d)[p] = *kept++ + step_.dt * w;
    }
  }
}

template <int Dim, class Real>
void update_particles(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins,
                      VelocityGradients<Dim>* gradients) {
  if (general::is(patch)) return general::update_particles<Dim, Real>(patch, step, bins, gradients);
  VelocityUpdates<Dim> updates(patch, step);
  const MovedRows<Dim> rows(patch.particles);
  Advanced<Real> all;
  PrescribedMotion<Dim> prescribed(patch, step);
  for_each_bin(
      patch, bins, [&](const auto& map, const ParticleBin& bin) __attribute__((always_inline)) {
        prescribed.begin(bin);
        update_bin<Dim, Real>(patch, map, bin, rows, updates, step.dt, all);
        prescribed.end(bin);
      });
  note(patch, all);
}

template <int Dim>
void add_work_of_tractions(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins,
                           WorkPart part) {
  if (step.model->tractions.empty() && !step.model->body_force) return;
  add_work_of_forces(
      patch, step, bins, patch.velocity, patch.acceleration,
      [&](const ParticleBin& bin) { return has_particle_forces(patch, bin, *step.model); },
      [&](Local p) { return applied_force_on(patch.particles, p, step); }, part);
}

template <int Dim, class Real>
void smooth_pressure(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins) {
  double* pressure = patch.particles.row(Column::state);
  interpolate_bins<Real>(
      patch, bins, patch.pressure.data(),
      [&](const ParticleBin& bin) { return has_pressure(step.model->materials[bin.material].law); },
      [&](Local p, Local n, const Real& value) { store_first(value, pressure + p, n); });
}

#define LAHAR_INSTANTIATE(Dim, Real)                                                            \
  template void update_particles<Dim, Real>(Patch<Dim>&, const StepContext<Dim>&, ParticleBins, \
                                            VelocityGradients<Dim>*);                           \
  template void smooth_pressure<Dim, Real>(Patch<Dim>&, const StepContext<Dim>&, ParticleBins);
LAHAR_INSTANTIATE(2, KernelReal)
LAHAR_INSTANTIATE(3, KernelReal)
template class PrescribedMotion<2>;
template class PrescribedMotion<3>;
template void add_work_of_tractions<2>(Patch<2>&, const StepContext<2>&, ParticleBins, WorkPart);
template void add_work_of_tractions<3>(Patch<3>&, const StepContext<3>&, ParticleBins, WorkPart);

}  // namespace lahar
