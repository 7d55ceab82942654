/// \file Gaps that open between grains or drops where a material is at its limit of tension.
///
/// At the limit a material does not resist when it is pulled apart: what grows are the gaps. They
/// are a state of the particle of their own, Column::opening: their volume as a share of the
/// material's. The column `volume` is that of the material alone, of which waves, internal forces
/// and domains depend. With the volumetric strain increment e = dt tr(L), its elastic part d = dp /
/// K (p the mean stress, positive in tension) and J(e) = exp(e):
///
///   opens   where e > d: if the stress ends at the limit by e - d, else by what of that is more
///           than the dilation of the increment's shear: 1 + o <- (1 + o) J(e - d);
///   closes  where o > 0 and e < 0, after tension is gone: 1 + o <- (1 + o) J(e) until o = 0. Only
///   the
///           rest of e is given to the law.
///
/// V changes by J of what is left of e, which is that at the particle for solids, so that volume
/// and stress stay in keeping; for fluids by J of d over the whole step, which has the change of
/// the pressure by smoothing. Gaps and material of a particle together are not larger than its
/// space, its mass over the mean density around its cell (density_around()): what came down to
/// others has no gaps any more. So a material that was torn apart has its strength again at the
/// volume that it had (the volume correction of Tampubolon et al. 2017), but for the elastic strain
/// of the limit.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

#include "physics/materials/law_input.h"
#include "physics/materials/stress_invariants.h"
#include "physics/particles/columns.h"

namespace lahar {

/// True of laws that say which stresses are at their limit of tension.
template <class LawType, int Dim, class Real>
concept Opens = requires(const LawType& law, const Real* q, const Real& tolerance) {
  law.template at_tension_limit<stress_components<Dim>>(q, q, tolerance);
};

/// Ratio of volumes of a volumetric strain increment e: exp(e), but for e^3 / 12. So what opens and
/// closes by turns stays as it was.
template <class Real>
LAHAR_INLINE Real stretch_of(const Real& e) {
  return (2.0 + e) / (2.0 - e);
}

/// Plastic volumetric strain per plastic deviatoric strain that shear has, at most, of laws with
/// angles of friction and dilation: the cones of Mohr-Coulomb and Drucker-Prager in triaxial
/// compression. What a material expands by beyond that are gaps, also where its stress ends below
/// the limit after it was there.
template <class LawType>
double dilatancy(const LawType& law) {
  if constexpr (requires { law.dilation; }) {
    constexpr double radian = std::numbers::pi / 180.0;
    const double psi = law.dilation * radian, sin = std::sin(psi);
    double largest = 6.0 * sin / (3.0 - sin);
    const auto of = [&](double phi) {
      return 6.0 * std::tan(psi) * std::cos(phi) / (3.0 - std::sin(phi));
    };
    largest = std::max(largest, of(law.friction * radian));
    if constexpr (requires { law.residual_friction; })
      if (law.softening) largest = std::max(largest, of(law.residual_friction * radian));
    return largest;
  }
  return 0.0;
}

/// An increment of a material whose gaps open and close: close() before the law, open() after it.
template <int Dim, class Real, class LawType>
class OpeningIncrement {
 public:
  /// `dilatancy` of the law; `opening` before the increment; at most `most` after it
  /// (most_opening()).
  LAHAR_INLINE OpeningIncrement(const LawType& law, double dilatancy, const Real& opening,
                                const Real& most)
      : law_(law), dilatancy_(dilatancy), opening_(opening), most_(most) {}

