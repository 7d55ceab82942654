// Kernels of absorbing boundaries (absorbing_node.h): what their nodes take from particles.
#include <cmath>

#include "physics/basis/any_basis.h"
#include "physics/kernels/kernels.h"
#include "physics/kernels/particle_sums.h"
#include "physics/materials/law.h"

namespace lahar {

namespace {

/// Density [kg/m^3] of a material at the beginning, and speeds of waves [m/s] there. With the
/// present density, which the fork of CB-Geo MPM takes, rho c^2 would not be the modulus any more;
/// the published result (tests/verification/absorbing.cpp) has that of the beginning.
struct WaveSpeeds {
  double rho, compression, shear;
  explicit WaveSpeeds(const Material& material)
      : rho(material.density),
        compression(std::sqrt(wave_modulus(material.law) / material.density)),
        shear(std::sqrt(shear_wave_modulus(material.law) / material.density)) {}
};

/// {m u} and {m c_p, m c_s, m rho, m} of a bin. There are few such particles, those at a boundary.
template <int Dim, class Basis>
void scatter(const Basis& basis, const Patch<Dim>& patch, const ParticleBin& bin,
             const Local* nodes, const WaveSpeeds& c, double* displacement) {
  const auto& particles = patch.particles;
  double* waves = displacement + sum_offset(NodeSum::waves);
  for (Local p = bin.begin; p < bin.end; ++p) {
    const double m = particles.row(Column::mass)[p];
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
void map_waves(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins) {
  if (patch.absorbing.empty()) return;
  static_assert(sum_array(NodeSum::displacement) == sum_array(NodeSum::waves));
  static_assert(sum_offset(NodeSum::displacement) == 0);
  double* sums = patch.own_sums(NodeSum::displacement, step.step);
  for_each_bin_with_basis(
      patch, bins,
      [&](const ParticleBin& bin) {
        return patch.absorbing_cells[static_cast<std::size_t>(bin.cell)] != 0;
      },
      [&](const auto& basis, const ParticleBin& bin, const Local* nodes) {
        scatter(basis, patch, bin, nodes, WaveSpeeds(step.model->materials[bin.material]), sums);
      });
}

template <int Dim>
void clear_waves(Patch<Dim>& patch, const StepContext<Dim>& step) {
  if (!patch.absorbing.empty()) clear_sums_with(patch, step, NodeSum::displacement);
}

#define LAHAR_INSTANTIATE(Dim)                                                      \
  template void map_waves<Dim>(Patch<Dim>&, const StepContext<Dim>&, ParticleBins); \
  template void clear_waves<Dim>(Patch<Dim>&, const StepContext<Dim>&);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
