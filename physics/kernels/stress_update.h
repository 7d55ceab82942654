/// \file What updates of stresses share: columns, gradients, domains, and laws that fail.
#pragma once

#include <algorithm>

#include "physics/kernels/law_fault.h"
#include "physics/kernels/strain_rate.h"
#include "physics/kernels/velocity_gradients.h"
#include "physics/materials/increment.h"
#include "physics/materials/law.h"
#include "physics/particles/node_space.h"

namespace lahar {

/// The columns that the stage changes, row by row. A column that particles do not have is null.
template <int Dim>
struct Rows {
  std::array<double*, stress_components<Dim>> stress;
  std::array<double*, strain_components<Dim>> strain{};
  double* strain_across = nullptr;
  double* volume;
  std::array<double*, most_state> state{};
  double* opening = nullptr;
  double dilatancy = 0.0;  ///< of the law
  std::array<double*, Dim> domain{}, next_domain{};
  std::array<double*, static_cast<std::size_t>(Dim) * Dim> vectors{}, next_vectors{};

  explicit Rows(Particles<Dim>& particles)
      : stress(particles.template rows<stress_components<Dim>>(Column::stress)),
        volume(particles.row(Column::volume)) {
    if (particles.layout().has(Column::strain))
      strain = particles.template rows<strain_components<Dim>>(Column::strain);
    if (particles.layout().has(Column::strain_across))
      strain_across = particles.row(Column::strain_across);
    if (particles.layout().has(Column::state))
      for (int k = 0; k < particles.layout().components(Column::state); ++k)
        state[static_cast<std::size_t>(k)] = particles.row(Column::state, k);
    if (particles.layout().has(Column::opening)) opening = particles.row(Column::opening);
    if (particles.layout().has(Column::next_domain)) {
      domain = particles.template rows<Dim>(Column::domain);
      next_domain = particles.template rows<Dim>(Column::next_domain);
    }
    if (particles.layout().has(Column::vectors)) {
      vectors = particles.template rows<Dim * Dim>(Column::vectors);
      next_vectors = particles.template rows<Dim * Dim>(Column::next_vectors);
    }
  }
  /// Every row that there is.
  template <class Use>
  void each(Use use) {
    const auto all = [&](auto& rows) {
      for (double*& row : rows)
        if (row) use(row);
    };
    all(stress), all(strain), all(state);
    all(domain), all(next_domain), all(vectors), all(next_vectors);
    use(volume);
    if (opening) use(opening);
    if (strain_across) use(strain_across);
  }
};

/// How increments of finite steps follow from motion.
inline Kinematics kinematics_of(const Analysis& analysis) {
  return {.linear_strain = analysis.as_cbgeo, .turns_stress = analysis.turns_stress};
}

/// `half` of take_rotation_out(); 0: it is not done. USF has velocity gradients at the end of the
/// motion that they belong to.
template <class LawType>
double half_for_rotations(const Analysis& analysis, double dt) {
  if (!analysis.turns_stress || pressure_is_state<LawType>) return 0.0;
  return analysis.scheme == Scheme::usf ? -0.5 * dt : 0.5 * dt;
}

/// Strains of the n particles from p on, where there is a column for them, turn as stresses do.
template <int Dim, int Of, class Real>
LAHAR_INLINE void add_strain(const Rows<Dim>& rows, const LawInput<Of, Real>& in, Local p,
                             Local n) {
  if (!rows.strain[0]) return;
  constexpr std::size_t normal = Dim;  // rows of which are no shear
  Real strain[stress_components<Dim>] = {};
  LAHAR_UNROLL
  for (std::size_t k = 0; k < strain_components<Dim>; ++k)
    strain[strain_voigt<Dim>[k]] =
        load<Real>(rows.strain[k] + p) * (k < normal ? 1.0 : 0.5);  // engineering shear
  if (in.turns) {
    if constexpr (Dim == Of)
      turn<Dim>(in.spin, in.dt, strain);
    else
      turn<2>({in.spin[2]}, in.dt, strain);
  }
  LAHAR_UNROLL
  for (std::size_t k = 0; k < strain_components<Dim>; ++k) {
    const auto row = static_cast<std::size_t>(strain_voigt<Dim>[k]);
    store_first(Real(strain[row] * (k < normal ? 1.0 : 2.0) + in.dt * in.rate[row]),
                rows.strain[k] + p, n);
  }
  if constexpr (Dim != Of) {  // turning in the plane leaves it as it is
    constexpr std::size_t zz = 2;
    if (rows.strain_across)
      store_first(Real(load<Real>(rows.strain_across + p) + in.dt * in.rate[zz]),
                  rows.strain_across + p, n);
  }
}

template <int Dim>
void record_collapse(Patch<Dim>& patch, const ParticleBin& bin, double volumetric) {
  if (patch.fault.kind != ParticleFault::Kind::none) return;
  patch.fault.kind =
      std::isfinite(volumetric) ? ParticleFault::Kind::volume : ParticleFault::Kind::not_finite;
  patch.fault.particle = patch.particles.id[static_cast<std::size_t>(bin.begin)];
  patch.fault.count = bin.end - bin.begin;
  for (int d = 0; d < Dim; ++d)
    patch.fault.position[static_cast<std::size_t>(d)] =
        patch.particles.row(Column::x, d)[bin.begin];
}

/// Lanes of the particles from p on for which the law failed, `before` with their stress before.
template <int Dim, class Real>
[[gnu::noinline]] void record_failures(Patch<Dim>& patch, const ParticleBin& bin, Local p,
                                       const Failures& failures, const Real* before) {
  for (int lane = 0; lane < lanes<Real>; ++lane) {
    patch.work.divided += failures.divided >> lane & 1;
    if (!(failures.failed >> lane & 1)) continue;
    note_law_fault(patch.fault, patch, bin, p + lane,
                   [&](std::size_t k) { return before[k][lane]; });
  }
}

/// The state variables that a law keeps, from their rows and back; those that follow from the
/// stress stay where they are, and the law gets zeros.
template <class LawType, class Real>
LAHAR_INLINE void load_state(const std::array<double*, most_state>& rows, Local p, Real* state) {
  LAHAR_UNROLL
  for (std::size_t k = 0; k < LawType::state.size(); ++k)
    state[k] = LawType::state[k].of_stress ? Real(0.0) : load<Real>(rows[k] + p);
}
template <class LawType, class Real>
LAHAR_INLINE void store_state(const Real* state, const std::array<double*, most_state>& rows,
                              Local p, Local n) {
  LAHAR_UNROLL
  for (std::size_t k = 0; k < LawType::state.size(); ++k)
    if (!LawType::state[k].of_stress) store_first(state[k], rows[k] + p, n);
}

/// Velocity gradients of the particles of a bin from rows that hold them.
template <int Dim>
struct StoredGradient {
  static constexpr bool domains = true;  ///< particles may have a domain
  std::array<const double*, static_cast<std::size_t>(Dim) * Dim> rows;
  const double *trace, *hoop;
  Local begin;

