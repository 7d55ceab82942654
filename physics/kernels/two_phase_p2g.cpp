// Particle to grid of a liquid in pores: sums of the kernels that a skeleton has, of other rows.
#include <algorithm>
#include <utility>

#include "physics/basis/any_basis.h"
#include "physics/basis/basis.h"
#include "physics/basis/cell_map.h"
#include "physics/basis/linear_basis.h"
#include "physics/basis/support.h"
#include "physics/kernels/given_pressure.h"
#include "physics/kernels/kernels.h"
#include "physics/kernels/liquid_contact.h"
#include "physics/kernels/particle_forces.h"
#include "physics/kernels/particle_sums.h"
#include "physics/kernels/pore_rows.h"
#include "physics/kernels/two_phase.h"
#include "physics/model/transfer_options.h"
#include "physics/particles/loads.h"
#include "physics/particles/node_sums.h"

namespace lahar {

namespace {

template <int Dim>
void map_liquid(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins, double* sums) {
  const auto [mass] = pore_rows<1>(patch.particles.capacity());
  fill_liquid_mass(patch, *step.model, bins, mass);
  general::ParticleMomentum<Dim> particle;
  particle.m = mass;
  particle.v = std::as_const(patch.particles).template rows<Dim>(Column::liquid_v);
  if (patch.particles.layout().has(Column::liquid_affine))
    particle.C = std::as_const(patch.particles).template rows<Dim * Dim>(Column::liquid_affine);
  map_momentum_of<Dim, Pack>(patch, bins, particle, sums);
}

/// {Q, m_V}_i += sum_p N_i V {n^2 r, rho}: m_V is the mass of the liquid if there were no grains.
template <int Dim>
void map_drag(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins) {
  const auto rows = pore_rows<1 + Dim>(patch.particles.capacity());
  const double* m = patch.particles.row(Column::mass);
  const double* V = patch.particles.row(Column::volume);
  for_each_pore_pack(*step.model, bins, [&](const Pores* pores, Local p, Local n) {
    if (!pores) {
      for (double* row : rows) store_first(Pack(0.0), row + p, n);
      return;
    }
    const PoreLiquid& liquid = pores->liquid();
    const Pack volume = load<Pack>(V + p), all = liquid.density * volume;
    const Pack drag = pores->drag_volume(load<Pack>(m + p), volume) / all;
    store_first(all, rows[0] + p, n);
    for (std::size_t d = 0; d < Dim; ++d)
      store_first(Pack(liquid.resistance[d] * drag), rows[1 + d] + p, n);
  });
  general::ParticleMomentum<Dim> particle;
  particle.m = rows[0];
  for (std::size_t d = 0; d < Dim; ++d) particle.v[d] = rows[1 + d];
  map_momentum_of<Dim, Pack>(patch, bins, particle, patch.own_sums(NodeSum::drag, step.step));
}

/// Share of the pore pressure whose forces act before a projection corrects it.
double acting_share(const Analysis& analysis) {
  return is_projection(analysis) ? analysis.projection.kept : 1.0;
}

/// What the pressure of a particle or bin does to the liquid, of what it does to the mixture.
double share_of_liquid(const Analysis& analysis, double porosity) {
  return has_nodal_porosity(analysis) ? 1.0 : porosity;  // nodes have theirs
}

/// Forces of the pore pressure by gradients at the centres of cells: of a bin there is one sum for
/// the mixture and one for the liquid.
template <int Dim>
void add_pressure_at_centre(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins) {
  const double* V = patch.particles.row(Column::volume);
  const double* pressure = patch.particles.row(Column::pore_pressure);
  double* mixture = patch.own_sums(NodeSum::force, step.step);
  double* liquid = patch.own_sums(NodeSum::liquid_force, step.step);
  const double share = acting_share(step.model->analysis);
  for_each_bin(patch, bins, [&](const auto& map, const ParticleBin& bin) {
    const auto& given = step.model->materials[bin.material].liquid;
    if (!given) return;
    const Pores pores(*given);
    Pack work(0.0);
    for (Local p = bin.begin; p < bin.end; p += lanes<Pack>)
      work += first_lanes(Pack(load<Pack>(V + p) * load<Pack>(pressure + p)), bin.end - p);
    const double porosity = mean_porosity(patch, pores, bin), both = share * reduce(work);  // [J]
    const double one = both * share_of_liquid(step.model->analysis, porosity);
    double dN[Dim][corners<Dim>];
    centre_gradients(map, dN);
    const auto& corner = patch.topology.corner_nodes[static_cast<std::size_t>(bin.cell)];
    for (std::size_t i = 0; i < corner.size(); ++i) {
      const auto at = static_cast<std::ptrdiff_t>(corner[i]) * sum_stride;
      for (int d = 0; d < Dim; ++d) {
        mixture[at + d] += both * dN[d][i];
        liquid[at + d] += one * dN[d][i];
      }
    }
  });
}

/// Forces by gradients at particles. The particles of a bin have the mean of their pressures, as
/// they have the mean of their volumetric strains (update_pore_pressure()): a pressure of each
/// particle would hold more than nodes can follow.
template <int Dim>
void add_pressure_at_particles(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins) {
  const auto rows = pore_rows<2>(patch.particles.capacity());
  const double* m = patch.particles.row(Column::mass);
  const double* V = patch.particles.row(Column::volume);
  const double* pressure = patch.particles.row(Column::pore_pressure);
  const bool each = step.model->analysis.volume_as_cbgeo;
  const double share = acting_share(step.model->analysis);
  for (const ParticleBin& bin : bins) {
    const auto& liquid = step.model->materials[bin.material].liquid;
    const auto row = [&](std::size_t k) { return rows[k] + bin.begin; };
    const Local n = bin.end - bin.begin;
    if (!liquid) {
      for (std::size_t k = 0; k < rows.size(); ++k) std::fill_n(row(k), n, 0.0);
      continue;
    }
    const Pores pores(*liquid);
    double volume = 0, work = 0;
    for (Local p = bin.begin; p < bin.end; ++p) volume += V[p], work += V[p] * pressure[p];
    const double mean = work / volume;
    const double porosity = share_of_liquid(step.model->analysis, mean_porosity(patch, pores, bin));
    for (Local p = bin.begin; p < bin.end; p += lanes<Pack>) {
      const Pack pushed =
          share * load<Pack>(V + p) * (each ? load<Pack>(pressure + p) : Pack(mean));
      store_first(pushed, rows[0] + p, bin.end - p);
      store_first(Pack(pushed * (each ? pores.porosity(load<Pack>(m + p), load<Pack>(V + p))
                                      : Pack(porosity))),
                  rows[1] + p, bin.end - p);
    }
  }
  map_gradient_of<Dim, Pack>(patch, bins, rows[0], patch.own_sums(NodeSum::force, step.step));
  map_gradient_of<Dim, Pack>(patch, bins, rows[1],
                             patch.own_sums(NodeSum::liquid_force, step.step));
}

/// What pressures that are prescribed at nodes do to the mixture and the liquid.
template <int Dim>
void add_given_pressures(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins) {
  const double share = acting_share(step.model->analysis);
  double* mixture = patch.own_sums(NodeSum::force, step.step);
  double* liquid = patch.own_sums(NodeSum::liquid_force, step.step);
  for_given_pressures<Dim>(
      patch, step, bins, [&](const ParticleBin& bin, const Local* nodes, const auto& forces) {
        const double of_liquid =
            has_nodal_porosity(step.model->analysis)
                ? 1.0
                : mean_porosity(patch, Pores(*step.model->materials[bin.material].liquid), bin);
        for (std::size_t i = 0; i < forces.size(); ++i)
          for (int d = 0; d < Dim; ++d) {
            const auto at = static_cast<std::ptrdiff_t>(nodes[i]) * sum_stride + d;
            mixture[at] -= share * forces[i][d];
            liquid[at] -= share * of_liquid * forces[i][d];
          }
      });
}

/// c_i += sum_p n0 rho V N_i (v_l - v) . grad N_i: nodes then have the force -c_i v_l,i, which is
/// not the momentum that the liquid carries, but what the fork of CB-Geo MPM computes.
template <int Dim>
void map_advection(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins) {
  double* sums = patch.own_sums(NodeSum::advection, step.step);
  const double* V = patch.particles.row(Column::volume);
  const auto v = std::as_const(patch.particles).template rows<Dim>(Column::v);
  const auto v_l = std::as_const(patch.particles).template rows<Dim>(Column::liquid_v);
  for_each_bin(patch, bins, [&](const auto& map, const ParticleBin& bin) {
    const auto& liquid = step.model->materials[bin.material].liquid;
    if (!liquid) return;
    const auto& corner = patch.topology.corner_nodes[static_cast<std::size_t>(bin.cell)];
    const LinearBasis<Dim, std::decay_t<decltype(map)>> basis{map};
    for (Local p = bin.begin; p < bin.end; ++p) {
      Scalar N[corners<Dim>], dN[Dim][corners<Dim>];
      basis.functions(p, N);
      basis.gradients(p, dN);
      for (std::size_t i = 0; i < corner.size(); ++i) {
        double along = 0;
        for (std::size_t d = 0; d < Dim; ++d) along += (v_l[d][p] - v[d][p]) * dN[d][i][0];
        sums[static_cast<std::ptrdiff_t>(corner[i]) * sum_stride] +=
            liquid->porosity * liquid->density * V[p] * N[i][0] * along;
      }
    }
  });
}

/// Tractions on the liquid alone.
template <int Dim>
void add_liquid_tractions(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins) {
  if (!has_liquid_tractions(*step.model)) return;
  double* sums = patch.own_sums(NodeSum::liquid_force, step.step);
  for_each_bin_with_basis(
      patch, bins, [](const ParticleBin& bin) { return bin.loaded; },
      [&](const auto& basis, const ParticleBin& bin, const Local* nodes) {
        const Pores pores(*step.model->materials[bin.material].liquid);
        const auto porosity_of = [&](Local p) {
          return pores.porosity(Scalar(patch.particles.row(Column::mass)[p]),
                                Scalar(patch.particles.row(Column::volume)[p]))[0];
        };
        add_particle_forces<Dim>(basis, bin, nodes, sums, [&](Local p) {
          // Nodes multiply all of the force by their porosity.
          auto traction = traction_on(patch.particles, p, step, true);
          if (has_nodal_porosity(step.model->analysis)) traction.force /= porosity_of(p);
          return traction;
        });
      });
}

}  // namespace

template <int Dim>
void map_liquid_mass_momentum(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins) {
  map_liquid(patch, step, bins, patch.own_sums(NodeSum::liquid_mass_momentum, step.step));
}

template <int Dim>
void map_liquid_momentum(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins) {
  map_liquid(patch, step, bins, patch.own_sums(NodeSum::liquid_momentum, step.step));
}

template <int Dim>
void map_liquid_forces(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins) {
  if (general::is(patch) || step.model->analysis.volume_as_cbgeo)
    add_pressure_at_particles(patch, step, bins);
  else
    add_pressure_at_centre(patch, step, bins);
  if (given_pressures_press(step.model->analysis)) add_given_pressures(patch, step, bins);
  add_liquid_tractions(patch, step, bins);
  if (step.model->analysis.rigid_bodies) map_liquid_pushes(patch, step, bins);
  map_drag(patch, step, bins);
  if (step.model->analysis.liquid_advection) map_advection(patch, step, bins);
}

template <int Dim>
void map_pore_pressure(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins) {
  const auto [mass] = pore_rows<1>(patch.particles.capacity());
  fill_liquid_mass(patch, *step.model, bins, mass);
  general::ParticleMomentum<Dim> particle;
  particle.m = mass;
  particle.v.fill(patch.particles.row(Column::pore_pressure));
  map_momentum_of<Dim, Pack>(patch, bins, particle,
                             patch.own_sums(NodeSum::pore_pressure, step.step));
}

#define LAHAR_INSTANTIATE(Dim)                                                                \
  template void map_liquid_mass_momentum(Patch<Dim>&, const StepContext<Dim>&, ParticleBins); \
  template void map_liquid_momentum(Patch<Dim>&, const StepContext<Dim>&, ParticleBins);      \
  template void map_liquid_forces(Patch<Dim>&, const StepContext<Dim>&, ParticleBins);        \
  template void map_pore_pressure(Patch<Dim>&, const StepContext<Dim>&, ParticleBins);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
