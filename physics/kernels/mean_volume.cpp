#include "physics/kernels/mean_volume.h"

#include <algorithm>
#include <limits>

#include "physics/basis/cell_map.h"
#include "physics/basis/nodal_fields.h"
#include "physics/kernels/particle_sums.h"
#include "physics/kernels/ring.h"

namespace lahar {

namespace {

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

/// The stress sigma' of some bins, in a buffer: only normal components differ from the particles',
/// of so many axes.
template <int Axes, int Dim, class Real>
general::ParticleStress<Dim> mean_stress(const Patch<Dim>& patch, const StepContext<Dim>& step,
                                         ParticleBins bins) {
  static thread_local std::array<NodeArray, Axes> normal;
  Local begin = std::numeric_limits<Local>::max(), end = 0;
  for (const ParticleBin& bin : bins) {
    begin = std::min(begin, bin.begin);
    end = std::max(end, bin.end);
  }
  const auto room = static_cast<std::size_t>(std::max(end - begin, 0) + lanes<Real>);
  general::ParticleStress<Dim> stress(patch.particles);
  const std::array<const double*, stress_components<Dim>> sigma = stress.stress;
  for (std::size_t d = 0; d < Axes; ++d) {
    normal[d].assign(room, 0.0);  // lanes beyond a bin are multiplied by zero
    stress.stress[d] = normal[d].data() - begin;
  }
  const auto trace = [&](Local p) __attribute__((always_inline)) {
    Real sum = load<Real>(sigma[0] + p) + load<Real>(sigma[1] + p);
    if constexpr (Axes == 3) sum += load<Real>(sigma[2] + p);
    return sum;
  };
  for (const ParticleBin& bin : bins) {
    if (bin.begin == bin.end) continue;
    const bool own = acts_at_centre(patch, step, bin);
    const double mean = mean_of<Real>(bin, stress.V, trace);
    for (Local p = bin.begin; p < bin.end; p += lanes<Real>) {
      const Real more = own ? Real(0.0) : Real((mean - trace(p)) * (1.0 / Axes));
      LAHAR_UNROLL
      for (std::size_t d = 0; d < Axes; ++d)
        store_first(Real(load<Real>(sigma[d] + p) + more), normal[d].data() + (p - begin),
                    bin.end - p);
    }
  }
  return stress;
}

/// L' in place of L, with strain rates along so many axes.
template <std::size_t Axes, int Dim, class Real>
void take_mean_trace(const Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins,
                     const std::array<NodeArray*, Axes>& rates, VelocityGradients<Dim>& gradients) {
  const double* V = patch.particles.row(Column::volume);
  const auto trace_at = [&](std::size_t at) __attribute__((always_inline)) {
    Real sum = load<Real>(&(*rates[0])[at]) + load<Real>(&(*rates[1])[at]);
    if constexpr (Axes == 3) sum += load<Real>(&(*rates[2])[at]);
    return sum;
  };
  for (const ParticleBin& bin : bins) {
    if (bin.begin == bin.end || acts_at_centre(patch, step, bin)) continue;
    const auto first = gradients.begin(bin, bins);
    const double mean = mean_of<Real>(
        bin, V, [&](Local p) __attribute__((always_inline)) {
          return trace_at(first + static_cast<std::size_t>(p - bin.begin));
        });
    for (Local p = bin.begin; p < bin.end; p += lanes<Real>) {
      const auto at = first + static_cast<std::size_t>(p - bin.begin);
      const Real more = (mean - trace_at(at)) * (1.0 / Axes);
      LAHAR_UNROLL
      for (NodeArray* row : rates) {
        double* rate = &(*row)[at];
        store(Real(load<Real>(rate) + more), rate);
      }
      store(Real(mean), &gradients.trace[at]);
    }
  }
}

/// The trace of the cell's centre, where it counts.
template <int Dim>
void take_centre_trace(const Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins,
                       VelocityGradients<Dim>& gradients) {
  if (general::is(patch)) return;
  for_each_bin(patch, bins, [&](const auto& map, const ParticleBin& bin) {
    if (!acts_at_centre(patch, step, bin)) return;
    const CornerDifferences<Dim> difference(
        patch.velocity.data(), patch.topology.corner_nodes[static_cast<std::size_t>(bin.cell)]);
    double natural[Dim][Dim], L[Dim][Dim];
    difference.centre_gradient(natural);
    map.to_physical_centre(natural, L);
    const auto first = static_cast<std::ptrdiff_t>(gradients.begin(bin, bins));
    std::fill_n(gradients.trace.begin() + first, bin.end - bin.begin, general::trace(L));
  });
}

}  // namespace

template <int Dim, class Real>
void take_mean_volume(const Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins,
                      VelocityGradients<Dim>& gradients) {
  auto& L = gradients.L;
  take_centre_trace(patch, step, bins, gradients);
  if constexpr (Dim == 3) {
    take_mean_trace<3, 3, Real>(patch, step, bins, {&L[0], &L[4], &L[8]}, gradients);
  } else {
    if (step.model->analysis.plane == Plane::axisymmetric)
      take_mean_trace<3, 2, Real>(patch, step, bins, {&L[0], &L[3], &gradients.hoop}, gradients);
    else
      take_mean_trace<2, 2, Real>(patch, step, bins, {&L[0], &L[3]}, gradients);
  }
}

template <int Dim, class Real>
void find_mean_gradients(const Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins,
                         VelocityGradients<Dim>& gradients) {
  find_particle_gradients<Dim, Real>(patch, step, bins, gradients);
  if constexpr (Dim == 2)
    if (step.model->analysis.plane == Plane::axisymmetric)
      add_hoop_rates<Real>(patch, bins, patch.velocity.data(), gradients);
  take_mean_volume<Dim, Real>(patch, step, bins, gradients);
}

template <int Dim, class Real>
void map_mean_force(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins) {
  if (step.model->analysis.plane == Plane::axisymmetric)
    return map_force_of<Dim, Real>(patch, step, bins, mean_stress<3, Dim, Real>(patch, step, bins));
  map_force_of<Dim, Real>(patch, step, bins, mean_stress<Dim, Dim, Real>(patch, step, bins));
}

#define LAHAR_INSTANTIATE(Dim, Real)                                                       \
  template void take_mean_volume<Dim, Real>(const Patch<Dim>&, const StepContext<Dim>&,    \
                                            ParticleBins, VelocityGradients<Dim>&);        \
  template void find_mean_gradients<Dim, Real>(const Patch<Dim>&, const StepContext<Dim>&, \
                                               ParticleBins, VelocityGradients<Dim>&);     \
  template void map_mean_force<Dim, Real>(Patch<Dim>&, const StepContext<Dim>&, ParticleBins);
LAHAR_INSTANTIATE(2, KernelReal)
LAHAR_INSTANTIATE(3, KernelReal)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
