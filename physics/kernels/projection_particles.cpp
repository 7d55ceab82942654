/// \file Particles in projections, when the change of the pressure is known.
#include <algorithm>
#include <utility>

#include "physics/basis/any_basis.h"
#include "physics/basis/nodal_fields.h"
#include "physics/kernels/node_supports.h"
#include "physics/kernels/pore_rows.h"
#include "physics/kernels/projection.h"
#include "physics/kernels/strain_rate.h"
#include "physics/materials/law.h"
#include "physics/model/transfer_options.h"

namespace lahar {

namespace {

/// Gradient of a scalar nodal field at the particles from p on.
template <int Dim, int Nodes>
LAHAR_INLINE void gradient_of_scalar(const Pack (&dN)[Dim][Nodes], const double* nodal,
                                     const Local* nodes, Pack (&gradient)[Dim]) {
  for (Pack& component : gradient) component = Pack(0.0);
  LAHAR_UNROLL
  for (int i = 0; i < Nodes; ++i) {
    LAHAR_UNROLL
    for (int d = 0; d < Dim; ++d)
      gradient[d] = multiply_add(gradient[d], dN[d][i], nodal + nodes[i]);
  }
}

template <class LawType>
void find_shear_stress(const LawType& law, const auto& in, auto* stress) {
  using Real = std::decay_t<decltype(*stress)>;
  if constexpr (pressure_is_state<LawType>) {
    Real pressure(0.0);
    law.update(in, stress, &pressure);
  }
}

/// Velocity gradient without its divergence, and the strain rate of it.
template <int Dim>
LAHAR_INLINE LawInput<Dim, Pack> shear_of(const Pack (&L)[Dim][Dim], double dt) {
  LawInput<Dim, Pack> in;
  const Pack mean = general::trace(L) * (1.0 / Dim);
  LAHAR_UNROLL
  for (int a = 0; a < Dim; ++a) LAHAR_UNROLL
  for (int b = 0; b < Dim; ++b) in.gradient[a][b] = a == b ? Pack(L[a][a] - mean) : L[a][b];
  strain_rate<Dim>(in.gradient, in.rate);
  in.dt = dt;
  in.volumetric = Pack(0.0);
  return in;
}

}  // namespace

template <int Dim>
void begin_pressure_forces(Patch<Dim>& patch, const StepContext<Dim>& step) {
  patch.contributes[static_cast<std::size_t>(step.step % 2)] = patch.count > 0;
  begin_supports(patch);
}

template <int Dim>
void add_pressure_forces(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins) {
  const bool two_phase = step.model->analysis.two_phase;
  double* sums = patch.own_sums(NodeSum::force, step.step);
  double* liquid_sums = two_phase ? patch.own_sums(NodeSum::liquid_force, step.step) : nullptr;
  const double* V = patch.particles.row(Column::volume);
  const double* change = patch.projection.change.data();
  const bool measures = !patch.measured.empty();
  std::vector<std::uint8_t> held;
  if (measures) held = held_axes(patch, two_phase);
  const auto is_held = [&](Local node, int d) {
    return (held[static_cast<std::size_t>(node)] >> d & 1) != 0;
  };
  for_each_bin_with_basis(
      patch, bins, [](const ParticleBin&) { return true; },
      [&](const auto& basis, const ParticleBin& bin, const Local* nodes) {
        constexpr int n_nodes = std::decay_t<decltype(basis)>::nodes;
        Pack force[n_nodes][Dim], at_surface[n_nodes][Dim];
        for (int i = 0; i < n_nodes; ++i)
          for (int d = 0; d < Dim; ++d) force[i][d] = at_surface[i][d] = Pack(0.0);
        for (Local p = bin.begin; p < bin.end; p += lanes<Pack>) {
          const Local n = bin.end - p;
          Pack N[n_nodes], dN[Dim][n_nodes], gradient[Dim];
          basis.functions(p, N);
          basis.gradients(p, dN);
          gradient_of_scalar<Dim>(dN, change, nodes, gradient);
          const Pack volume = load_first<Pack>(V + p, n);
          for (int i = 0; i < n_nodes; ++i)
            for (int d = 0; d < Dim; ++d) force[i][d] -= volume * N[i] * gradient[d];
          if (!measures) continue;
          Pack pressure(0.0);
          for (int i = 0; i < n_nodes; ++i) pressure += N[i] * change[nodes[i]];
          for (int i = 0; i < n_nodes; ++i)
            for (int d = 0; d < Dim; ++d)
              at_surface[i][d] += volume * (N[i] * gradient[d] + dN[d][i] * pressure);
        }
        for (int i = 0; i < n_nodes; ++i)
          for (int d = 0; d < Dim; ++d) {
            const auto at = static_cast<std::ptrdiff_t>(nodes[i]) * sum_stride + d;
            const double pushed = reduce(force[i][d]);
            sums[at] += pushed;
            if (two_phase) liquid_sums[at] += pushed;  // nodes multiply by their porosity
          }
        if (!measures) return;
        // Particles that crowd before a wall have more volume than space. They press as what fills
        // it does, and what stops the rest is the wall, too.
        double volume = 0;
        for (Local p = bin.begin; p < bin.end; ++p) volume += V[p];
        const Index cell = patch.topology.cells[static_cast<std::size_t>(bin.cell)];
        const double share = std::min(1.0, step.model->mesh->cell_volume(cell) / volume);
        Vec<Dim> rest = Vec<Dim>::Zero(), holding = Vec<Dim>::Zero();
        for (int i = 0; i < n_nodes; ++i)
          for (int d = 0; d < Dim; ++d) {
            rest[d] -= (1.0 - share) * reduce(force[i][d]);
            holding[d] += is_held(nodes[i], d) ? 1.0 : 0.0;
          }
        for (int i = 0; i < n_nodes; ++i) {
          Vec<Dim> push;
          for (int d = 0; d < Dim; ++d) {
            push[d] = (holding[d] > 0 ? share : 1.0) * reduce(at_surface[i][d]);
            if (is_held(nodes[i], d)) push[d] += rest[d] / holding[d];
          }
          add_support(patch, *step.model, nodes[i], push);
        }
      });
}

template <int Dim>
void update_shear_stress(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins) {
  const auto stress = patch.particles.template rows<stress_components<Dim>>(Column::stress);
  const double* pressure = patch.particles.row(Column::state);
  const double* V = patch.particles.row(Column::volume);
  std::array<double*, strain_components<Dim>> strain{};
  if (patch.particles.layout().has(Column::strain))
    strain = patch.particles.template rows<strain_components<Dim>>(Column::strain);
  Pack work(0.0);
  for_each_bin_with_basis(
      patch, bins, [](const ParticleBin&) { return true; },
      [&](const auto& basis, const ParticleBin& bin, const Local* nodes) {
        for (Local p = bin.begin; p < bin.end; p += lanes<Pack>) {
          const Local n = bin.end - p;
          Pack L[Dim][Dim], s[stress_components<Dim>], power(0.0);
          general::gradient<Dim, Pack>(basis, p, patch.velocity.data(), nodes, L);
          const LawInput<Dim, Pack> in = shear_of<Dim>(L, step.dt);
          const Pack mean = load<Pack>(pressure + p);
          std::visit([&](const auto& law) { find_shear_stress(law, in, s); },
                     step.model->materials[bin.material].law);
          for (std::size_t k = 0; k < stress_components<Dim>; ++k) {
            const Pack part = k < 3 ? mean : Pack(0.0);
            power += (load<Pack>(stress[k] + p) + part + s[k]) * in.rate[k];
            store_first(Pack(s[k] - part), stress[k] + p, n);
          }
          if (strain[0])
            for (std::size_t k = 0; k < strain_components<Dim>; ++k)
              store_first(Pack(load<Pack>(strain[k] + p) + step.dt * in.rate[strain_voigt<Dim>[k]]),
                          strain[k] + p, n);
          work += first_lanes(Pack((0.5 * step.dt) * load<Pack>(V + p) * power), n);
        }
      });
  patch.work.internal += reduce(work);
}

template <int Dim>
void change_pressure(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins) {
  const double kept = step.model->analysis.projection.kept;
  const auto stress = patch.particles.template rows<stress_components<Dim>>(Column::stress);
  double* pressure = patch.particles.row(Column::state);
  interpolate_bins<Pack>(
      patch, bins, patch.projection.change.data(), [](const ParticleBin&) { return true; },
      [&](Local p, Local n, const Pack& change) {
        const Pack before = load<Pack>(pressure + p), after = kept * before + change;
        for (std::size_t k = 0; k < 3; ++k)
          store_first(Pack(load<Pack>(stress[k] + p) + (before - after)), stress[k] + p, n);
        store_first(after, pressure + p, n);
      });
}

template <int Dim>
void change_pore_pressure(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins) {
  double* pressure = patch.particles.row(Column::pore_pressure);
  const double* V = patch.particles.row(Column::volume);
  const double* change = patch.projection.change.data();
  const double kept = step.model->analysis.projection.kept;
  const auto has_pores = has_liquid(*step.model);
  if (!keeps_all_pore_pressure(step.model->analysis))
    return interpolate_bins<Pack>(
        patch, bins, change, has_pores, [&](Local p, Local n, const Pack& dp) {
          store_first(Pack(kept * load<Pack>(pressure + p) + dp), pressure + p, n);
        });
  const double* level = patch.projection.level.data();
  for_each_bin_with_basis(
      patch, bins, has_pores, [&](const auto& basis, const ParticleBin& bin, const Local* nodes) {
        constexpr int n_nodes = std::decay_t<decltype(basis)>::nodes;
        const auto at_particles = [&](Local p, const double* nodal) {
          Pack N[n_nodes], sum(0.0);
          basis.functions(p, N);
          for (int i = 0; i < n_nodes; ++i) sum = multiply_add(sum, N[i], nodal + nodes[i]);
          return sum;
        };
        Pack volume(0.0), before(0.0), changed(0.0), levels(0.0);
        for (Local p = bin.begin; p < bin.end; p += lanes<Pack>) {
          const Local n = bin.end - p;
          const Pack of_particles = load_first<Pack>(V + p, n);
          volume += of_particles;
          before += first_lanes(Pack(of_particles * load<Pack>(pressure + p)), n);
          changed += first_lanes(Pack(of_particles * at_particles(p, change)), n);
          levels += first_lanes(Pack(of_particles * at_particles(p, level)), n);
        }
        const double all = reduce(volume), mean_change = reduce(changed) / all;
        double centre = 0;
        for (int i = 0; i < n_nodes; ++i) centre += change[nodes[i]] / n_nodes;
        const double filled = patch.projection.filled[static_cast<std::size_t>(bin.cell)];
        const double mean =
            reduce(before) / all + mean_change + std::min(1.0, filled) * (centre - mean_change);
        const double offset = mean - reduce(levels) / all;
        for (Local p = bin.begin; p < bin.end; p += lanes<Pack>)
          store_first(Pack(at_particles(p, level) + offset), pressure + p, bin.end - p);
      });
}

#define LAHAR_INSTANTIATE(Dim)                                                                \
  template void begin_pressure_forces<Dim>(Patch<Dim>&, const StepContext<Dim>&);             \
  template void add_pressure_forces<Dim>(Patch<Dim>&, const StepContext<Dim>&, ParticleBins); \
  template void update_shear_stress<Dim>(Patch<Dim>&, const StepContext<Dim>&, ParticleBins); \
  template void change_pressure<Dim>(Patch<Dim>&, const StepContext<Dim>&, ParticleBins);     \
  template void change_pore_pressure<Dim>(Patch<Dim>&, const StepContext<Dim>&, ParticleBins);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
