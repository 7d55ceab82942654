/// \file Gaps that open between grains or drops where a material is at its limit of tension.
///
/// At the limit a material does not resist when it is pulled apart: what grows are the gaps. They
/// are a state of the particle of their own, Column::opening: their volume as a share of the
/// material's. The column `volume` is that of the material alone, of which mass, waves, internal
/// forces and domains depend. With the volumetric strain increment e = dt tr(L) and what elasticity
/// takes of it, d = dp / K (p the mean stress, positive in tension):
///
///   opens   where the stress ends at the limit and e > d:
///           1 + o <- (1 + o) (1 + e) / (1 + d),  V <- V (1 + d);
///   closes  where o > 0 and e < 0, after tension is gone: 1 + o <- (1 + o) (1 + e) until o = 0;
///   the
///           law gets the rest of e alone, and V changes by it.
///
/// So a material that was torn apart has its strength again at the volume that it had, as with the
/// volume correction of Tampubolon et al. (2017), but for the elastic strain of the limit.
#pragma once

#include "physics/columns.h"
#include "physics/materials/law_input.h"
#include "physics/materials/stress_invariants.h"

namespace lahar {

/// True of laws that say which stresses are at their limit of tension.
template <class LawType, int Dim, class Real>
concept Opens = requires(const LawType& law, const Real* q, const Real& tolerance) {
  law.template at_tension_limit<stress_components<Dim>>(q, q, tolerance);
};

/// An increment of a material whose gaps open and close: close() before the law, open() after it.
template <int Dim, class Real, class LawType>
class OpeningIncrement {
 public:
  /// `opening` before the increment; at most `most` after it: a particle's gaps and material are
  /// not larger than its cell.
  LAHAR_INLINE OpeningIncrement(const LawType& law, const Real& opening, const Real& most)
      : law_(law), opening_(opening), most_(most) {}

  /// What the law sees: the increment without what closes gaps. In plane strain gaps close in the
  /// plane.
  LAHAR_INLINE LawInput<Dim, Real> close(const LawInput<Dim, Real>& in, const Real* stress,
                                         const Real* state) {
    LawInput<Dim, Real> given = in;
    strain_ = pressure_is_state ? in.volumetric : in.dt * trace(in);
    mean_ = mean(stress, state);
    changed_ = greater(opening_, Real(0.0)) & greater(Real(0.0), strain_);
    if (changed_ == 0) return given;
    // First tension goes: a strain between `strain_` and zero.
    const Real relief = max(strain_, max(mean_, Real(0.0)) * (-1.0 / bulk()));
    const Real space = (1.0 + opening_) * (1.0 + strain_) / (1.0 + relief) - 1.0;
    const Real rest = relief - max(-space, Real(0.0));
    const Real closed = select(changed_, strain_ - rest, Real(0.0));
    opening_ = select(changed_, max(space, Real(0.0)), opening_);
    strain_ -= closed;
    LAHAR_UNROLL
    for (int d = 0; d < Dim; ++d) given.rate[d] -= closed * (1.0 / (Dim * in.dt));
    given.volumetric -= closed;
    return given;
  }

  LAHAR_INLINE void open(const Real* stress, const Real* state) {
    const Real elastic = (mean(stress, state) - mean_) * (1.0 / bulk());
    unsigned opens = greater(strain_, elastic) & greater(strain_, Real(0.0));
    if (opens == 0) return;
    opens &= law_.template at_tension_limit<stress_components<Dim>>(stress, state,
                                                                    tolerance * bulk() * strain_);
    if (opens == 0) return;
    const Real wide = (1.0 + opening_) * (1.0 + strain_) / (1.0 + elastic) - 1.0;
    const Real bounded = -max(-wide, -max(most_, opening_));
    opening_ = select(opens, max(bounded, Real(0.0)), opening_);
    strain_ = select(opens, elastic, strain_);
    changed_ |= opens;
  }

  const Real& opening() const { return opening_; }
  /// Volumetric strain increment of the material; `whole` where no gaps changed.
  LAHAR_INLINE Real of_material(const Real& whole) const {
    return select(changed_, strain_, whole);
  }
  /// Velocity gradient that the particle's domain follows: domains are of the material, and where
  /// there are gaps it does not deform.
  LAHAR_INLINE void of_domain(const LawInput<Dim, Real>& in, Real (&L)[Dim][Dim]) const {
    const unsigned loose = greater(opening_, Real(0.0));
    const Real gaps =
        select(changed_, (trace(in) * in.dt - strain_) * (1.0 / (Dim * in.dt)), Real(0.0));
    LAHAR_UNROLL
    for (int a = 0; a < Dim; ++a)
      for (int b = 0; b < Dim; ++b)
        L[a][b] = select(loose, Real(0.0), in.gradient[a][b] - (a == b ? gaps : Real(0.0)));
  }

 private:
  /// The pressure of fluids is a state variable, and follows from the strain at the cell's centre.
  static constexpr bool pressure_is_state = [] {
    if constexpr (LawType::state.size() > 0)
      return LawType::state.front().name == "pressure";
    else
      return false;
  }();
  /// Rounding of stresses, as a share of those of the increment.
  static constexpr double tolerance = 1e-9;

  static Real trace(const LawInput<Dim, Real>& in) {
    Real sum = in.rate[0] + in.rate[1];
    if constexpr (Dim == 3) sum += in.rate[2];
    return sum;
  }
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
  Real opening_, most_, strain_, mean_;
  unsigned changed_ = 0;
};

}  // namespace lahar
