// Means of particles around nodes, which conditions of nodes take (NodeMeans).
#include <cmath>

#include "physics/basis/any_basis.h"
#include "physics/kernels/kernels.h"
#include "physics/kernels/particle_sums.h"
#include "physics/materials/law.h"
#include "physics/particles/node_sums.h"

namespace lahar {

namespace {

/// Density [kg/m^3] of a material at the beginning, and speeds of waves [m/s] there; of soils whose
/// stiffness follows the stress, at the present stress of a particle. With the present density,
/// which the fork of CB-Geo MPM takes, rho c^2 would not be the modulus any more; the published
/// result (tests/verification/absorbing.cpp) has that of the beginning.
struct WaveSpeeds {
  double rho, compression, shear;
  explicit WaveSpeeds(const Material& material)
      : WaveSpeeds(material, {wave_modulus(material.law), shear_wave_modulus(material.law)}) {}
  WaveSpeeds(const Material& material, const WaveModuli& at)
      : rho(material.density),
        compression(std::sqrt(at.compression / material.density)),
        shear(std::sqrt(at.shear / material.density)) {}
};

template <int Dim>
WaveSpeeds speeds_at(const Patch<Dim>& patch, const Material& material, Local p) {
  Voigt stress{};
  double state[most_state] = {};
  for (int k = 0; k < stress_components<Dim>; ++k)
    stress[static_cast<std::size_t>(k)] = patch.particles.row(Column::stress, k)[p];
  const auto variables = state_variables(material.law);
  for (std::size_t k = 0; k < variables.size(); ++k)
    if (!variables[k].of_stress)
      state[k] = patch.particles.row(Column::state, static_cast<int>(k))[p];
  return {material, wave_moduli(material.law, stress, state)};
}

/// {m u} and {m c_p, m c_s, m rho, m} of a bin. There are few such particles, those at a boundary.
template <int Dim, class Basis>
void scatter(const Basis& basis, const Patch<Dim>& patch, const ParticleBin& bin,
             const Local* nodes, const Material& material, double* displacement) {
  const auto& particles = patch.particles;
  const bool follows = stiffness_follows_stress(material.law);
  WaveSpeeds c(material);
  double* waves = displacement + sum_offset(NodeSum::waves);
  for (Local p = bin.begin; p < bin.end; ++p) {
    const double m = particles.row(Column::mass)[p];
    if (follows) c = speeds_at(patch, material, p);
    double moment[node_width] = {};
    for (int d = 0; d < Dim; ++d) moment[d] = m * particles.row(Column::u, d)[p];
    const double wave[node_width] = {m * c.compression, m * c.shear, m * c.rho, m};
    Scalar N[Basis::nodes];
    basis.functions(p, N);
    for (int i = 0; i < Basis::nodes; ++i) {
      const NodeVector share(N[i][0]);
      general::add_to_node(displacement, nodes[i], share * load<NodeVector>(moment));
      general::add_to_node(waves, nodes[i], share * load<NodeVector>(wave));
    }
  }
}

}  // namespace

template <int Dim>
void map_means(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins) {
  if (!patch.takes_means()) return;
  static_assert(sum_array(NodeSum::displacement) == sum_array(NodeSum::waves));
  static_assert(sum_offset(NodeSum::displacement) == 0);
  double* sums = patch.own_sums(NodeSum::displacement, step.step);
  for_each_bin_with_basis(
      patch, bins,
      [&](const ParticleBin& bin) {
        return patch.cells_of_means[static_cast<std::size_t>(bin.cell)] != 0;
      },
      [&](const auto& basis, const ParticleBin& bin, const Local* nodes) {
        scatter(basis, patch, bin, nodes, step.model->materials[bin.material], sums);
      });
}

template <int Dim>
void clear_means(Patch<Dim>& patch, const StepContext<Dim>& step) {
  if (patch.takes_means()) clear_sums_with(patch, step, NodeSum::displacement);
}

template <int Dim>
void set_node_means(Patch<Dim>& patch, const StepContext<Dim>& step) {
  if (!patch.takes_means() || patch.active_nodes.empty()) return;
  const SumOverPatches<Dim, SumLine> sums(patch, NodeSum::displacement, step.step);  // and waves
  const auto set = [&](Local node, NodeMeans<Dim>& means) {
    means = {};
    if (!patch.node_is_active[static_cast<std::size_t>(node)]) return;
    const SumLine sum = sums.at(node);
    double u[node_width], waves[node_width];
    store(first_of(sum), u);
    store(second_of(sum), waves);
    if (!more_than(waves[mass_lane], patch.least_mass)) return;
    const double per_mass = 1.0 / waves[mass_lane];
    means.mass = waves[mass_lane];
    means.compression = waves[0] * per_mass;
    means.shear = waves[1] * per_mass;
    means.density = waves[2] * per_mass;
    for (int d = 0; d < Dim; ++d) means.displacement[d] = u[d] * per_mass;
  };
  for_each_acting_list(patch.acting, [&]<class T>(std::vector<ActingNode<Dim, T>>& list) {
    if (takes_means<T>)
      for (auto& at : list) set(at.node, at.means);
  });
}

#define LAHAR_INSTANTIATE(Dim)                                                      \
  template void map_means<Dim>(Patch<Dim>&, const StepContext<Dim>&, ParticleBins); \
  template void clear_means<Dim>(Patch<Dim>&, const StepContext<Dim>&);             \
  template void set_node_means<Dim>(Patch<Dim>&, const StepContext<Dim>&);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
