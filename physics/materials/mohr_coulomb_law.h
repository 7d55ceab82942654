/// \file Mohr-Coulomb plasticity with tension cut-off and strain softening.
#pragma once

#include <algorithm>
#include <cmath>
#include <string>

#include "physics/materials/beside_axes.h"
#include "physics/materials/law_input.h"
#include "physics/materials/table.h"

namespace lahar {

class MohrCoulombUpdate;

/// Mohr-Coulomb with tension cut-off, non-associated flow and linear softening, as in CB-Geo MPM.
struct MohrCoulomb {
  double youngs_modulus, poisson_ratio;
  double friction, dilation, cohesion, tension_cutoff;
  bool softening = false;
  double residual_friction = 0, residual_dilation = 0, residual_cohesion = 0;
  double peak_pdstrain = 0, residual_pdstrain = 0;
  bool as_cbgeo = false;  ///< the reference code's tolerance, 0.1 Pa, instead of rounding

  static constexpr std::string_view name = "MohrCoulomb";
  static constexpr std::string_view help =
      "Mohr-Coulomb plasticity with tension cut-off and softening";
  static constexpr auto parameters = std::to_array<Parameter<MohrCoulomb>>({
      {"youngs_modulus", "Pa", "Young's modulus", &MohrCoulomb::youngs_modulus, Bound::positive},
      {"poisson_ratio", "-", "Poisson's ratio", &MohrCoulomb::poisson_ratio, Bound::poisson},
      {"friction", "degrees", "friction angle", &MohrCoulomb::friction, Bound::angle},
      {"dilation", "degrees", "dilation angle", &MohrCoulomb::dilation, Bound::angle},
      {"cohesion", "Pa", "cohesion", &MohrCoulomb::cohesion, Bound::not_negative},
      {"tension_cutoff", "Pa", "largest tension", &MohrCoulomb::tension_cutoff,
       Bound::not_negative},
      {"softening", "true: strength falls with plastic strain; needs the keys below",
       &MohrCoulomb::softening},
      {"residual_friction", "degrees", "friction angle after softening",
       &MohrCoulomb::residual_friction, Bound::angle, no_default},
      {"residual_dilation", "degrees", "dilation angle after softening",
       &MohrCoulomb::residual_dilation, Bound::angle, no_default},
      {"residual_cohesion", "Pa", "cohesion after softening", &MohrCoulomb::residual_cohesion,
       Bound::not_negative, no_default},
      {"peak_pdstrain", "-", "plastic deviatoric strain where softening begins",
       &MohrCoulomb::peak_pdstrain, Bound::not_negative, no_default},
      {"residual_pdstrain", "-", "plastic deviatoric strain where it ends",
       &MohrCoulomb::residual_pdstrain, Bound::not_negative, no_default},
  });
  static constexpr auto state = std::to_array<StateVariable>({
      {"phi", "rad", "friction angle"},
      {"psi", "rad", "dilation angle"},
      {"cohesion", "Pa", "cohesion"},
      {"epsilon", "Pa", "sqrt(3) times the mean stress", true},
      {"rho", "Pa", "sqrt(2 J2)", true},
      {"theta", "rad", "Lode angle, 0 to pi/3", true},
      {"pdstrain", "-", "plastic deviatoric strain"},
  });

