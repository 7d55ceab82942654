/// \file Stress around a circular hole in an elastic plate, as a series that is exact term by term.
///
/// Plane elasticity without body force, symmetric about both axes, hole free of traction: Airy's
/// function is a sum over even n of r^k cos(n theta), k = n, n + 2, -n, 2 - n (Michell 1899); that
/// the hole is free gives the last two coefficients from the first two. Every term satisfies
/// equilibrium and compatibility. The stress beside the hole does not depend on the elastic
/// constants.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "physics/base/types.h"

namespace lahar {

/// In-plane stresses xx, yy, xy.
using PlaneStress = Vec<3>;

class HoleSeries {
 public:
  /// `radius` of the hole around the origin [m]; `reach`, the largest distance at which the series
  /// will be evaluated [m], scales its terms; `terms` angular orders n = 0, 2, ...
  HoleSeries(double radius, double reach, int terms);

  /// Least squares on stresses at points.
  void fit(const std::vector<Vec<2>>& points, const std::vector<PlaneStress>& stress);
  /// Least squares on the tractions of a rectangular plate, pulled evenly at its ends x =
  /// +-length/2 by `traction` [Pa], free at its sides y = +-width/2. Returns the largest error left
  /// [Pa].
  double fit_tension(double length, double width, double traction);

  PlaneStress stress(const Vec<2>& x) const;

 private:
  Eigen::Matrix<double, 3, Eigen::Dynamic> basis(const Vec<2>& x) const;
  int functions() const { return 2 * terms_ - 1; }

  double radius_, scale_;
  int terms_;
  Eigen::VectorXd coefficients_;
};

}  // namespace lahar