  StoredGradient(const VelocityGradients<Dim>& from, Local first, Local bin_begin)
      : trace(from.trace.data() + first), hoop(from.hoop.data() + first), begin(bin_begin) {
    for (std::size_t k = 0; k < rows.size(); ++k) rows[k] = from.L[k].data() + first;
  }
  template <class Real>
  LAHAR_INLINE Real at(Local p, Real (&L)[Dim][Dim]) const {
    LAHAR_UNROLL
    for (std::size_t k = 0; k < rows.size(); ++k)
      L[k / Dim][k % Dim] = load<Real>(rows[k] + (p - begin));
    return load<Real>(trace + (p - begin));
  }
  /// Strain rate across the plane, of axisymmetric models.
  template <class Real>
  LAHAR_INLINE Real across(Local p) const {
    return load<Real>(hoop + (p - begin));
  }
  double least_trace(Local n) const { return *std::min_element(trace, trace + n); }
};

/// The box that is a particle's domain stretches along its axes, e_d *= 1 + dt L_dd: so that its
/// volume changes as the particle's, and rotations leave it as it is: with `half` of
/// take_rotation_out() to the second order. Functions of this step remain those of the old one.
template <int Dim, class Real>
LAHAR_INLINE void stretch_domain(const Rows<Dim>& rows, const Real (&L)[Dim][Dim], double dt,
                                 double half, Local p, Local n) {
  LAHAR_UNROLL
  for (std::size_t d = 0; d < Dim; ++d) {
    Real rate = L[d][d];
    if (half != 0.0) {
      LAHAR_UNROLL
      for (std::size_t b = 0; b < Dim; ++b) {
        const Real w = 0.5 * (L[d][b] - L[b][d]);
        if (b != d) rate += half * (w * w);
      }
    }
    store_first(Real(load<Real>(rows.domain[d] + p) * (1.0 + dt * rate)), rows.next_domain[d] + p,
                n);
  }
}

/// The vectors along a domain's edges follow the deformation, r += dt L r.
template <int Dim, class Real>
LAHAR_INLINE void deform_domain(const Rows<Dim>& rows, const Real (&L)[Dim][Dim], double dt,
                                Local p, Local n) {
  for (std::size_t k = 0; k < Dim; ++k) {
    Real r[Dim];
    LAHAR_UNROLL
    for (std::size_t d = 0; d < Dim; ++d) r[d] = load<Real>(rows.vectors[Dim * k + d] + p);
    LAHAR_UNROLL
    for (std::size_t a = 0; a < Dim; ++a) {
      Real change(0.0);
      LAHAR_UNROLL
      for (std::size_t d = 0; d < Dim; ++d) change += L[a][d] * r[d];
      store_first(r[a] + dt * change, rows.next_vectors[Dim * k + a] + p, n);
    }
  }
}

/// Domains of the n particles from p on follow L.
template <int Dim, class Real>
LAHAR_INLINE void move_domain(const Rows<Dim>& rows, const Real (&L)[Dim][Dim], double dt,
                              double half, Local p, Local n) {
  if (rows.next_domain[0]) stretch_domain(rows, L, dt, half, p, n);
  if (rows.next_vectors[0]) deform_domain(rows, L, dt, p, n);
}

/// Mean density [kg/m^3] around the cell of a bin: mass at the cell's nodes over their space. Where
/// cells are full this hardly depends on how particles lie in them.
template <int Dim>
double density_around(const Patch<Dim>& patch, const ParticleBin& bin) {
  const auto c = static_cast<std::size_t>(bin.cell);
  double mass = 0;
  for (const Local node : nodes_with_mass(patch.topology, patch.element, c))
    mass += patch.velocity[static_cast<std::size_t>(node) * node_width + mass_lane];
  return mass / patch.space[c];
}

/// How large the gaps of the particles from p on are at most, as a share of their material: mass
/// with this density fills its space.
template <int Dim, class Real>
LAHAR_INLINE Real most_opening(const Patch<Dim>& patch, double density, Local p) {
  const Real mass = load<Real>(patch.particles.row(Column::mass) + p),
             volume = load<Real>(patch.particles.row(Column::volume) + p);
  return max(mass / (volume * density) - 1.0, Real(0.0));
}

}  // namespace lahar
