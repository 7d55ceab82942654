/// \file Functions of one axis on a grid of equal cells, from which functions in space are
/// products. Four nodes matter in a cell, at s = -1, 0, 1 and 2 with s from 0 to 1 across it.
#pragma once

#include "physics/base/simd.h"

namespace lahar {

inline constexpr int axis_nodes = 4;

/// Quadratic B-splines centred at nodes, with knots midway between them (Steffen, Kirby & Berzins
/// 2008).
struct QuadraticSpline {
  static constexpr double spread = 0.25;  ///< sum_k w_k (k - s)^2, anywhere but at walls
  static constexpr int per_particle = 3;  ///< nodes whose functions may not be zero at one place
  template <class Real>
  LAHAR_INLINE static void at(const Real& s, Real (&w)[axis_nodes]) {
    const Real left = max(Real(0.0), 0.5 - s), right = max(Real(0.0), s - 0.5), t = 1.0 - s;
    const Real left2 = left * left, right2 = right * right;
    w[0] = 0.5 * left2;
    w[1] = (0.75 - s * s) + 1.5 * right2;
    w[2] = (0.75 - t * t) + 1.5 * left2;
    w[3] = 0.5 * right2;
  }
  template <class Real>
  LAHAR_INLINE static void slopes(const Real& s, Real (&dw)[axis_nodes]) {
    const Real left = max(Real(0.0), 0.5 - s), right = max(Real(0.0), s - 0.5);
    dw[0] = -left;
    dw[1] = 3.0 * right - 2.0 * s;
    dw[2] = 2.0 * (1.0 - s) - 3.0 * left;
    dw[3] = right;
  }
};

/// Cubic B-splines centred at nodes, with knots there.
struct CubicSpline {
  static constexpr double spread = 1.0 / 3.0;
  static constexpr int per_particle = axis_nodes;
  template <class Real>
  LAHAR_INLINE static void at(const Real& s, Real (&w)[axis_nodes]) {
    const Real t = 1.0 - s, s2 = s * s, t2 = t * t;
    w[0] = (1.0 / 6.0) * t2 * t;
    w[1] = (2.0 / 3.0) - s2 * (1.0 - 0.5 * s);
    w[2] = (2.0 / 3.0) - t2 * (1.0 - 0.5 * t);
    w[3] = (1.0 / 6.0) * s2 * s;
  }
  template <class Real>
  LAHAR_INLINE static void slopes(const Real& s, Real (&dw)[axis_nodes]) {
    const Real t = 1.0 - s;
    dw[0] = -0.5 * (t * t);
    dw[1] = -(s * (2.0 - 1.5 * s));
    dw[2] = t * (2.0 - 1.5 * t);
    dw[3] = 0.5 * (s * s);
  }
};

/// GIMP: the mean of the linear functions over a particle's domain, which reaches from s - r to
/// s + r (Bardenhagen & Kober 2004). Only the parts of it beyond the cell make a difference to the
/// linear functions. Needs 0 < r <= 1.
struct GimpFunction {
  template <class Real>
  LAHAR_INLINE static void at(const Real& s, const Real& r, Real (&w)[axis_nodes]) {
    const Real left = max(Real(0.0), r - s), right = max(Real(0.0), s + r - 1.0);
    const Real scale = 0.25 / r, before = scale * (left * left), after = scale * (right * right);
    w[0] = before;
    w[1] = (1.0 - s) - 2.0 * before + after;
    w[2] = s + before - 2.0 * after;
    w[3] = after;
  }
  template <class Real>
  LAHAR_INLINE static void slopes(const Real& s, const Real& r, Real (&dw)[axis_nodes]) {
    const Real scale = 0.5 / r, before = -scale * max(Real(0.0), r - s),
               after = scale * max(Real(0.0), s + r - 1.0);
    dw[0] = before;
    dw[1] = after - 2.0 * before - 1.0;
    dw[2] = 1.0 + before - 2.0 * after;
    dw[3] = after;
  }
};

/// At the border of the mesh the node beyond it does not exist: its value is taken as that on the
/// straight line through the two nodes inside. Functions then still sum to one and reproduce linear
/// fields up to the wall; splines become those of Steffen et al. (2008), of which only the wall
/// node's own is not zero at the wall; GIMP becomes linear functions there.
template <class Real>
LAHAR_INLINE void fold_first(Real (&w)[axis_nodes]) {
  w[1] += 2.0 * w[0];
  w[2] -= w[0];
  w[0] = Real(0.0);
}
template <class Real>
LAHAR_INLINE void fold_last(Real (&w)[axis_nodes]) {
  w[2] += 2.0 * w[3];
  w[1] -= w[3];
  w[3] = Real(0.0);
}

}  // namespace lahar
