/// \file Grid to particle for bases of any support. Lanes are particles.
#include "physics/basis/nodal_fields.h"
#include "physics/basis/spline_polynomials.h"
#include "physics/kernels/affine_velocity.h"
#include "physics/kernels/cpdi2_motion.h"
#include "physics/kernels/general_kernels.h"
#include "physics/kernels/particle_update.h"
#include "physics/kernels/separation.h"
#include "physics/materials/law.h"
#include "physics/particles/loads.h"

namespace lahar::general {

namespace {

/// update_particles() with affine velocities; `gradients` (optional) of domains with corners.
template <int Dim, class Real>
void update_affine(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins,
                   VelocityUpdates<Dim>& updates, VelocityGradients<Dim>* gradients) {
  if (gradients) find_gradients<Dim, Real>(patch, step, bins, patch.velocity.data(), *gradients);
  const MovedRows<Dim> rows(patch.particles);
  const auto affine = patch.particles.template rows<Dim * Dim>(Column::affine);
  const double* v = patch.velocity.data();
  const double* spread = spreads_before_forces(step.model->analysis) ? patch.transfer.data() : v;
  const double* const acceleration[1] = {updates.field(patch)};
  CornerMotion<Dim> corners_of(patch, step.dt);
  PrescribedMotion<Dim> prescribed(patch, step);
  Advanced<Real> all;
  for_each_general_bin(
      patch, bins,
      [&](const auto& basis, const ParticleBin& bin,
          const Local* nodes) __attribute__((always_inline)) {
        prescribed.begin(bin);
        const VelocityUpdate update = updates.of(bin);
        for (Local p = bin.begin; p < bin.end; p += lanes<Real>) {
          const Local n = bin.end - p;
          prefetch(rows.v, p);
          prefetch(rows.u, p);
          prefetch(affine, p);
          Real value[Dim], C[Dim][Dim], a[1][Dim];
          affine_velocity<Dim>(basis, step.model->analysis.affine, p, v, spread, nodes, value, C);
          LAHAR_UNROLL
          for (std::size_t k = 0; k < Dim * Dim; ++k)
            store_first(C[k / Dim][k % Dim], affine[k] + p, n);
          LAHAR_UNROLL
          for (Real& component : a[0]) component = Real(0.0);
          if (update.acceleration != 0.0) interpolate<Dim, 1>(basis, p, acceleration, nodes, a);
          corners_of.move(basis, p, n, v, nodes, value);
          advance(rows, p, n, value, a[0], Real(0.0), update, step.dt, updates.mass(), all);
        }
        prescribed.end(bin);
      });
  note(patch, all);
}

/// update_particles() that also finds velocity gradients.
template <Wanted wanted, int Dim, class Real>
void update_with_gradients(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins,
                           VelocityUpdates<Dim>& updates, VelocityGradients<Dim>& gradients) {
  gradients.make_room(bins, lanes<Real>);
  const MovedRows<Dim> rows(patch.particles);
  std::array<double*, static_cast<std::size_t>(Dim) * Dim> affine{};
  const bool is_affine = patch.particles.layout().has(Column::affine);
  if (is_affine) affine = patch.particles.template rows<Dim * Dim>(Column::affine);
  const double *v = patch.velocity.data(), *a = updates.field(patch),
               *shares = updates.shares_of_nodes(patch);
  SplinePolynomials polynomials(patch.topology, v);
  PrescribedMotion<Dim> prescribed(patch, step);
  Advanced<Real> all;
  for_each_tensor_bin(
      patch, bins,
      [&](const auto& basis, const ParticleBin& bin, const Local* nodes)
          __attribute__((always_inline)) {
            using Basis = std::decay_t<decltype(basis)>;
            constexpr bool polynomial = Dim == 3 && Basis::per_particle < axis_nodes && !wanted.a;
            if constexpr (polynomial) polynomials.move_to(bin.cell);
            const auto of_cell = rate_of_cell<Dim>(basis, step.model->analysis, v, nodes);
            const VelocityUpdate update = updates.of(bin);
            auto to = gradients.begin(bin, bins);
            prescribed.begin(bin);
            for (Local p = bin.begin; p < bin.end; p += lanes<Real>, to += lanes<Real>) {
              const Local n = bin.end - p;
              prefetch(rows.v, p);
              prefetch(rows.u, p);
              if (is_affine) prefetch(affine, p);
              Fields<Dim, Real> at;
              if constexpr (polynomial) {
                Real xi[Dim];
                basis.map.natural(p, xi);
                polynomials.template at<wanted.C>(xi, basis.map.per_length, at);
                for (Real& component : at.a) component = Real(0.0);
              } else {
                AxisWeights<Dim, Real> by;
                basis.weights(p, by.w, by.dw);
                if constexpr (wanted.C) basis.moments(p, by.w, by.dw, by.m);
                with_weights<wanted>(by, v, a, nodes, at);
              }
              gradients.put(to, at.L, of_cell ? Real(*of_cell) : trace(at.L));
              if (is_affine) {
                const auto& C = wanted.C ? at.C : at.L;
                LAHAR_UNROLL
                for (std::size_t k = 0; k < Dim * Dim; ++k)
                  store_first(C[k / Dim][k % Dim], affine[k] + p, n);
              }
              const Real taken =
                  shares ? interpolate_component<Real>(basis, p, shares, nodes) : Real(0.0);
              advance(rows, p, n, at.v, at.a, taken, update, step.dt, updates.mass(), all);
            }
            prescribed.end(bin);
          });
  note(patch, all);
}

}  // namespace

template <int Dim, class Real>
void update_particles(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins,
                      VelocityGradients<Dim>* gradients) {
  if (separates(step.model->analysis))
    return update_separable<Dim, Real>(patch, step, bins, gradients);
  const bool is_affine = patch.particles.layout().has(Column::affine);
  if (has_corners(patch) && !is_affine)
    return update_domain_particles<Dim, Real>(patch, step, bins, gradients);
  VelocityUpdates<Dim> updates(patch, step);
  if (gradients && !has_corners(patch)) {
    const auto find = [&]<Wanted wanted>() {
      update_with_gradients<wanted, Dim, Real>(patch, step, bins, updates, *gradients);
    };
    const bool a = updates.need_acceleration();
    if (step.model->analysis.affine == Affine::apic)
      return a ? find.template operator()<Wanted{true, true}>()
               : find.template operator()<Wanted{true, false}>();
    return a ? find.template operator()<Wanted{false, true}>()
             : find.template operator()<Wanted{false, false}>();
  }
  if (is_affine) return update_affine<Dim, Real>(patch, step, bins, updates, gradients);
  const MovedRows<Dim> rows(patch.particles);
  const double* const fields[2] = {patch.velocity.data(), updates.field(patch)};
  const double* const shares = updates.shares_of_nodes(patch);
  CornerMotion<Dim> corners_of(patch, step.dt);
  PrescribedMotion<Dim> prescribed(patch, step);
  Advanced<Real> all;
  for_each_general_bin(
      patch, bins,
      [&](const auto& basis, const ParticleBin& bin, const Local* nodes)
          __attribute__((always_inline)) {
            prescribed.begin(bin);
            const VelocityUpdate update = updates.of(bin);
            for (Local p = bin.begin; p < bin.end; p += lanes<Real>) {
              prefetch(rows.v, p);
              prefetch(rows.u, p);
              Real sum[2][Dim];
              interpolate<Dim, 2, Real>(basis, p, fields, nodes, sum);
              corners_of.move(basis, p, bin.end - p, fields[0], nodes, sum[0]);
              const Real taken =
                  shares ? interpolate_component<Real>(basis, p, shares, nodes) : Real(0.0);
              advance(rows, p, bin.end - p, sum[0], sum[1], taken, update, step.dt, updates.mass(),
                      all);
            }
            prescribed.end(bin);
          });
  note(patch, all);
}

#define LAHAR_INSTANTIATE(Dim, Real)                                                            \
  template void update_particles<Dim, Real>(Patch<Dim>&, const StepContext<Dim>&, ParticleBins, \
                                            VelocityGradients<Dim>*);
LAHAR_INSTANTIATE(2, KernelReal)
LAHAR_INSTANTIATE(3, KernelReal)

}  // namespace lahar::general
