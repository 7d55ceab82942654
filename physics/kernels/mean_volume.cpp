#include "physics/kernels/mean_volume.h"

#include <algorithm>
#include <limits>

#include "physics/basis/cell_map.h"
#include "physics/basis/nodal_fields.h"
#include "physics/kernels/general_kernels.h"
#include "physics/kernels/particle_sums.h"

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

/// sum_p V_p q_p / sum_p V_p over a bin; `q(p)` of the particles from p on.
template <class Real, class Quantity>
LAHAR_INLINE double mean_of(const ParticleBin& bin, const double* V, Quantity q) {
  Real sum(0.0), volume(0.0);
  for (Local p = bin.begin; p < bin.end; p += lanes<Real>) {
    const Local n = bin.end - p;
    const Real V_p = load_first<Real>(V + p, n);
    sum += first_lanes(Real(V_p * q(p)), n);
    volume += V_p;
  }
  return reduce(sum) / reduce(volume);
}

/// The stress sigma' of some bins, in a buffer: only normal components differ from the particles'.
template <int Dim, class Real>
general::ParticleStress<Dim> mean_stress(const Patch<Dim>& patch, ParticleBins bins) {
  static thread_local std::array<NodeArray, Dim> normal;
  Local begin = std::numeric_limits<Local>::max(), end = 0;
  for (const ParticleBin& bin : bins) {
    begin = std::min(begin, bin.begin);
    end = std::max(end, bin.end);
  }
  const auto room = static_cast<std::size_t>(std::max(end - begin, 0) + lanes<Real>);
  general::ParticleStress<Dim> stress(patch.particles);
  const std::array<const double*, stress_components<Dim>> sigma = stress.stress;
  for (std::size_t d = 0; d < Dim; ++d) {
    normal[d].assign(room, 0.0);  // lanes beyond a bin are multiplied by zero
    stress.stress[d] = normal[d].data() - begin;
  }
  const auto trace = [&](Local p) __attribute__((always_inline)) {
    Real sum = load<Real>(sigma[0] + p) + load<Real>(sigma[1] + p);
    if constexpr (Dim == 3) sum += load<Real>(sigma[2] + p);
    return sum;
  };
  for (const ParticleBin& bin : bins) {
    if (bin.begin == bin.end) continue;
    const double mean = mean_of<Real>(bin, stress.V, trace);
    for (Local p = bin.begin; p < bin.end; p += lanes<Real>) {
      const Real more = (mean - trace(p)) * (1.0 / Dim);
      LAHAR_UNROLL
      for (std::size_t d = 0; d < Dim; ++d)
        store_first(Real(load<Real>(sigma[d] + p) + more), normal[d].data() + (p - begin),
                    bin.end - p);
    }
  }
  return stress;
}

}  // namespace

template <int Dim, class Real>
void take_mean_volume(const Patch<Dim>& patch, ParticleBins bins,
                      VelocityGradients<Dim>& gradients) {
  const double* V = patch.particles.row(Column::volume);
  const auto trace_at = [&](std::size_t at) __attribute__((always_inline)) {
    Real sum = load<Real>(&gradients.L[0][at]) + load<Real>(&gradients.L[Dim + 1][at]);
    if constexpr (Dim == 3) sum += load<Real>(&gradients.L[8][at]);
    return sum;
  };
  for (const ParticleBin& bin : bins) {
    if (bin.begin == bin.end) continue;
    const auto first = gradients.begin(bin, bins);
    const double mean = mean_of<Real>(
        bin, V, [&](Local p) __attribute__((always_inline)) {
          return trace_at(first + static_cast<std::size_t>(p - bin.begin));
        });
    for (Local p = bin.begin; p < bin.end; p += lanes<Real>) {
      const auto at = first + static_cast<std::size_t>(p - bin.begin);
      const Real more = (mean - trace_at(at)) * (1.0 / Dim);
      LAHAR_UNROLL
      for (std::size_t d = 0; d < Dim; ++d) {
        double* L = &gradients.L[(Dim + 1) * d][at];
        store(Real(load<Real>(L) + more), L);
      }
      store(Real(mean), &gradients.trace[at]);
    }
  }
}

template <int Dim, class Real>
void find_mean_gradients(const Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins,
                         VelocityGradients<Dim>& gradients) {
  if (general::is(patch))
    general::find_gradients<Dim, Real>(patch, step, bins, patch.velocity.data(), gradients);
  else
    find_linear_gradients<Dim, Real>(patch, bins, gradients);
  take_mean_volume<Dim, Real>(patch, bins, gradients);
}

template <int Dim, class Real>
void map_mean_force(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins) {
  map_force_of<Dim, Real>(patch, step, bins, mean_stress<Dim, Real>(patch, bins));
}

#define LAHAR_INSTANTIATE(Dim, Real)                                                       \
  template void take_mean_volume<Dim, Real>(const Patch<Dim>&, ParticleBins,               \
                                            VelocityGradients<Dim>&);                      \
  template void find_mean_gradients<Dim, Real>(const Patch<Dim>&, const StepContext<Dim>&, \
                                               ParticleBins, VelocityGradients<Dim>&);     \
  template void map_mean_force<Dim, Real>(Patch<Dim>&, const StepContext<Dim>&, ParticleBins);
LAHAR_INSTANTIATE(2, KernelReal)
LAHAR_INSTANTIATE(3, KernelReal)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