  std::string problem() const;
  double bulk_modulus() const { return youngs_modulus / (3.0 * (1.0 - 2.0 * poisson_ratio)); }
  double shear_modulus() const { return youngs_modulus / (2.0 * (1.0 + poisson_ratio)); }
  double wave_modulus() const { return bulk_modulus() + 4.0 / 3.0 * shear_modulus(); }
  double viscosity() const { return 0; }
  bool has_tension_limit() const { return true; }
  void initial_state(const double*, double* to) const {
    constexpr double radian = std::numbers::pi / 180.0;
    to[0] = friction * radian;
    to[1] = dilation * radian;
    to[2] = cohesion;
  }
  /// Strength follows from the parameters and the plastic strain.
  void follow_parameters(double* to) const {
    initial_state(nullptr, to);
    if (!softening || !(to[6] > peak_pdstrain)) return;
    constexpr double radian = std::numbers::pi / 180.0;
    const double share =
        std::max(0.0, (to[6] - residual_pdstrain) / (peak_pdstrain - residual_pdstrain));
    to[0] = (residual_friction + (friction - residual_friction) * share) * radian;
    to[1] = (residual_dilation + (dilation - residual_dilation) * share) * radian;
    to[2] = residual_cohesion + (cohesion - residual_cohesion) * share;
  }
  void derive(const double* stress, double* to) const;
  MohrCoulombUpdate prepared() const;
  /// The law of bodies with faces that bear no stress. Zero is within its limit of tension, not on
  /// it: a stress on the limit is zero for any strain that is large enough.
  MohrCoulomb with_free_faces() const {
    constexpr double trace = 1e-6;  // of the cohesion
    MohrCoulomb law = *this;
    law.tension_cutoff = std::max(tension_cutoff, trace * cohesion);
    return law;
  }
};

/// What the yield functions and the potential need of the strength, lane by lane.
template <class Real>
struct MohrCoulombStrength {
  Real phi, sin_phi, cos_phi, tan_psi, cohesion;
  Real per_cos;  ///< 1 / cos(phi)
  Real widest;   ///< largest of sin(theta + 60) / sqrt(3) + cos(theta + 60) sin(phi) / 3
  Real eccentricity, scale;  ///< of the potential's sections in shear
  Real apex;                 ///< largest mean stress in shear [Pa]
  Real edge;                 ///< least principal stress where both surfaces meet [Pa]
  Real bisector;             ///< slope of the bisector through that edge
};

/// The law with what does not change from particle to particle computed once.
///
/// Yield functions with the mean stress p, rho = sqrt(2 J2) and the Lode angle theta:
/// tension  sqrt(2/3) rho cos(theta) + p - T,
/// shear    sqrt(3/2) rho (sin(theta + 60) / (sqrt(3) cos(phi)) + cos(theta + 60) tan(phi) / 3)
///          + p tan(phi) - c;
/// flow potentials sqrt((0.1 c0 tan(psi))^2 + (R sqrt(3/2) rho)^2) + p tan(psi) in shear and
/// sqrt((0.1 T)^2 + (R sqrt(3/2) rho)^2) + p in tension, with the elliptic deviatoric sections R of
/// Menetrey and Willam (1995), the former's through the corners of Mohr-Coulomb's. (CB-Geo MPM,
/// theory/material; Abaqus, theory, 4.4.5.)
///
/// The return is a cutting-plane algorithm (Simo and Ortiz 1985) whose first step is along the
/// tangent at the stress before where that lies on the yield surface, as in the reference code; but
/// it goes on until the yield functions are zero but for rounding. Where it ends depends on the way
/// of its steps. A slightly different increment takes another way once increments exceed about the
/// yield strain, and the stress jumps. Implicit steps, whose increments may be large, return by
/// MohrCoulombReturn; so do sheets, whose strain across is searched.
class MohrCoulombUpdate {
 public:
  static constexpr auto& state = MohrCoulomb::state;
  static constexpr bool takes_long = true;  ///< packs are filled from several cells
  static constexpr bool jumps = true;       ///< where LawInput::large is false
  explicit MohrCoulombUpdate(const MohrCoulomb& law);

  template <int Dim, class Real>
  LAHAR_INLINE Failures update(const LawInput<Dim, Real>& in, Real* stress, Real* state) const;
  template <class Number>
  bool update_one(const IncrementOf<Number>& in, VoigtOf<Number>& stress, Number* state) const;
  template <class Number>
  void land(const IncrementOf<Number>& in, VoigtOf<Number>& stress, Number* state) const;
  double bulk_modulus() const { return K_; }
  template <int Rows, class Real>
  LAHAR_INLINE unsigned at_tension_limit(const Real* stress, const Real* state,
                                         const Real& tolerance) const;

