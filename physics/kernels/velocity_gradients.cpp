#include "physics/kernels/velocity_gradients.h"

#include "physics/basis/cell_map.h"
#include "physics/basis/nodal_fields.h"
#include "physics/kernels/general_kernels.h"

namespace lahar {

namespace {

/// Velocity gradients with the functions of Q4 and H8.
template <int Dim, class Real>
void find_linear_gradients(const Patch<Dim>& patch, ParticleBins bins,
                           VelocityGradients<Dim>& gradients) {
  gradients.make_room(bins, lanes<Real>);
  for_each_bin(
      patch, bins, [&](const auto& map, const ParticleBin& bin) __attribute__((always_inline)) {
        const CornerDifferences<Dim> difference(
            patch.velocity.data(), patch.topology.corner_nodes[static_cast<std::size_t>(bin.cell)]);
        auto to = gradients.begin(bin, bins);
        for (Local p = bin.begin; p < bin.end; p += lanes<Real>, to += lanes<Real>) {
          Real G[Dim][Dim], L[Dim][Dim];
          difference.gradient(weights_at<Dim, Real>(map, p), G);
          map.to_physical(p, G, L);
          gradients.put(to, L, general::trace(L));
        }
      });
}

}  // namespace

template <int Dim, class Real>
void find_particle_gradients(const Patch<Dim>& patch, const StepContext<Dim>& step,
                             ParticleBins bins, VelocityGradients<Dim>& gradients) {
  if (general::is(patch))
    general::find_gradients<Dim, Real>(patch, step, bins, patch.velocity.data(), gradients);
  else
    find_linear_gradients<Dim, Real>(patch, bins, gradients);
}

#define LAHAR_INSTANTIATE(Dim, Real)                                                           \
  template void find_particle_gradients<Dim, Real>(const Patch<Dim>&, const StepContext<Dim>&, \
                                                   ParticleBins, VelocityGradients<Dim>&);
LAHAR_INSTANTIATE(2, KernelReal)
LAHAR_INSTANTIATE(3, KernelReal)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
