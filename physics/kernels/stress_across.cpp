#include "physics/kernels/stress_across.h"

#include "physics/kernels/general_kernels.h"
#include "physics/kernels/opening.h"
#include "physics/kernels/ring.h"
#include "physics/kernels/stress_update.h"
#include "physics/materials/free_strain.h"

namespace lahar {

namespace {

constexpr std::size_t rows_in_plane = stress_components<2>, zz = 2;

template <class LawType>
constexpr bool jumps = requires {
  requires LawType::jumps;
};

/// What a law sees of a velocity gradient L in the plane and a strain rate across it. `trace` is
/// the volumetric strain rate of fluids, which may be that of the cell.
template <class Real>
LAHAR_INLINE LawInput<3, Real> input_of(const Real (&L)[2][2], const Real& across,
                                        const Real& trace, double half,
                                        const StepContext<2>& step) {
  LawInput<3, Real> in;
  const double dt = step.dt;
  const Analysis& analysis = step.model->analysis;
  const double scale = is_implicit(analysis) ? dt : 1.0;
  LAHAR_UNROLL
  for (int a = 0; a < 3; ++a) LAHAR_UNROLL
  for (int b = 0; b < 3; ++b)
    in.gradient[a][b] = a < 2 && b < 2 ? Real(scale * L[a % 2][b % 2]) : Real(0.0);
  in.gradient[2][2] = scale * across;
  if (is_implicit(analysis))  // increments are not small
    return increment_of<3, Real>(in.gradient, dt, kinematics_of(analysis));
  strain_rate<3, Real>(in.gradient, in.rate);
  spin_of<3>(in.gradient, in.spin);
  in.turns = analysis.turns_stress;
  in.dt = dt;
  in.volumetric = trace * dt;
  if (half != 0.0) take_rotation_out(in, half);
  return in;
}

/// The law of a pack of particles, with the gaps that open and close in their material.
template <bool Gaps, class Real, class LawType>
struct LawUpdate {
  const LawType& law;
  double dilatancy;
  Real most;          ///< gaps, at most
  Real opening;       ///< Column::opening
  Real volumetric;    ///< strain increment of the material
  Real domain[2][2];  ///< velocity gradient that domains follow

