/// Grid to particle for bases of any support. Lanes are particles.
#include "physics/basis.h"
#include "physics/law.h"
#include "physics/loads.h"
#include "physics/particle_update.h"
#include "physics/support_kernels.h"

namespace lahar::supported {

namespace {

/// N_i q_i summed over the nodes of a cell, for `Fields` nodal fields of Dim components.
template <int Dim, int Fields, class Real, TensorBasis Basis>
LAHAR_INLINE void interpolate(const Basis& basis, Local p, const double* const (&field)[Fields],
                              const Local* nodes, Real (&sum)[Fields][Dim]) {
  Real w[Dim][axis_nodes];
  basis.weights(p, w);
  LAHAR_UNROLL
  for (int f = 0; f < Fields; ++f) LAHAR_UNROLL
  for (int d = 0; d < Dim; ++d) sum[f][d] = Real(0.0);
  for (int z = 0; z < (Dim == 3 ? axis_nodes : 1); ++z)
    for (int y = 0; y < axis_nodes; ++y) {
      Real plane = w[1][y];
      if constexpr (Dim == 3) plane *= w[2][z];
      LAHAR_UNROLL
      for (int x = 0; x < axis_nodes; ++x) {
        const Real N = plane * w[0][x];
        const auto at = static_cast<std::ptrdiff_t>(nodes[16 * z + 4 * y + x]) * node_width;
        LAHAR_UNROLL
        for (int f = 0; f < Fields; ++f) LAHAR_UNROLL
        for (int d = 0; d < Dim; ++d) sum[f][d] = multiply_add(sum[f][d], N, field[f] + at + d);
      }
    }
}

template <int Dim, int Fields, class Real, class Basis>
LAHAR_INLINE void interpolate(const Basis& basis, Local p, const double* const (&field)[Fields],
                              const Local* nodes, Real (&sum)[Fields][Dim]) {
  Real N[Basis::nodes];
  basis.functions(p, N);
  LAHAR_UNROLL
  for (int f = 0; f < Fields; ++f) LAHAR_UNROLL
  for (int d = 0; d < Dim; ++d) sum[f][d] = Real(0.0);
  LAHAR_UNROLL
  for (int i = 0; i < Basis::nodes; ++i) {
    const auto at = static_cast<std::ptrdiff_t>(nodes[i]) * node_width;
    LAHAR_UNROLL
    for (int f = 0; f < Fields; ++f) LAHAR_UNROLL
    for (int d = 0; d < Dim; ++d) sum[f][d] = multiply_add(sum[f][d], N[i], field[f] + at + d);
  }
}

}  // namespace

template <int Dim, class Real>
void update_particles(Patch<Dim>& patch, const StepContext<Dim>& step, Runs runs) {
  const VelocityUpdate update(step.model->analysis.flip, step.dt);
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
    if (!run.loaded) return;
    for (Local p = run.begin; p < run.end; ++p) {
      const Vec<Dim> f = traction_on(patch.particles, p, step);
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