  /// What the law sees: the increment without what closes gaps. In plane strain gaps close in the
  /// plane.
  LAHAR_INLINE LawInput<Dim, Real> close(const LawInput<Dim, Real>& in, const Real* stress,
                                         const Real* state) {
    LawInput<Dim, Real> given = in;
    strain_ = pressure_is_state ? in.volumetric : in.dt * volumetric_rate(in);
    mean_ = mean(stress, state);
    if constexpr (shears) shear_before_ = state[shear_row];
    if constexpr (pressure_is_state) stress_before_ = mean_of(stress);
    const unsigned closes = greater(opening_, Real(0.0)) & greater(Real(0.0), strain_);
    if (closes == 0) return given;
    // First tension goes: a strain between `strain_` and zero.
    const Real relief = max(strain_, max(mean_, Real(0.0)) * (-1.0 / bulk()));
    const Real space = (1.0 + opening_) * stretch_of(strain_ - relief) - 1.0;
    const Real over = -max(-space, Real(0.0));
    const Real rest = relief + 2.0 * over / (2.0 + over);
    const Real closed = select(closes, strain_ - rest, Real(0.0));
    opening_ = select(closes, max(space, Real(0.0)), opening_);
    strain_ -= closed;
    LAHAR_UNROLL
    for (int d = 0; d < Dim; ++d) given.rate[d] -= closed * (1.0 / (Dim * in.dt));
    given.volumetric -= closed;
    return given;
  }

  LAHAR_INLINE void open(const Real* stress, const Real* state) {
    const Real elastic = (mean(stress, state) - mean_) * (1.0 / bulk());
    const Real kinematic = strain_;
    if constexpr (pressure_is_state) strain_ = (mean_of(stress) - stress_before_) * (1.0 / bulk());
    opening_ = -max(-opening_, -most_);
    const Real plastic = kinematic - elastic;
    unsigned opens = greater(plastic, Real(least)) & greater(kinematic, Real(0.0));
    if (opens == 0) return;
    Real opened = plastic;
    const unsigned limit = law_.template at_tension_limit<stress_components<Dim>>(
        stress, state, Real(tolerance * bulk() * kinematic));
    if constexpr (shears) {
      const Real dilation = dilatancy_ * (state[shear_row] - shear_before_);
      opened = select(limit, plastic, plastic - dilation);
      opens &= greater(opened, Real(least));
    } else {
      opens &= limit;
    }
    if (opens == 0) return;
    const Real wide = (1.0 + opening_) * stretch_of(opened) - 1.0;
    opening_ = select(opens, max(-max(-wide, -most_), Real(0.0)), opening_);
    if constexpr (!pressure_is_state) strain_ = select(opens, kinematic - opened, strain_);
  }

  const Real& opening() const { return opening_; }
  /// Volumetric strain increment of the material.
  const Real& of_material() const { return strain_; }
  /// Velocity gradient that the particle's domain follows: domains are of the material, and where
  /// there are gaps it does not deform.
  LAHAR_INLINE void of_domain(const LawInput<Dim, Real>& in, Real (&L)[Dim][Dim]) const {
    const unsigned loose = greater(opening_, Real(0.0));
    const Real gaps = (in.dt * volumetric_rate(in) - strain_) * (1.0 / (Dim * in.dt));
    LAHAR_UNROLL
    for (int a = 0; a < Dim; ++a)
      for (int b = 0; b < Dim; ++b)
        L[a][b] = select(loose, Real(0.0), in.gradient[a][b] - (a == b ? gaps : Real(0.0)));
  }

 private:
  static constexpr bool pressure_is_state = lahar::pressure_is_state<LawType>;
  /// Where the law keeps its plastic deviatoric strain.
  static constexpr std::size_t shear_row = [] {
    std::size_t row = 0;
    while (row < LawType::state.size() && LawType::state[row].name != "pdstrain") ++row;
    return row;
  }();
  static constexpr bool shears = shear_row < LawType::state.size();
  /// Rounding of stresses, as a share of those of the increment.
  static constexpr double tolerance = 1e-9;
  /// Rounding of strain increments [-].
  static constexpr double least = 1e-13;

  static Real mean(const Real* stress, const Real* state) {
    if constexpr (pressure_is_state)
      return -state[0];
    else
      return mean_of(stress);
  }
  double bulk() const {
    if constexpr (requires { law_.bulk_modulus(); })
      return law_.bulk_modulus();
    else
      return law_.bulk_modulus;
  }

  const LawType& law_;
  double dilatancy_;
  Real opening_, most_, strain_, mean_, stress_before_, shear_before_;
};

}  // namespace lahar
