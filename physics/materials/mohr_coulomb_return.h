/// \file The return mapping of Mohr-Coulomb; see mohr_coulomb_law.h.
#pragma once

#include "physics/materials/mohr_coulomb_large.h"
#include "physics/materials/mohr_coulomb_law.h"

namespace lahar {

inline std::string MohrCoulomb::problem() const {
  if (cohesion == 0 && friction == 0)
    return "'cohesion' and 'friction' must not both be 0: the material would have no strength; a "
           "fluid is \"type\": \"Newtonian\"";
  if (dilation > friction)
    return "'dilation' must be at most 'friction' = " + text_of(friction) + " degrees, found " +
           text_of(dilation);
  const auto above_apex = [&](double degrees, double c, const char* which) -> std::string {
    const double apex = c / std::tan(degrees * std::numbers::pi / 180.0);
    if (degrees == 0 || tension_cutoff <= apex * (1 + 1e-12)) return "";
    return "'tension_cutoff' must be at most the tension at the apex, " + std::string(which) +
           " = " + text_of(apex) + " Pa, found " + text_of(tension_cutoff);
  };
  if (std::string text = above_apex(friction, cohesion, "cohesion cot(friction)"); !text.empty())
    return text;
  if (!softening) return "";
  for (const auto& p : parameters)
    if (p.number && std::isnan(this->*p.number))
      return "'" + std::string(p.key) + "' is needed where 'softening' is true";
  if (residual_cohesion == 0 && residual_friction == 0)
    return "'residual_cohesion' and 'residual_friction' must not both be 0: the material would "
           "have "
           "no strength";
  if (!(peak_pdstrain < residual_pdstrain))
    return "'residual_pdstrain' must be greater than 'peak_pdstrain' = " + text_of(peak_pdstrain) +
           ", found " + text_of(residual_pdstrain);
  return "";
}

inline void MohrCoulomb::derive(const double* stress, double* to) const {
  Scalar sigma[6];
  for (int k = 0; k < 6; ++k) sigma[k] = Scalar(stress[k]);
  StressPoint<6, Scalar> at;
  point_of(sigma, at);
  to[3] = root3 * at.p[0];
  to[4] = at.rho[0];
  to[5] = std::atan2(at.sin[0], at.cos[0]);
}

inline MohrCoulombUpdate::MohrCoulombUpdate(const MohrCoulomb& law)
    : K_(law.bulk_modulus()),
      G_(law.shear_modulus()),
      cutoff_(law.tension_cutoff),
      softening_(law.softening),
      as_cbgeo_(law.as_cbgeo),
      least_J2_(law.as_cbgeo ? cbgeo_least_J2 : least_J2) {
  constexpr double radian = std::numbers::pi / 180.0;
  const auto of = [this](double phi, double psi, double c) {
    const double sin = std::sin(phi), cos = std::cos(phi);
    Strength<double> s{phi,
                       sin,
                       cos,
                       std::tan(psi),
                       c,
                       1.0 / cos,
                       std::sqrt(1.0 / 3.0 + sin * sin / 9.0),
                       (3.0 - sin) / (3.0 + sin),
                       (3.0 - sin) / (6.0 * cos),
                       0.0,
                       0.0,
                       0.0};
    Strength<Scalar> pack{};
    pack.sin_phi = sin, pack.cos_phi = cos, pack.cohesion = c;
    find_apex_and_edge(pack);
    s.apex = pack.apex[0], s.edge = pack.edge[0], s.bisector = pack.bisector[0];
    return s;
  };
  peak_psi_ = law.dilation * radian;
  residual_psi_ = law.residual_dilation * radian;
  hyperbola_ = offset_share * law.cohesion;
  peak_ = of(law.friction * radian, peak_psi_, law.cohesion);
  residual_ = of(law.residual_friction * radian, residual_psi_, law.residual_cohesion);
  peak_pdstrain_ = law.peak_pdstrain;
  residual_pdstrain_ = law.residual_pdstrain;
}

/// What follows from the strength where shear ends: at its apex, and where tension begins.
template <class Real>
LAHAR_INLINE void MohrCoulombUpdate::find_apex_and_edge(Strength<Real>& s) const {
  const Real n = (1.0 + s.sin_phi) / (1.0 - s.sin_phi);
  s.apex = s.cohesion * s.cos_phi / max(s.sin_phi, Real(1e-300));
  s.edge = cutoff_ * n - 2.0 * s.cohesion * sqrt(n);
  s.bisector = sqrt(1.0 + n * n) + n;
}

/// Strength at the plastic strain before the increment, as in the reference code; it stays the same
/// during the increment. Sets phi, psi and cohesion of the state.
template <class Real>
LAHAR_INLINE MohrCoulombStrength<Real> MohrCoulombUpdate::strength(Real* q) const {
  Strength<Real> s{peak_.phi,      peak_.sin_phi, peak_.cos_phi, peak_.tan_psi,
                   peak_.cohesion, peak_.per_cos, peak_.widest,  peak_.eccentricity,
                   peak_.scale,    peak_.apex,    peak_.edge,    peak_.bisector};
  if (!softening_) return s;
  const unsigned softer = greater(q[6], Real(peak_pdstrain_));
  Real psi(peak_psi_);
  if (softer != 0) {
    for (int lane = 0; lane < lanes<Real>; ++lane) {
      if (!(softer >> lane & 1)) continue;
      using Number = NumberOf<Real>;
      using std::sin, std::cos, std::tan;
      const Number share = std::max<Number>(
          0.0, (lane_of(q[6], lane) - residual_pdstrain_) / (peak_pdstrain_ - residual_pdstrain_));
      const Number phi = residual_.phi + (peak_.phi - residual_.phi) * share,
                   psi_now = residual_psi_ + (peak_psi_ - residual_psi_) * share,
                   c = residual_.cohesion + (peak_.cohesion - residual_.cohesion) * share;
      set_lane(s.phi, lane, phi);
      set_lane(s.sin_phi, lane, share > 0 ? sin(phi) : residual_.sin_phi);
      set_lane(s.cos_phi, lane, share > 0 ? cos(phi) : residual_.cos_phi);
      set_lane(s.tan_psi, lane, share > 0 ? tan(psi_now) : residual_.tan_psi);
      set_lane(s.cohesion, lane, c);
      set_lane(psi, lane, psi_now);
    }
    // Others keep what was computed once: roundings differ, and must not depend on who is beside.
    const Real per_cos = 1.0 / s.cos_phi;
    s.widest = select(softer, sqrt((1.0 / 3.0) + s.sin_phi * s.sin_phi * (1.0 / 9.0)), s.widest);
    s.eccentricity = select(softer, (3.0 - s.sin_phi) / (3.0 + s.sin_phi), s.eccentricity);
    s.scale = select(softer, (3.0 - s.sin_phi) * (1.0 / 6.0) * per_cos, s.scale);
    s.per_cos = select(softer, per_cos, s.per_cos);
    Strength<Real> other = s;
    find_apex_and_edge(other);
    s.apex = select(softer, other.apex, s.apex);
    s.edge = select(softer, other.edge, s.edge);
    s.bisector = select(softer, other.bisector, s.bisector);
  }
  q[0] = s.phi;
  q[1] = psi;
  q[2] = s.cohesion;
  return s;
}

template <class Real>
LAHAR_INLINE void MohrCoulombUpdate::yield_functions(const Invariants<Real>& at,
                                                     const Strength<Real>& s, Real& tension,
                                                     Real& shear) const {
  const Real sin60 = 0.5 * at.sin + (0.5 * root3) * at.cos;  // sin(theta + 60 degrees)
  const Real cos60 = 0.5 * at.cos - (0.5 * root3) * at.sin;
  tension = root2_3 * at.cos * at.rho + at.p - cutoff_;
  shear = (root3_2 * at.rho * (sin60 * (1.0 / root3) + cos60 * s.sin_phi * (1.0 / 3.0)) +
           at.p * s.sin_phi) *
              s.per_cos -
          s.cohesion;
}

/// Beyond both surfaces, the one on whose side of the bisector through their edge the stress lies.
template <class Real>
LAHAR_INLINE MohrCoulombUpdate::Yield MohrCoulombUpdate::yielding(const Invariants<Real>& at,
                                                                  const Strength<Real>& s,
                                                                  const Real& ft, const Real& fs,
                                                                  const Real& above) const {
  Yield yield{greater(ft, above), greater(fs, above)};
  const unsigned both = yield.tension & yield.shear;
  if (both == 0) return yield;
  const Real least = at.p - root2_3 * at.rho * (0.5 * at.cos + (0.5 * root3) * at.sin);
  const Real h = ft + s.bisector * (least - s.edge);
  const unsigned tensile =
      both & greater(h, Real(as_cbgeo_ ? std::numeric_limits<double>::epsilon() : 0.0));
  yield.shear &= ~tensile;
  yield.tension &= ~(both & ~tensile);
  return yield;
}

/// Gradient of the potential; R and dR/dtheta of Menetrey and Willam's ellipse with eccentricity e:
/// R = l / m, l = 4 (1 - e^2) cos^2 + (2e - 1)^2, m = 2 (1 - e^2) cos + (2e - 1) sqrt(4 (1 - e^2)
/// cos^2 + 5 e^2 - 4 e).
template <class Real>
LAHAR_INLINE void MohrCoulombUpdate::potential(const Invariants<Real>& at, const Strength<Real>& s,
                                               unsigned tension, const Real& per_theta,
                                               Direction<Real>& to) const {
  const Real e = select(tension, Real(tension_eccentricity), s.eccentricity);
  const Real scale = select(tension, Real(tension_scale), s.scale);
  const Real off = select(tension, Real(offset_share * cutoff_), hyperbola_ * s.tan_psi);
  const Real k = 1.0 - e * e, two_e = 2.0 * e - 1.0, cos2 = at.cos * at.cos;
  constexpr double epsilon = std::numeric_limits<double>::epsilon();
  const Real square = 4.0 * k * cos2 + 5.0 * e * e - 4.0 * e;
  const Real some = select(greater(square, Real(epsilon)), square, Real(1e-5));
  const Real per_root = inverse_sqrt(some), root = some * per_root;
  const Real l = 4.0 * k * cos2 + two_e * two_e;
  const Real per_m = reciprocal(2.0 * k * at.cos + two_e * root);
  const Real dl = -8.0 * k * at.cos * at.sin, dm = -2.0 * k * at.sin + 0.5 * two_e * dl * per_root;
  const Real ratio = l * per_m, R = scale * ratio, dR = scale * (dl - ratio * dm) * per_m;
  // Without dilation or cohesion the hyperbola is its asymptotes, whose slope is the same for
  // stresses of any size. The reference code's is that of a small stress below its limit.
  const double least = as_cbgeo_ ? epsilon : least_J2, instead = as_cbgeo_ ? 1e-5 : least_J2;
  const Real Rrho = R * at.rho, omega = off * off + 1.5 * Rrho * Rrho;
  const Real factor =
      1.5 * Rrho * inverse_sqrt(select(greater(omega, Real(least)), omega, Real(instead)));
  to.g.p = select(tension, Real(1.0), s.tan_psi);
  to.g.rho = factor * R;
  to.g.theta = factor * dR * per_theta;
  to.per_strain = root2_3 * to.g.rho;
}

/// At stresses of the lanes `edge` nothing changes along theta.
template <class Real>
LAHAR_INLINE MohrCoulombUpdate::Direction<Real> MohrCoulombUpdate::direction(
    const Invariants<Real>& at, const Strength<Real>& s, const Real& pdstrain, unsigned tension,
    unsigned edge) const {
  Direction<Real> to;
  const Real sin60 = 0.5 * at.sin + (0.5 * root3) * at.cos;
  const Real cos60 = 0.5 * at.cos - (0.5 * root3) * at.sin;
  const Real per_theta = select(edge, Real(0.0), Real(1.0));
  to.f.p = select(tension, Real(1.0), s.sin_phi * s.per_cos);
  to.f.rho =
      select(tension, root2_3 * at.cos,
             root3_2 * s.per_cos * (sin60 * (1.0 / root3) + cos60 * s.sin_phi * (1.0 / 3.0)));
  to.f.theta = per_theta * select(tension, -root2_3 * at.sin,
                                  root3_2 * s.per_cos *
                                      (cos60 * (1.0 / root3) - sin60 * s.sin_phi * (1.0 / 3.0)));
  potential(at, s, tension, per_theta, to);
  to.softening = Real(0.0);
  if (softening_) {
    const unsigned falls =
        greater(pdstrain, Real(peak_pdstrain_)) & greater(Real(residual_pdstrain_), pdstrain);
    const double range = residual_pdstrain_ - peak_pdstrain_;
    const double dphi = (residual_.phi - peak_.phi) / range,
                 dc = (residual_.cohesion - peak_.cohesion) / range;
    const Real df_dphi =
        s.per_cos * s.per_cos *
        (root3_2 * at.rho * (s.sin_phi * sin60 * (1.0 / root3) + cos60 * (1.0 / 3.0)) + at.p);
    to.softening = select(falls, -(df_dphi * dphi - dc) * to.per_strain, Real(0.0));
  }
  return to;
}

/// By how much a yield function falls per multiplier [Pa]. Softening faster than elasticity can
/// follow would turn its sign; the strength is that before the increment, so that a bound changes
/// how fast the return converges, not where it ends.
template <class Real>
LAHAR_INLINE Real MohrCoulombUpdate::resistance(const Direction<Real>& d) const {
  const Real elastic = stiffness_between(d.f, d.g, K_, G_);
  if (!softening_ || as_cbgeo_) return elastic + d.softening;
  return max(elastic + d.softening, 0.5 * elastic);
}

template <int Dim, class Real>
LAHAR_INLINE Failures MohrCoulombUpdate::update(const LawInput<Dim, Real>& in, Real* stress,
                                                Real* q) const {
  constexpr int rows = stress_components<Dim>;
  const Strength<Real> s = strength(q);
  Real trial[rows];
  LAHAR_UNROLL
  for (int k = 0; k < rows; ++k) trial[k] = stress[k];
  elastic_trial<Dim>(in, K_, G_, trial);
  leave_axes<rows>(trial, K_, true);
  StressPoint<rows, Real> at;
  deviator_of(trial, at);
  // Inside cones that lie inside the yield surfaces: elastic without looking at the Lode angle.
  const double margin = as_cbgeo_ ? cbgeo_tolerance : 0.0;
  const unsigned near_tension = greater(root2_3 * at.rho + at.p, Real(cutoff_ - margin));
  const unsigned near_shear =
      greater(root3_2 * s.widest * at.rho + at.p * s.sin_phi, (s.cohesion - margin) * s.cos_phi);
  unsigned left = 0;
  Failures failures;
  if ((near_tension | near_shear) & in.active) {
    Real start[rows], returned[rows], pdstrain = q[6];
    LAHAR_UNROLL
    for (int k = 0; k < rows; ++k) start[k] = stress[k], returned[k] = trial[k];
    left = in.large
               ? return_from_far<rows>(returned, s, pdstrain, at, in.active)
               : return_to_surface<rows>(start, returned, s, pdstrain, at, in.active, pack_steps);
    if (left) failures = update_lane_by_lane<Dim>(*this, in, start, q, left);
    q[6] = select(left, q[6], pdstrain);
    LAHAR_UNROLL
    for (int k = 0; k < rows; ++k) trial[k] = select(left, start[k], returned[k]);
  }
  LAHAR_UNROLL
  for (int k = 0; k < rows; ++k) stress[k] = trial[k];
  return failures;
}

/// The lanes whose stress is on the surface of tension or at the apex.
template <int Rows, class Real>
LAHAR_INLINE unsigned MohrCoulombUpdate::at_tension_limit(const Real* stress, const Real* state,
                                                          const Real& tolerance) const {
  StressPoint<Rows, Real> at;
  deviator_of(stress, at);
  const Real near =
      tolerance + on_surface * (at.rho + max(at.p, -at.p)) + (as_cbgeo_ ? cbgeo_tolerance : 0.0);
  unsigned limit = greater(root2_3 * at.rho + at.p + near, Real(cutoff_));
  if (limit) {
    lode_of(at, least_J2_);
    limit &= greater(root2_3 * at.cos * at.rho + at.p + near, Real(cutoff_));
  }
  Real q[MohrCoulomb::state.size()];
  LAHAR_UNROLL
  for (std::size_t k = 0; k < MohrCoulomb::state.size(); ++k) q[k] = state[k];
  const Strength<Real> s = strength(q);
  return limit | (greater(at.p + near, s.apex) & greater(near, at.rho));
}

template <class Number>
void MohrCoulombUpdate::elastic_stress(const IncrementOf<Number>& in, const VoigtOf<Number>& stress,
                                       PackOfOne<Number>* trial) const {
  const Number volumetric = (K_ - 2.0 / 3.0 * G_) * (in.strain[0] + in.strain[1] + in.strain[2]);
  for (int k = 0; k < 6; ++k) {
    const Number strain = in.strain[static_cast<std::size_t>(k)];
    trial[k] = PackOfOne<Number>(stress[static_cast<std::size_t>(k)]) +
               (k < 3 ? volumetric + 2.0 * G_ * strain : G_ * strain);
  }
  leave_axes<6>(trial, K_, true);
}

template <class Number>
bool MohrCoulombUpdate::update_one(const IncrementOf<Number>& in, VoigtOf<Number>& stress,
                                   Number* state) const {
  using Real = PackOfOne<Number>;
  Real q[7], start[6], trial[6];
  for (int k = 0; k < 7; ++k) q[k] = Real(state[k]);
  const Strength<Real> s = strength(q);
  for (int k = 0; k < 6; ++k) start[k] = Real(stress[static_cast<std::size_t>(k)]);
  elastic_stress(in, stress, trial);
  StressPoint<6, Real> at;
  deviator_of(trial, at);
  if (in.large ? return_from_far<6>(trial, s, q[6], at, 1)
               : return_to_surface<6>(start, trial, s, q[6], at, 1, single_steps))
    return false;
  for (int k = 0; k < 6; ++k) stress[static_cast<std::size_t>(k)] = lane_of(trial[k], 0);
  for (int k = 0; k < 7; ++k) state[k] = lane_of(q[k], 0);
  return true;
}

/// Where no part of an increment converges: the elastic stress, its mean limited to the tension at
/// the apex, its deviator reduced until the stress is allowed. So there is always a result.
template <class Number>
void MohrCoulombUpdate::land(const IncrementOf<Number>& in, VoigtOf<Number>& stress,
                             Number* state) const {
  using Real = PackOfOne<Number>;
  Real q[7], trial[6];
  for (int k = 0; k < 7; ++k) q[k] = Real(state[k]);
  const Strength<Real> s = strength(q);
  elastic_stress(in, stress, trial);
  StressPoint<6, Real> point;
  point_of(trial, point, least_J2_);
  Invariants<Real> at = invariants_of(point);
  const auto number = [](const Real& pack) -> Number { return lane_of(pack, 0); };
  const Number apex = number(s.sin_phi) > 0
                          ? number(s.cohesion) * number(s.cos_phi) / number(s.sin_phi)
                          : Number(HUGE_VAL);
  at.p = Real(std::min({number(at.p), Number(cutoff_), apex}));
  // Both yield functions are linear in rho.
  Real ft, fs, ft0, fs0;
  yield_functions(at, s, ft, fs);
  at.rho = Real(0.0);
  yield_functions(at, s, ft0, fs0);
  const auto share = [](const Number& f0, const Number& f) {
    return f > 0 ? std::clamp<Number>(-f0 / (f - f0), 0.0, 1.0) : Number(1.0);
  };
  const Number keep = std::min(share(number(ft0), number(ft)), share(number(fs0), number(fs)));
  for (int k = 0; k < 6; ++k)
    stress[static_cast<std::size_t>(k)] =
        keep * number(point.s[k]) + (k < 3 ? number(at.p) : Number(0.0));
  for (int k = 0; k < 7; ++k) state[k] = number(q[k]);
  state[6] += (1 - keep) * number(point.rho) * root2_3 / (2 * G_);
}

/// The first step of the return: along the tangent at the stress before, where that lies on the
/// surface. Returns the lanes that took it.
template <int Rows, class Real>
LAHAR_INLINE unsigned MohrCoulombUpdate::step_along_tangent(const Real* start, Real* stress,
                                                            const Strength<Real>& s,
                                                            const Real& size, Real& pdstrain,
                                                            unsigned lanes_to_do) const {
  StressPoint<Rows, Real> begin;
  point_of(start, begin, least_J2_);
  const Invariants<Real> at = invariants_of(begin);
  Real ft, fs;
  yield_functions(at, s, ft, fs);
  const Real near = as_cbgeo_ ? Real(cbgeo_tolerance) : on_surface * size;
  const Yield begins = yielding(at, s, ft, fs, -near);
  const Real f = select(begins.tension, ft, fs);
  // At the apex there is no tangent.
  const Real least_rho = as_cbgeo_ ? Real(0.0) : near;
  const unsigned tangent =
      begins.any() & greater(near, max(f, -f)) & greater(at.rho, least_rho) & lanes_to_do;
  if (tangent == 0) return 0;
  const DeviatoricAxes<Rows, Real> axes(begin);
  const Direction<Real> d = direction(at, s, pdstrain, begins.tension, axes.edge);
  Real increment[Rows];
  for (int k = 0; k < Rows; ++k) increment[k] = stress[k] - start[k];
  const Real multiplier = along(d.f, axes, increment) * reciprocal(resistance(d));
  for (int k = 0; k < Rows; ++k)
    stress[k] =
        select(tangent, stress[k] - multiplier * stress_of(d.g, axes, K_, G_, k), stress[k]);
  pdstrain = select(tangent, pdstrain + multiplier * d.per_strain, pdstrain);
  return tangent;
}

/// `stress` is the trial stress before and the stress that the law allows after; `trial` is that
/// point with deviator_of(). Returns the lanes of `lanes_to_do` that need more than `steps` steps.
/// Their results are not meant to be used.
template <int Rows, class Real>
unsigned MohrCoulombUpdate::return_to_surface(const Real* start, Real* stress,
                                              const Strength<Real>& s, Real& pdstrain,
                                              const StressPoint<Rows, Real>& trial,
                                              unsigned lanes_to_do, int steps) const {
  StressPoint<Rows, Real> point = trial;
  lode_of(point, least_J2_);
  const Real size = trial.rho + max(trial.p, -trial.p) + s.cohesion;
  const Real tolerance = as_cbgeo_ ? Real(cbgeo_tolerance) : rounding * size;
  Real ft, fs;
  yield_functions(invariants_of(point), s, ft, fs);
  // The reference code takes what is within its tolerance of the surface as yielding.
  const Real above = as_cbgeo_ ? Real(-cbgeo_tolerance) : tolerance;
  Yield yield = yielding(invariants_of(point), s, ft, fs, above);
  const unsigned plastic = yield.any() & lanes_to_do;
  if (plastic == 0) return 0;
  unsigned left = plastic;
  const Real before = pdstrain;
  const unsigned tangent = step_along_tangent<Rows>(start, stress, s, size, pdstrain, left);

  // The tangent may end inside of the surface, where it is curved: then it goes back to it, unless
  // the surface itself comes to meet it in the next increment.
  unsigned hard = as_cbgeo_ ? 0u : left;
  if (softening_)
    hard &= ~(greater(before, Real(peak_pdstrain_)) & greater(Real(residual_pdstrain_), before));
  const Real apex = -max(Real(-cutoff_), -s.apex);
  const unsigned beyond_apex = as_cbgeo_ ? 0u : greater(trial.p, apex - tolerance);
  const unsigned keeps_mean = ~greater(s.tan_psi, Real(0.0));
  // Also where most lanes have the trial stress still: a lane's bits must not depend on whether
  // another one has moved along its tangent.
  point_of(stress, point, least_J2_);
  DeviatoricPlane<Rows, Real> plane(point);
  const unsigned edge = plane.edge();  // where the angle does not change any more
  bool first = true;
  for (int step = 0; step <= steps; ++step) {
    Real order;
    const Invariants<Real> at = plane.invariants(order);
    yield_functions(at, s, ft, fs);
    yield = yielding(at, s, ft, fs, above);
    const Real worst = max(ft, fs);
    unsigned beyond = greater(worst, tolerance) |
                      outside(ft + fs, std::numeric_limits<double>::max(), lanes<Real>);
    const unsigned inside = hard & greater(-tolerance, worst);
    yield.tension |= inside & greater(ft, fs);
    beyond |= inside;
    // At the first step lanes without a tangent go on from the trial stress, beyond or not.
    left &= first ? beyond | ~tangent : beyond;
    if (left == 0) break;
    first = false;
    const Direction<Real> d = direction(at, s, before, yield.tension, edge);
    const Real multiplier = select(yield.tension, ft, fs) * reciprocal(resistance(d));
    const Real per_rho = (2.0 * G_) * multiplier * at.per_rho;
    const Real radial = per_rho * d.g.rho, turn = per_rho * order * d.g.theta;
    // Where the deviator would be reversed, or there is none, and the trial stress is at the apex
    // or beyond, it returns there; so it does where shear keeps the mean stress of the apex, as
    // between grains whose gaps close: steps from sector to sector would come nearer and nearer to
    // it.
    const unsigned at_apex = ~yield.tension & greater(tolerance, abs(plane.p - s.apex));
    const unsigned to_apex =
        left & beyond_apex &
        ((keeps_mean & at_apex) | greater(radial, Real(1.0)) | ~greater(at.rho, tolerance));
    const Real x = plane.x - radial * plane.x + turn * plane.y,
               y = plane.y - radial * plane.y - turn * plane.x;
    const Real whole = before + (0.5 / G_ * root2_3) * trial.rho;
    plane.p = select(left, select(to_apex, apex, plane.p - K_ * multiplier * d.g.p), plane.p);
    plane.x = select(left, select(to_apex, Real(0.0), x), plane.x);
    plane.y = select(left, select(to_apex, Real(0.0), y), plane.y);
    pdstrain = select(left, select(to_apex, whole, pdstrain + multiplier * d.per_strain), pdstrain);
    left &= ~to_apex;
    if (left == 0) break;
  }
  // A step back to the surface, or a tangent that the increment leaves, takes from it.
  if (!as_cbgeo_) pdstrain = select(plastic, max(pdstrain, before), pdstrain);
  LAHAR_UNROLL
  for (int k = 0; k < Rows; ++k) stress[k] = select(plastic, plane.stress(k), stress[k]);
  return left;
}

/// The same from the trial stress alone, for increments of any size: see MohrCoulombReturn. Lane by
/// lane; returns the lanes where it was not found.
template <int Rows, class Real>
unsigned MohrCoulombUpdate::return_from_far(Real* stress, const Strength<Real>& s, Real& pdstrain,
                                            const StressPoint<Rows, Real>& trial,
                                            unsigned lanes_to_do) const {
  using Number = NumberOf<Real>;
  using Return = MohrCoulombReturn;
  StressPoint<Rows, Real> point = trial;
  lode_of(point, least_J2_);
  const Real size = trial.rho + max(trial.p, -trial.p) + s.cohesion;
  Real ft, fs;
  yield_functions(invariants_of(point), s, ft, fs);
  // What leave_axes() moved does not yield by that.
  const Real above = rounding * size + (is_dual<Real> ? most_move(trial.p, K_) : Real(0.0));
  const unsigned plastic = (greater(ft, above) | greater(fs, above)) & lanes_to_do;
  if (plastic == 0) return 0;
  DeviatoricPlane<Rows, Real> plane(point);
  unsigned left = 0;
  for (int lane = 0; lane < lanes<Real>; ++lane) {
    if (!(plastic >> lane & 1)) continue;
    const auto of = [&](const Real& pack) { return value_of(lane_of(pack, lane)); };
    const double unit = std::max(of(size), least_unit), per = 1 / unit;
    const double per_cos = of(s.per_cos), sin_phi = of(s.sin_phi), tan_psi = of(s.tan_psi);
    const std::array<Return::Surface, 2> surfaces{
        {{root3_2 * per_cos * (0.5 + sin_phi / 6.0),
          root3_2 * per_cos * (0.5 / root3 - root3 / 6.0 * sin_phi), sin_phi * per_cos,
          per * of(s.cohesion)},
         {root2_3, 0.0, 1.0, per * cutoff_}}};
    const std::array<Return::Potential, 2> potentials{
        {{of(s.eccentricity), of(s.scale), per * hyperbola_ * tan_psi, tan_psi},
         {tension_eccentricity, tension_scale, per * offset_share * cutoff_, 1.0}}};
    Return to(surfaces, potentials, K_ / (2.0 * G_), per * std::min(cutoff_, of(s.apex)));
    const Return::PointOf<Number> begin{per * lane_of(plane.x, lane), per * lane_of(plane.y, lane),
                                        per * lane_of(plane.p, lane)};
    if (!to.solve({value_of(begin.x), value_of(begin.y), value_of(begin.p)})) {
      left |= 1u << lane;
      continue;
    }
    const Return::PointOf<Number> end = to.end(begin);
    // The plastic strain that makes the deviator smaller, as in steps along tangents.
    using std::hypot;
    const Number plastic_part = hypot(begin.x, begin.y) - hypot(end.x, end.y);
    set_lane(plane.x, lane, unit * end.x);
    set_lane(plane.y, lane, unit * end.y);
    set_lane(plane.p, lane, unit * end.p);
    if (value_of(plastic_part) > 0)
      set_lane(pdstrain, lane,
               lane_of(pdstrain, lane) + (0.5 / G_ * root2_3 * unit) * plastic_part);
  }
  LAHAR_UNROLL
  for (int k = 0; k < Rows; ++k) stress[k] = select(plastic & ~left, plane.stress(k), stress[k]);
  return left;
}

}  // namespace lahar
