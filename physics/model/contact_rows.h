/// \file Rows of particles beside a surface that cuts their cells (rigid_contact.h).
#pragma once

#include <Eigen/Core>

namespace lahar {

/// Rows of particles lie along a surface of this normal.
template <int Dim>
bool is_along_axis(const Eigen::Matrix<double, Dim, 1>& normal) {
  return normal.cwiseAbs().maxCoeff() > 0.99;
}

/// Distance of a particle to the end of the material in front of it, over half of its edge, from
/// which on this sliver holds what touches the surface: it is 0.35 of a particle thick.
inline constexpr double behind_sliver = 1.7;

}  // namespace lahar
