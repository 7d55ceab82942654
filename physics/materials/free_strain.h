/// \file The strain increment for which a component of a law's stress is zero.
#pragma once

#include <utility>

#include "physics/base/simd.h"

namespace lahar {

/// Rounding of a stress that is to be zero, as a share of the stresses of the increment.
inline constexpr double free_stress_tolerance = 1e-11;
/// Errors of laws are smaller shares of these stresses (soil_stress.h). More than this means that
/// no stress without this component was found.
inline constexpr double most_free_stress = 1e-3;
/// A stress that so small an elastic strain makes counts as none [-]: laws of soils are no more
/// exact where they bear nothing.
inline constexpr double least_free_strain = 1e-7;

/// The strain increment e, lane by lane, for which `stress_of(e, open)` is zero, but for
/// free_stress_tolerance times `scale` [Pa]. Only the lanes in `open` count. It is Newton's method
/// with secants, from the slope `modulus` of waves on, the present one: exact for linear
/// elasticity. Where values of both signs are known it stays between them, and halves their
/// distance at times, so that kinks of a law, or a stress that does not change, do not stop it.
/// Where the stress jumps over zero, or keeps its sign up to a strain that no material needs, the
/// strain is that for which it was nearest to zero: see stress_is_left(). A lane does not depend
/// on others.
template <class Real, class Stress>
LAHAR_INLINE Real strain_without_stress(unsigned active, const Real& modulus, const Real& scale,
                                        Stress stress_of) {
  constexpr int most_iterations = 100, secants = 8;
  constexpr double least_slope = 1e-3;  // of the modulus
  constexpr double most_share = 1e3;    // of the strain that is elastic at the stresses about
  const Real tolerance = free_stress_tolerance * scale;
  Real e(0.0), s = stress_of(e, active), slope(modulus), low(0.0), high(0.0), reach(1.0);
  const Real most = (most_share / modulus) * (scale + abs(s));
  Real nearest(0.0), least = abs(s);
  unsigned has_low = 0, has_high = 0, open = active & greater(abs(s), tolerance);
  for (int k = 0; k < most_iterations && open != 0; ++k) {
    const unsigned above = open & greater(s, Real(0.0)), below = open & ~above;
    high = select(above, e, high);
    low = select(below, e, low);
    has_high |= above;
    has_low |= below;
    const unsigned both = has_low & has_high;
    Real next = e - s * reach / slope;
    const unsigned inside = greater(next, low) & greater(high, next);
    const unsigned halved = both & (k > secants && k % 2 == 1 ? open : ~inside);
    next = select(halved, Real(0.5 * (low + high)), next);
    const unsigned lost = open & ~both & greater(abs(next), most);
    e = select(lost, nearest, e);
    open &= ~lost;
    if (open == 0) break;
    const Real after = stress_of(next, open), secant = (after - s) / (next - e);
    const unsigned steep = greater(secant, Real(least_slope * modulus));
    slope = select(open, select(steep, secant, Real(modulus)), slope);
    // Where the stress hardly changes, steps grow until its sign does.
    reach = select(open & ~steep & ~both, Real(2.0 * reach), Real(1.0));
    e = select(open, next, e);
    s = select(open, after, s);
    const unsigned nearer = open & greater(least, abs(s));
    nearest = select(nearer, e, nearest);
    least = select(nearer, abs(s), least);
    open &= greater(abs(s), tolerance);
  }
  return select(open, nearest, e);
}

/// Lanes with a stress [Pa] where there should be none: the search has found no zero. `scale` as
/// above; `modulus` is the largest one of the law [Pa].
template <class Real>
LAHAR_INLINE unsigned stress_is_left(const Real& stress, const Real& scale, double modulus) {
  const Real least(least_free_strain * modulus);
  return greater(abs(stress), max(Real(most_free_stress * scale), least));
}

}  // namespace lahar
