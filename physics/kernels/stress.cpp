/// \file Strain increment and constitutive update.
#include "physics/basis/cell_map.h"
#include "physics/kernels/general_kernels.h"
#include "physics/kernels/kernels.h"
#include "physics/kernels/opening.h"
#include "physics/kernels/packed_bins.h"
#include "physics/kernels/stress_across.h"
#include "physics/kernels/stress_update.h"

namespace lahar {

namespace {

/// Velocity gradient in a bin's cell with linear functions, and its trace at the cell's centre.
template <int Dim, class Map>
struct LinearGradient {
  static constexpr bool domains = false;  ///< as StoredGradient
  const Map& map;
  CornerDifferences<Dim> difference;
  double centre_trace = 0.0;

  LAHAR_INLINE LinearGradient(const Patch<Dim>& patch, const Map& cell_map, const ParticleBin& bin)
      : map(cell_map),
        difference(patch.velocity.data(),
                   patch.topology.corner_nodes[static_cast<std::size_t>(bin.cell)]) {
    double Gc[Dim][Dim], Lc[Dim][Dim];
    difference.centre_gradient(Gc);
    map.to_physical_centre(Gc, Lc);
    LAHAR_UNROLL
    for (int d = 0; d < Dim; ++d) centre_trace += Lc[d][d];
  }
  template <class Real>
  LAHAR_INLINE Real at(Local p, Real (&L)[Dim][Dim]) const {
    Real G[Dim][Dim];
    difference.gradient(weights_at<Dim, Real>(map, p), G);
    map.to_physical(p, G, L);
    return Real(centre_trace);
  }
  double least_trace(Local) const { return centre_trace; }
};

/// The particles of one bin.
template <int Dim, class Real>
struct OneBin {
  const ParticleBin& bin;
  const Patch<Dim>& patch;
  double density = 0.0;  ///< density_around(); with gaps
  Real work{0.0};

