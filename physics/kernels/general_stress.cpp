/// \file Velocity gradients at particles, for bases of any support.
#include "physics/basis/nodal_fields.h"
#include "physics/kernels/general_kernels.h"

namespace lahar::general {

template <int Dim, class Real>
void find_gradients(const Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins,
                    const double* v, VelocityGradients<Dim>& gradients) {
  if (has_corners(patch)) return find_domain_gradients<Dim, Real>(patch, bins, v, gradients);
  gradients.make_room(bins, lanes<Real>);
  for_each_general_bin(
      patch, bins,
      [&](const auto& basis, const ParticleBin& bin, const Local* nodes)
          __attribute__((always_inline)) {
            const auto of_cell = rate_of_cell<Dim>(basis, step.model->analysis, v, nodes);
            auto to = gradients.begin(bin, bins);
            for (Local p = bin.begin; p < bin.end; p += lanes<Real>, to += lanes<Real>) {
              Real L[Dim][Dim];
              gradient<Dim, Real>(basis, p, v, nodes, L);
              gradients.put(to, L, of_cell ? Real(*of_cell) : trace(L));
            }
          });
}

#define LAHAR_INSTANTIATE(Dim, Real)                                                  \
  template void find_gradients<Dim, Real>(const Patch<Dim>&, const StepContext<Dim>&, \
                                          ParticleBins, const double*, VelocityGradients<Dim>&);
LAHAR_INSTANTIATE(2, KernelReal)
LAHAR_INSTANTIATE(3, KernelReal)

}  // namespace lahar::general