 private:
  template <class Real>
  using Strength = MohrCoulombStrength<Real>;
  struct Yield {
    unsigned tension, shear;  ///< a bit per lane: which of the surfaces it returns to
    unsigned any() const { return tension | shear; }
  };
  template <class Real>
  struct Direction {
    InvariantGradient<Real> f, g;  ///< of yield function and potential
    Real per_strain;               ///< plastic deviatoric strain per multiplier
    Real softening;                ///< modulus [Pa]
  };
  /// Steps of the return for all lanes at once; lanes that need more go one by one.
  static constexpr int pack_steps = 12, single_steps = 100;
  /// Rounding of yield functions, as a share of stresses; of a stress that lies on the surface.
  static constexpr double rounding = 1e-12, on_surface = 1e-9;
  /// The sections of the potential in tension.
  static constexpr double tension_eccentricity = 0.6, tension_scale = 1.0 / 3.0;
  /// Offsets of potentials: a share of the largest tension, in shear of the cohesion.
  static constexpr double offset_share = 0.1;
  static constexpr double cbgeo_tolerance = 0.1;  ///< [Pa]
  static constexpr double least_unit = 1e-280;    ///< [Pa] the reciprocal is a number

  template <class Number>
  void elastic_stress(const IncrementOf<Number>& in, const VoigtOf<Number>& stress,
                      PackOfOne<Number>* trial) const;
  template <class Real>
  LAHAR_INLINE void find_apex_and_edge(Strength<Real>& s) const;
  template <class Real>
  LAHAR_INLINE Strength<Real> strength(Real* state) const;
  template <class Real>
  LAHAR_INLINE void yield_functions(const Invariants<Real>& at, const Strength<Real>& s,
                                    Real& tension, Real& shear) const;
  template <class Real>
  LAHAR_INLINE Yield yielding(const Invariants<Real>& at, const Strength<Real>& s, const Real& ft,
                              const Real& fs, const Real& above) const;
  template <class Real>
  LAHAR_INLINE Direction<Real> direction(const Invariants<Real>& at, const Strength<Real>& s,
                                         const Real& pdstrain, unsigned tension,
                                         unsigned edge) const;
  template <class Real>
  LAHAR_INLINE void potential(const Invariants<Real>& at, const Strength<Real>& s, unsigned tension,
                              const Real& per_theta, Direction<Real>& to) const;
  template <class Real>
  LAHAR_INLINE Real resistance(const Direction<Real>& d) const;
  template <int Rows, class Real>
  LAHAR_INLINE unsigned step_along_tangent(const Real* start, Real* stress, const Strength<Real>& s,
                                           const Real& size, Real& pdstrain, unsigned lanes) const;
  template <int Rows, class Real>
  [[gnu::noinline]] unsigned return_to_surface(const Real* start, Real* stress,
                                               const Strength<Real>& s, Real& pdstrain,
                                               const StressPoint<Rows, Real>& trial,
                                               unsigned lanes_to_do, int steps) const;
  template <int Rows, class Real>
  [[gnu::noinline]] unsigned return_from_far(Real* stress, const Strength<Real>& s, Real& pdstrain,
                                             const StressPoint<Rows, Real>& trial,
                                             unsigned lanes_to_do) const;

  double K_, G_, cutoff_;
  bool softening_, as_cbgeo_;
  double least_J2_;                   ///< [Pa^2] below it a stress has no Lode angle
  double hyperbola_;                  ///< 0.1 c0 [Pa]
  Strength<double> peak_, residual_;  // tan_psi, ...
  double peak_psi_, residual_psi_, peak_pdstrain_, residual_pdstrain_;
};

inline MohrCoulombUpdate MohrCoulomb::prepared() const {
  return MohrCoulombUpdate(*this);
}

}  // namespace lahar
