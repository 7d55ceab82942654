/// Grid to particle for bases of any support. Lanes are particles.
#include "physics/law.h"
#include "physics/loads.h"
#include "physics/particle_update.h"
#include "physics/support_fields.h"
#include "physics/support_kernels.h"

namespace lahar::supported {

namespace {

/// Velocity of the nodes and its affine part C at the particles from p on: of APIC
/// sum_i N_i v_i (x_i - x_p)^T D^-1 (Jiang et al. 2015), of TPIC, and of APIC where functions are
/// given one by one, the velocity gradient. For linear functions on boxes these are the same.
template <int Dim, class Real, TensorBasis Basis>
LAHAR_INLINE void affine_velocity(const Basis& basis, Affine affine, Local p, const double* v,
                                  const Local* nodes, Real (&value)[Dim], Real (&C)[Dim][Dim]) {
  Real w[Dim][axis_nodes], m[Dim][axis_nodes];
  if (affine == Affine::apic)
    basis.moments(p, w, m);
  else
    basis.weights(p, w, m);
  with_weights<Dim>(w, m, v, nodes, value, C);
}
template <int Dim, class Real, class Basis>
LAHAR_INLINE void affine_velocity(const Basis& basis, Affine, Local p, const double* v,
                                  const Local* nodes, Real (&value)[Dim], Real (&C)[Dim][Dim]) {
  const double* const fields[1] = {v};
  Real sum[1][Dim];
  interpolate<Dim, 1>(basis, p, fields, nodes, sum);
  LAHAR_UNROLL
  for (int d = 0; d < Dim; ++d) value[d] = sum[0][d];
  gradient<Dim, Real>(basis, p, v, nodes, C);
}

/// update_particles() with affine velocities.
template <int Dim, class Real>
Real update_affine(Patch<Dim>& patch, const StepContext<Dim>& step, Runs runs,
                   const VelocityUpdate& update) {
  const MovedRows<Dim> rows(patch.particles);
  const auto affine = patch.particles.template rows<Dim * Dim>(Column::affine);
  const double* v = patch.velocity.data();
  const double* const acceleration[1] = {patch.acceleration.data()};
  Real fastest(0.0);
  for_each_supported_run(
      patch, runs,
      [&](const auto& basis, const Run& run, const Local* nodes) __attribute__((always_inline)) {
        for (Local p = run.begin; p < run.end; p += lanes<Real>) {
          const Local n = run.end - p;
          prefetch(rows.v, p);
          prefetch(rows.u, p);
          prefetch(affine, p);
          Real value[Dim], C[Dim][Dim], a[1][Dim];
          affine_velocity<Dim>(basis, step.model->analysis.affine, p, v, nodes, value, C);
          LAHAR_UNROLL
          for (std::size_t k = 0; k < Dim * Dim; ++k)
            store_first(C[k / Dim][k % Dim], affine[k] + p, n);
          LAHAR_UNROLL
          for (Real& component : a[0]) component = Real(0.0);
          if (update.acceleration != 0.0) interpolate<Dim, 1>(basis, p, acceleration, nodes, a);
          fastest = max(fastest, advance(rows, p, n, value, a[0], update, step.dt));
        }
        if (run.loaded) prescribe_velocities(patch, run, step);
      });
  return fastest;
}

}  // namespace

template <int Dim, class Real>
void update_particles(Patch<Dim>& patch, const StepContext<Dim>& step, Runs runs) {
  const VelocityUpdate update(step.model->analysis.flip, step.dt);
  if (patch.particles.layout().has(Column::affine))
    return note_speeds(patch, update_affine<Dim, Real>(patch, step, runs, update));
  const MovedRows<Dim> rows(patch.particles);
  const double* const fields[2] = {patch.velocity.data(), patch.acceleration.data()};
  Real fastest(0.0);
  for_each_supported_run(
      patch, runs,
      [&](const auto& basis, const Run& run, const Local* nodes) __attribute__((always_inline)) {
        for (Local p = run.begin; p < run.end; p += lanes<Real>) {
          prefetch(rows.v, p);
          prefetch(rows.u, p);
          Real sum[2][Dim];
          interpolate<Dim, 2, Real>(basis, p, fields, nodes, sum);
          fastest = max(fastest, advance(rows, p, run.end - p, sum[0], sum[1], update, step.dt));
        }
        if (run.loaded) prescribe_velocities(patch, run, step);
      });
  note_speeds(patch, fastest);
}

template <int Dim>
void add_work_of_tractions(Patch<Dim>& patch, const StepContext<Dim>& step, Runs runs) {
  const double* const fields[2] = {patch.velocity.data(), patch.acceleration.data()};
  for_each_supported_run(patch, runs, [&](const auto& basis, const Run& run, const Local* nodes) {
    if (!has_particle_forces(run, *step.model)) return;
    for (Local p = run.begin; p < run.end; ++p) {
      const Vec<Dim> f = force_on(patch.particles, p, step);
      if (f.isZero(0.0)) continue;
      Scalar sum[2][Dim];
      interpolate<Dim, 2, Scalar>(basis, p, fields, nodes, sum);
      for (int d = 0; d < Dim; ++d)  // with the mean velocity of the step, as at nodes
        patch.work.external += f[d] * (sum[0][d][0] - 0.5 * step.dt * sum[1][d][0]) * step.dt;
    }
  });
}

template <int Dim, class Real>
void smooth_pressure(Patch<Dim>& patch, const StepContext<Dim>& step, Runs runs) {
  Particles<Dim>& particles = patch.particles;
  for_each_supported_run(patch, runs, [&](const auto& basis, const Run& run, const Local* nodes) {
    if (!has_pressure(step.model->materials[run.material].law)) return;
    constexpr int n_nodes = std::decay_t<decltype(basis)>::nodes;
    for (Local p = run.begin; p < run.end; p += lanes<Real>) {
      Real N[n_nodes], pressure(0.0);
      basis.functions(p, N);
      for (int i = 0; i < n_nodes; ++i)
        pressure =
            multiply_add(pressure, N[i], &patch.pressure[static_cast<std::size_t>(nodes[i])]);
      store_first(pressure, particles.row(Column::state) + p, run.end - p);
    }
  });
}

#define LAHAR_INSTANTIATE(Dim, Real)                                                     \
  template void update_particles<Dim, Real>(Patch<Dim>&, const StepContext<Dim>&, Runs); \
  template void smooth_pressure<Dim, Real>(Patch<Dim>&, const StepContext<Dim>&, Runs);
LAHAR_INSTANTIATE(2, Pack)
LAHAR_INSTANTIATE(3, Pack)
LAHAR_INSTANTIATE(2, Scalar)
LAHAR_INSTANTIATE(3, Scalar)
template void add_work_of_tractions<2>(Patch<2>&, const StepContext<2>&, Runs);
template void add_work_of_tractions<3>(Patch<3>&, const StepContext<3>&, Runs);

}  // namespace lahar::supported
