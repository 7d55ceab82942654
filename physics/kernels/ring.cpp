#include "physics/kernels/ring.h"

#include "physics/basis/any_basis.h"

namespace lahar {

template <class Real>
void add_hoop_rates(const Patch<2>& patch, ParticleBins bins, const double* v,
                    VelocityGradients<2>& gradients, double factor) {
  gradients.make_room_for_hoop();
  for_each_bin_with_basis(
      patch, bins, [](const ParticleBin&) { return true; },
      [&](const auto& basis, const ParticleBin& bin, const Local* nodes) {
        constexpr int n = std::decay_t<decltype(basis)>::nodes;
        std::size_t to = gradients.begin(bin, bins);
        for (Local p = bin.begin; p < bin.end; p += lanes<Real>, to += lanes<Real>) {
          Real R[n], outwards(0.0);
          const Real r = ring_functions<Real>(basis, patch, p, bin.end - p, nodes, R);
          for (int i = 0; i < n; ++i)
            outwards = multiply_add(outwards, R[i],
                                    v + static_cast<std::ptrdiff_t>(nodes[i]) * node_width);
          const Real hoop = first_lanes(Real(factor * outwards / r), bin.end - p);
          store(hoop, &gradients.hoop[to]);
          store(Real(load<Real>(&gradients.trace[to]) + hoop), &gradients.trace[to]);
        }
      });
}

template <class Real>
void map_hoop_force(Patch<2>& patch, const StepContext<2>& step, ParticleBin& bin,
                    const general::ParticleStress<2>& stress) {
  constexpr std::size_t zz = 2;
  double* sums = patch.own_sums(NodeSum::force, step.step);
  for_each_bin_with_basis(
      patch, ParticleBins(&bin, 1), [](const ParticleBin&) { return true; },
      [&](const auto& basis, const ParticleBin&, const Local* nodes) {
        constexpr int n = std::decay_t<decltype(basis)>::nodes;
        Real sum[n];
        for (Real& s : sum) s = Real(0.0);
        for (Local p = bin.begin; p < bin.end; p += lanes<Real>) {
          Real R[n];
          const Real sigma = load<Real>(stress.stress[zz] + p);
          const Real r = ring_functions<Real>(basis, patch, p, bin.end - p, nodes, R);
          const Real V = load_first<Real>(stress.V + p, bin.end - p);
          const Real pull = first_lanes(Real(V * sigma / r), bin.end - p);
          for (int i = 0; i < n; ++i) sum[i] += R[i] * pull;
        }
        for (int i = 0; i < n; ++i)
          sums[static_cast<std::ptrdiff_t>(nodes[i]) * sum_stride] -= reduce(sum[i]);
      });
}

template void add_hoop_rates<KernelReal>(const Patch<2>&, ParticleBins, const double*,
                                         VelocityGradients<2>&, double);
template void map_hoop_force<KernelReal>(Patch<2>&, const StepContext<2>&, ParticleBin&,
                                         const general::ParticleStress<2>&);

}  // namespace lahar