  /// Not inlined: plane stress calls it again and again.
  [[gnu::noinline]] Failures apply(const LawInput<3, Real>& in, Real* stress, Real* state) {
    if constexpr (!Gaps) {
      volumetric = in.volumetric;
      copy_in_plane(in.gradient);
      return update(law, in, stress, state);
    } else {
      OpeningIncrement<3, Real, LawType> gaps(law, dilatancy, opening, most);
      const Failures failures = update(law, gaps.close(in, stress, state), stress, state);
      gaps.open(stress, state);
      opening = gaps.opening();
      volumetric = gaps.of_material();
      Real L[3][3];
      gaps.of_domain(in, L);
      copy_in_plane(L);
      return failures;
    }
  }
  LAHAR_INLINE void copy_in_plane(const Real (&L)[3][3]) {
    LAHAR_UNROLL
    for (int a = 0; a < 2; ++a)
      for (int b = 0; b < 2; ++b) domain[a][b] = L[a][b];
  }
};

/// compression_modulus(), lane by lane.
template <class Real, class LawType>
Real present_modulus(const LawType& law, const Real (&stress)[6], const Real (&state)[most_state]) {
  if constexpr (!requires { &LawType::wave_moduli; }) {
    return Real(law.wave_modulus());
  } else {
    Real modulus(0.0);
    for (int lane = 0; lane < lanes<Real>; ++lane) {
      Voigt s;
      std::array<double, most_state> q;
      for (std::size_t k = 0; k < s.size(); ++k) s[k] = stress[k][lane];
      for (std::size_t k = 0; k < q.size(); ++k) q[k] = state[k][lane];
      set_lane(modulus, lane, compression_modulus(law, s, q.data()));
    }
    return modulus;
  }
}

/// What a stress across a sheet is compared with [Pa]: the stresses, and those of the increment.
template <class Real>
LAHAR_INLINE Real stresses_of(const LawInput<3, Real>& held, const Real& modulus, double dt,
                              const Real (&stress)[6]) {
  Real scale(0.0);
  for (std::size_t k = 0; k < rows_in_plane; ++k)
    scale += abs(stress[k]) + Real(modulus * dt) * abs(held.rate[k]);
  return scale;
}

/// The strain rate across a sheet that makes its stress there zero at the end of the step.
template <class Real, class Update, class Input>
LAHAR_INLINE Real free_rate(const Update& update_of, const Real& modulus, const Real& scale,
                            unsigned active, double dt, const Real (&stress)[6],
                            const Real (&state)[most_state], Input input) {
  const auto stress_across = [&](const Real& strain, unsigned open) {
    Update trial = update_of;
    Real s[6], q[most_state];
    std::copy_n(stress, 6, s);
    std::copy_n(state, most_state, q);
    LawInput<3, Real> in = input(Real(strain * (1.0 / dt)));
    in.active = open;
    trial.apply(in, s, q);
    return s[zz];
  };
  return (1.0 / dt) * strain_without_stress<Real>(active, modulus, scale, stress_across);
}

/// One bin with its law, as given and as prepared, and gradients; returns the sum of V sigma :
/// d(eps) with the mean stress.
template <Plane plane, bool Gaps, class Real, class Given, class LawType>
Real update_bin(Patch<2>& patch, const StoredGradient<2>& gradient, const ParticleBin& bin,
                const Rows<2>& rows, const StepContext<2>& step, const Given& given,
                const LawType& law) {
  const double dt = step.dt, least = dt * gradient.least_trace(bin.end - bin.begin);
  if (!(1.0 + least > 0.0)) record_collapse(patch, bin, least);
  const double density = Gaps ? density_around(patch, bin) : 0.0;
  const double half = half_for_rotations<LawType>(step.model->analysis, dt);
  Real work(0.0);
  for (Local p = bin.begin; p < bin.end; p += lanes<Real>) {
    const Local n = bin.end - p;
    const unsigned active = n < lanes<Real> ? (1u << n) - 1 : LawInput<3, Real>::all_of;
    Real L[2][2], across(0.0), scale(0.0), stress[6], before[6], state[most_state] = {}, power(0.0);
    const Real trace = gradient.at(p, L);
    for (std::size_t k = 0; k < 6; ++k)
      before[k] = stress[k] = k < rows_in_plane ? load<Real>(rows.stress[k] + p) : Real(0.0);
    load_state<LawType>(rows.state, p, state);
    LawUpdate<Gaps, Real, LawType> of_law{.law = law,
                                          .dilatancy = rows.dilatancy,
                                          .most = Real(0.0),
                                          .opening = Real(0.0),
                                          .volumetric = Real(0.0),
                                          .domain = {}};
    if constexpr (Gaps) {
      of_law.opening = load<Real>(rows.opening + p);
      of_law.most = most_opening<2, Real>(patch, density, p);
    }
    LawInput<3, Real> in;
    if constexpr (plane == Plane::axisymmetric) {
      in = input_of(L, gradient.across<Real>(p), trace, half, step);
    } else {
      const auto input = [&](const Real& rate) {
        LawInput<3, Real> increment = input_of(L, rate, Real(trace + rate), half, step);
        // A search finds no zero of a stress that jumps.
        if constexpr (jumps<LawType>) increment.large = true;
        return increment;
      };
      const Real modulus = present_modulus(given, stress, state);
      scale = stresses_of(input(Real(0.0)), modulus, dt, stress);
      across = free_rate<Real>(of_law, modulus, scale, active, dt, stress, state, input);
      in = input(across);
    }
    in.active = active;
    Real pressure_before(0.0);
    if constexpr (pressure_is_state<LawType>) pressure_before = state[0];
    for (std::size_t k = 0; k < rows_in_plane; ++k) power += stress[k] * in.rate[k];
    Failures failures = of_law.apply(in, stress, state);
    if constexpr (plane == Plane::stress)
      failures.failed |= active & stress_is_left(stress[zz], scale, given.wave_modulus());
    if (failures.failed | failures.divided) record_failures(patch, bin, p, failures, before);
    for (std::size_t k = 0; k < rows_in_plane; ++k) {
      power += stress[k] * in.rate[k];
      store_first(stress[k], rows.stress[k] + p, n);
    }
    store_state<LawType>(state, rows.state, p, n);
    if constexpr (Gaps) store_first(of_law.opening, rows.opening + p, n);
    const Real stretch = Gaps ? Real(stretch_of(of_law.volumetric)) : Real(1.0 + of_law.volumetric);
    store_first(Real(load<Real>(rows.volume + p) * stretch), rows.volume + p, n);
    move_domain(rows, of_law.domain, dt, half, p, n);
    add_strain(rows, in, p, n);
    // Pressure does its work at the strain that the fluid has, not at that of the particle.
    if constexpr (pressure_is_state<LawType>)
      power -= (pressure_before + state[0]) * (in.volumetric * (1.0 / dt) - volumetric_rate(in));
    work += first_lanes(Real((0.5 * dt) * load<Real>(rows.volume + p) * power), n);
  }
  return work;
}

/// Bins of one material.
template <Plane plane, class Real, class Given, class LawType>
Real update_bins(Patch<2>& patch, const StepContext<2>& step, ParticleBins bins, const Local* first,
                 const VelocityGradients<2>& gradients, const Rows<2>& rows, const Given& given,
                 const LawType& law) {
  Real work(0.0);
  const auto with = [&]<bool Gaps>() {
    for (std::size_t r = 0; r < bins.size(); ++r)
      if (const ParticleBin& bin = bins[r]; bin.begin < bin.end)
        work += update_bin<plane, Gaps, Real>(
            patch, StoredGradient<2>(gradients, first[r], bin.begin), bin, rows, step, given, law);
  };
  if constexpr (Opens<LawType, 3, Real>)
    if (rows.opening) {
      with.template operator()<true>();
      return work;
    }
  with.template operator()<false>();
  return work;
}

}  // namespace

template <class Real>
void find_gradients_across(const Patch<2>& patch, const StepContext<2>& step, ParticleBins bins,
                           VelocityGradients<2>& gradients) {
  find_particle_gradients<2, Real>(patch, step, bins, gradients);
  if (step.model->analysis.plane == Plane::axisymmetric)
    add_hoop_rates<Real>(patch, bins, patch.velocity.data(), gradients);
}

template <class Real>
void update_stress_across(Patch<2>& patch, const StepContext<2>& step, ParticleBins bins,
                          const VelocityGradients<2>& gradients) {
  const Rows<2> rows(patch.particles);
  Real work(0.0);
  // Bins of one material together: its law is found once.
  for (std::size_t from = 0, to = 0; from < bins.size(); from = to) {
    while (to < bins.size() && bins[to].material == bins[from].material) ++to;
    const Law& of_material = step.model->materials[bins[from].material].law;
    std::visit(
        [&]<class Given>(const Given& given) {
          const bool sheet = step.model->analysis.plane == Plane::stress;
          const auto law = prepare(sheet ? with_free_faces(given) : given);
          Rows<2> of_law = rows;
          if (!can_open(of_material)) of_law.opening = nullptr;
          of_law.dilatancy = dilatancy(given);
          const ParticleBins same = bins.subspan(from, to - from);
          const Local* first = gradients.first.data() + from;
          if (step.model->analysis.plane == Plane::axisymmetric)
            work += update_bins<Plane::axisymmetric, Real>(patch, step, same, first, gradients,
                                                           of_law, given, law);
          else if constexpr (!pressure_is_state<Given>)  // no sheets of fluids
            work += update_bins<Plane::stress, Real>(patch, step, same, first, gradients, of_law,
                                                     given, law);
        },
        of_material);
  }
  patch.work.internal += reduce(work);
}

#define LAHAR_INSTANTIATE(Real)                                                                   \
  template void find_gradients_across<Real>(const Patch<2>&, const StepContext<2>&, ParticleBins, \
                                            VelocityGradients<2>&);                               \
  template void update_stress_across<Real>(Patch<2>&, const StepContext<2>&, ParticleBins,        \
                                           const VelocityGradients<2>&);
LAHAR_INSTANTIATE(KernelReal)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
