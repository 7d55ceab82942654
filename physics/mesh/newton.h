/// \file Newton's method for the inverse of a cell's map. Private to the inverse mappings.
#pragma once

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>

#include "physics/mesh/inverse_mapping.h"

namespace lahar {

inline double cross(const Vec<2>& a, const Vec<2>& b) {
  return a[0] * b[1] - a[1] * b[0];
}

/// Solve J s = r by Cramer's rule; false if det J is not positive (beyond the region where the map
/// is one to one).
inline bool solve_positive(const Eigen::Matrix<double, 2, 2>& J, const Vec<2>& r, Vec<2>& s) {
  const double det = cross(J.col(0), J.col(1));
  s = Vec<2>(cross(r, J.col(1)), cross(J.col(0), r)) / det;
  return det > 0 && s.allFinite();
}

inline bool solve_positive(const Eigen::Matrix<double, 3, 3>& J, const Vec<3>& r, Vec<3>& s) {
  const Vec<3> a = J.col(0), b = J.col(1), c = J.col(2);
  const Vec<3> bc = b.cross(c);
  const double det = a.dot(bc);
  s = Vec<3>(r.dot(bc), r.dot(c.cross(a)), r.dot(a.cross(b))) / det;
  return det > 0 && s.allFinite();
}

/// Find map.value(xi) = 0 from the start that xi holds, with backtracking: steps are halved until
/// the residual shrinks and the Jacobian map.gradient(xi) is positive. False where that fails; xi
/// is then the last iterate. `residual` [m]: |map.value(xi)| before the last step.
template <int Dim, class Map>
bool newton(const Map& map, Vec<Dim>& xi, double& residual) {
  Vec<Dim> f = map.value(xi), step;
  residual = f.norm();
  if (!solve_positive(map.gradient(xi), f, step)) return false;
  for (int iteration = 0; iteration < newton_max_steps; ++iteration) {
    if (step.template lpNorm<Eigen::Infinity>() < newton_step_tolerance) {
      xi -= step;
      return true;
    }
    // Halve the step until the residual shrinks and the next step exists.
    bool accepted = false;
    for (int halving = 0; halving < newton_max_halvings && !accepted; ++halving) {
      const Vec<Dim> trial = xi - step;
      f = map.value(trial);
      const double smaller = f.norm();
      Vec<Dim> next;
      accepted = smaller < residual && solve_positive(map.gradient(trial), f, next);
      if (accepted) {
        xi = trial;
        residual = smaller;
        step = next;
      } else {
        step *= 0.5;
      }
    }
    if (!accepted) return false;
  }
  return false;
}

}  // namespace lahar
