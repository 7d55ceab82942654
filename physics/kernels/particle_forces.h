/// \file Forces of their own that few particles have, such as tractions: what nodes get of them,
/// and their work.
#pragma once

#include "physics/basis/any_basis.h"
#include "physics/basis/nodal_fields.h"
#include "physics/particles/contact_couple.h"
#include "physics/particles/loads.h"

namespace lahar {

/// f_i += N_i f for the particles of one bin, with f = force(p) [N].
template <int Dim, class Basis, class Force>
void add_particle_forces(const Basis& basis, const ParticleBin& bin, const Local* nodes,
                         double* sums, Force force) {
  for (Local p = bin.begin; p < bin.end; ++p) {
    const Vec<Dim> f = force(p);
    if (f.isZero(0.0)) continue;
    Scalar N[Basis::nodes];
    basis.functions(p, N);
    for (int i = 0; i < Basis::nodes; ++i)
      for (int d = 0; d < Dim; ++d)
        sums[static_cast<std::ptrdiff_t>(nodes[i]) * sum_stride + d] += N[i][0] * f[d];
  }
}

/// Forces of rigid bodies act at their surfaces: f_i -= C grad N_i, with the couple C [N m] of a
/// particle (rigid_contact.h).
template <int Dim, class Basis>
void add_contact_couples(const Basis& basis, const ParticleBin& bin, const Local* nodes,
                         double* sums, const Particles<Dim>& particles) {
  const auto rows = particles.template rows<contact_components<Dim>>(Column::contact_couple);
  for (Local p = bin.begin; p < bin.end; ++p) {
    const auto C = contact_couple<Dim>(rows, p);
    if (C.isZero(0.0)) continue;
    Scalar dN[Dim][Basis::nodes];
    basis.gradients(p, dN);
    for (int i = 0; i < Basis::nodes; ++i)
      for (int a = 0; a < Dim; ++a)
        for (int b = 0; b < Dim; ++b)
          sums[static_cast<std::ptrdiff_t>(nodes[i]) * sum_stride + a] -= C(a, b) * dN[b][i][0];
  }
}

/// What particles of a bin have of forces of their own, with those of rigid bodies.
template <int Dim, class Basis>
void add_own_forces(const Basis& basis, const Patch<Dim>& patch, const StepContext<Dim>& step,
                    const ParticleBin& bin, const Local* nodes, double* sums) {
  if (!has_particle_forces(patch, bin, *step.model)) return;
  add_particle_forces<Dim>(basis, bin, nodes, sums,
                           [&](Local p) { return force_on(patch.particles, p, step); });
  if (step.model->analysis.rigid_bodies)
    add_contact_couples(basis, bin, nodes, sums, patch.particles);
}

/// Work of these forces over the step, in bins for which takes(bin) is true. It is taken as at
/// nodes, with the mean of their velocities before and after the step, from those after it and the
/// accelerations.
template <int Dim, class Takes, class Force>
void add_work_of_forces(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins,
                        const NodeArray& velocity, const NodeArray& acceleration, Takes takes,
                        Force force) {
  const double* const fields[2] = {velocity.data(), acceleration.data()};
  for_each_bin_with_basis(
      patch, bins, takes, [&](const auto& basis, const ParticleBin& bin, const Local* nodes) {
        for (Local p = bin.begin; p < bin.end; ++p) {
          const Vec<Dim> f = force(p);
          if (f.isZero(0.0)) continue;
          Scalar sum[2][Dim];
          general::interpolate<Dim, 2, Scalar>(basis, p, fields, nodes, sum);
          for (int d = 0; d < Dim; ++d)
            patch.work.external += f[d] * (sum[0][d][0] - 0.5 * step.dt * sum[1][d][0]) * step.dt;
        }
      });
}

}  // namespace lahar
