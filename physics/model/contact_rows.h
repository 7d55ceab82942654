/// \file Rows of particles beside a surface that cuts their cells (rigid_contact.h).
#pragma once

#include <Eigen/Core>

namespace lahar {

/// Rows of particles lie along a surface of this normal.
template <int Dim>
bool is_along_axis(const Eigen::Matrix<double, Dim, 1>& normal) {
  return normal.cwiseAbs().maxCoeff() > 0.99;
}

}  // namespace lahar