  Local begin() const { return bin.begin; }
  Local end() const { return bin.end; }
  LAHAR_INLINE Real most_opening(Local p) const {
    return lahar::most_opening<Dim, Real>(patch, density, p);
  }
  LAHAR_INLINE void add(const Real& done, Local, Local n) { work += first_lanes(done, n); }
  void record(Patch<Dim>& patch, Local p, const Failures& failures, const Real* before) const {
    record_failures(patch, bin, p, failures, before);
  }
};

/// Particles with their law and gradients; adds V sigma : d(eps) with the mean stress. With Gaps
/// the column Column::opening is there, and volumes are of the material.
template <bool Gaps, int Dim, class Real, class Some, class Gradient, class LawType>
LAHAR_INLINE void update_some(Patch<Dim>& patch, Some& particles, const Gradient& gradient,
                              const Rows<Dim>& rows, const StepContext<Dim>& step, StressPart part,
                              const LawType& law) {
  const double dt = step.dt;
  const double half = half_for_rotations<LawType>(step.model->analysis, dt);
  for (Local p = particles.begin(); p < particles.end(); p += lanes<Real>) {
    const Local n = particles.end() - p;
    prefetch(rows.stress, p);
    LawInput<Dim, Real> in;
    in.volumetric = gradient.at(p, in.gradient) * dt;
    strain_rate<Dim, Real>(in.gradient, in.rate);
    spin_of<Dim>(in.gradient, in.spin);
    in.turns = step.model->analysis.turns_stress;
    in.dt = dt;
    if (half != 0.0) take_rotation_out(in, half);
    if (step.model->analysis.scheme == Scheme::newmark) {  // increments are not small
      Real H[Dim][Dim];
      LAHAR_UNROLL
      for (int a = 0; a < Dim; ++a) LAHAR_UNROLL
      for (int b = 0; b < Dim; ++b) H[a][b] = dt * in.gradient[a][b];
      in = increment_of<Dim, Real>(H, dt, kinematics_of(step.model->analysis));
    }

    if (part != StressPart::law) {
      if constexpr (Gradient::domains && !Gaps) move_domain(rows, in.gradient, dt, half, p, n);
      add_strain(rows, in, p, n);
      if constexpr (!Gaps)
        store_first(Real(load<Real>(rows.volume + p) * (1.0 + in.volumetric)), rows.volume + p, n);
    }
    if (part != StressPart::strain) {
      constexpr bool may_fail = can_fail<LawType, Dim, Real>;
      Real stress[stress_components<Dim>], power(0.0), state[most_state];
      Real before[may_fail ? stress_components<Dim> : 1];
      LAHAR_UNROLL
      for (std::size_t k = 0; k < stress_components<Dim>; ++k) {
        stress[k] = load<Real>(rows.stress[k] + p);
        power += stress[k] * in.rate[k];
        if constexpr (may_fail) before[k] = stress[k];
      }
      load_state<LawType>(rows.state, p, state);
      Real pressure_before(0.0);
      if constexpr (pressure_is_state<LawType>) pressure_before = state[0];
      if constexpr (may_fail) {
        if (n < lanes<Real>) in.active = (1u << n) - 1;
      }
      const auto apply = [&](const LawInput<Dim, Real>& given) __attribute__((always_inline)) {
        const Failures failures = update(law, given, stress, state);
        if constexpr (may_fail) {
          if (failures.failed | failures.divided) particles.record(patch, p, failures, before);
        }
      };
      if constexpr (Gaps) {
        OpeningIncrement<Dim, Real, LawType> gaps(law, rows.dilatancy, load<Real>(rows.opening + p),
                                                  particles.most_opening(p));
        apply(gaps.close(in, stress, state));
        gaps.open(stress, state);
        store_first(gaps.opening(), rows.opening + p, n);
        store_first(Real(load<Real>(rows.volume + p) * stretch_of(gaps.of_material())),
                    rows.volume + p, n);
        if constexpr (Gradient::domains) {
          Real L[Dim][Dim];
          gaps.of_domain(in, L);
          move_domain(rows, L, dt, half, p, n);
        }
      } else {
        apply(in);
      }
      store_state<LawType>(state, rows.state, p, n);
      LAHAR_UNROLL
      for (std::size_t k = 0; k < stress_components<Dim>; ++k) {
        power += stress[k] * in.rate[k];
        store_first(stress[k], rows.stress[k] + p, n);
      }
      // Pressure does its work at the strain that the fluid has, not at that of the particle.
      if constexpr (pressure_is_state<LawType>)
        if (!step.model->analysis.volume_as_cbgeo)
          power -=
              (pressure_before + state[0]) * (in.volumetric * (1.0 / dt) - volumetric_rate(in));
      // Beyond the bin laws may see anything, also what is not finite.
      particles.add(Real((0.5 * dt) * load<Real>(rows.volume + p) * power), p, n);
    }
  }
}

template <int Dim, class Gradient>
LAHAR_INLINE void check_volumes(Patch<Dim>& patch, const Gradient& gradient, const ParticleBin& bin,
                                double dt) {
  const double least = dt * gradient.least_trace(bin.end - bin.begin);
  if (!(1.0 + least > 0.0)) record_collapse(patch, bin, least);
}

/// One bin, with gaps where the law has a limit of tension and the particles a column for them.
/// Returns the work.
template <int Dim, class Real, class Gradient, class LawType>
LAHAR_INLINE Real update_one_bin(Patch<Dim>& patch, const Gradient& gradient,
                                 const ParticleBin& bin, const Rows<Dim>& rows,
                                 const StepContext<Dim>& step, StressPart part,
                                 const LawType& law) {
  check_volumes(patch, gradient, bin, step.dt);
  OneBin<Dim, Real> particles{bin, patch};
  if constexpr (Opens<LawType, Dim, Real>) {
    if (rows.opening) {
      particles.density = density_around(patch, bin);
      update_some<true, Dim, Real>(patch, particles, gradient, rows, step, part, law);
      return particles.work;
    }
  }
  update_some<false, Dim, Real>(patch, particles, gradient, rows, step, part, law);
  return particles.work;
}

/// Some bins as update_one_bin() does them one after the other, to the bit, but side by side.
template <int Dim, class Real, class LawType>
Real update_packed(Patch<Dim>& patch, ParticleBins bins, std::size_t from, std::size_t to,
                   const VelocityGradients<Dim>& gradients, const Rows<Dim>& rows,
                   const StepContext<Dim>& step, StressPart part, const LawType& law) {
  static thread_local NodeArray work;
  if (work.size() < gradients.trace.size()) work.resize(gradients.trace.size());
  for (std::size_t r = from; r < to; ++r)
    if (const ParticleBin& bin = bins[r]; bin.begin < bin.end)
      check_volumes(patch, StoredGradient<Dim>(gradients, gradients.first[r], bin.begin), bin,
                    step.dt);
  PackedBins<Dim, Real> packed(bins, from, to, rows, gradients);
  const auto with = [&]<bool Gaps>() {
    update_some<Gaps, Dim, Real>(patch, packed, packed.gradient(), packed.rows(), step, part, law);
  };
  constexpr bool opens = Opens<LawType, Dim, Real>;
  if (opens && rows.opening) {
    packed.find_most_opening(patch);
    with.template operator()<opens>();
  } else {
    with.template operator()<false>();
  }
  packed.finish(work.data());
  Real sum(0.0);
  for (std::size_t r = from; r < to; ++r) {
    const Local n = bins[r].end - bins[r].begin;
    Real of_bin(0.0);
    for (Local i = 0; i < n; i += lanes<Real>)
      of_bin += first_lanes(load<Real>(work.data() + gradients.first[r] + i), n - i);
    sum += of_bin;
  }
  return sum;
}

}  // namespace

template <int Dim, class Real>
void update_stress(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins,
                   StressPart part, const VelocityGradients<Dim>* gradients) {
  if constexpr (Dim == 2)
    if (deforms_across(step.model->analysis))
      return update_stress_across<Real>(patch, step, bins, *gradients);
  const Rows<Dim> rows(patch.particles);
  Real work(0.0);
  if (general::is(patch) && !gradients) {
    // A buffer that all patches of a thread share stays in its cache.
    static thread_local VelocityGradients<Dim> found;
    general::find_gradients<Dim, Real>(patch, step, bins, patch.velocity.data(), found);
    gradients = &found;
  }
  // Bins of one material together: its law is found once.
  for (std::size_t from = 0, to = 0; from < bins.size(); from = to) {
    while (to < bins.size() && bins[to].material == bins[from].material) ++to;
    std::visit(
        [&](const auto& given) {
          const auto law = prepare(given);
          Rows<Dim> of_law = rows;
          if (!can_open(step.model->materials[bins[from].material].law)) of_law.opening = nullptr;
          of_law.dilatancy = dilatancy(given);
          if constexpr (TakesLong<std::decay_t<decltype(law)>>) {
            if (gradients && part != StressPart::strain &&
                packing_pays<Real>(bins.subspan(from, to - from))) {
              for (std::size_t k = 0; k < most_state; ++k)
                if (k >= law.state.size() || law.state[k].of_stress) of_law.state[k] = nullptr;
              work += update_packed<Dim, Real>(patch, bins, from, to, *gradients, of_law, step,
                                               part, law);
              return;
            }
          }
          if (gradients) {
            for (std::size_t r = from; r < to; ++r)
              if (const ParticleBin& bin = bins[r]; bin.begin < bin.end)
                work += update_one_bin<Dim, Real>(
                    patch, StoredGradient<Dim>(*gradients, gradients->first[r], bin.begin), bin,
                    of_law, step, part, law);
            return;
          }
          for_each_bin(
              patch, bins.subspan(from, to - from),
              [&](const auto& map, const ParticleBin& bin) __attribute__((always_inline)) {
                const LinearGradient<Dim, std::decay_t<decltype(map)>> gradient(patch, map, bin);
                work += update_one_bin<Dim, Real>(patch, gradient, bin, of_law, step, part, law);
              });
        },
        step.model->materials[bins[from].material].law);
  }
  patch.work.internal += reduce(work);
}

#define LAHAR_INSTANTIATE(Dim, Real)                                                         \
  template void update_stress<Dim, Real>(Patch<Dim>&, const StepContext<Dim>&, ParticleBins, \
                                         StressPart, const VelocityGradients<Dim>*);
LAHAR_INSTANTIATE(2, KernelReal)
LAHAR_INSTANTIATE(3, KernelReal)

}  // namespace lahar
