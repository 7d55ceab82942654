/// \file The map between natural and physical coordinates of a Q4 or H8 cell, and its inverse.
///
/// A corner of tensor number a lies at natural coordinates xi_d = corner_sign(a, d). With the shape
/// functions N_a(xi) = prod_d (1 + corner_sign(a, d) xi_d) / 2 the cell is x(xi) = sum_a N_a(xi)
/// X_a.
#pragma once

#include <limits>

#include "physics/mesh/mesh.h"

namespace lahar {

/// Side of natural axis d on which corner a (tensor order) lies: -1 or +1.
constexpr double corner_sign(int a, int d) {
  return (a >> d) & 1 ? 1.0 : -1.0;
}

/// Position in tensor order of corner k in file order, and the other way round (it is its own
/// inverse).
constexpr int tensor_corner(int k) {
  return (k & 2) ? k ^ 1 : k;
}

/// Largest natural coordinate that a particle is given: a closed cell's face is pulled inside by
/// one rounding unit, as in the reference code.
inline constexpr double xi_max = 1.0 - std::numeric_limits<double>::epsilon();

/// Newton's method for H8 stops after a step that is shorter than this [natural coordinates]. Its
/// error is then of the order of the square of the step: below rounding.
inline constexpr double newton_step_tolerance = 1e-8;
/// Times that a step which does not reduce the distance to the point is halved.
inline constexpr int newton_max_halvings = 12;
/// Newton steps before a point counts as not found. In a valid cell 3 to 6 are needed.
inline constexpr int newton_max_steps = 25;

/// True if -1 <= xi <= 1 on every axis, without tolerance; false for NaN.
template <int Dim>
inline bool in_closed_cell(const Vec<Dim>& xi) {
  bool inside = true;
  for (int d = 0; d < Dim; ++d) inside &= xi[d] >= -1.0 && xi[d] <= 1.0;
  return inside;
}

/// xi limited to [-xi_max, xi_max] on every axis.
template <int Dim>
inline Vec<Dim> clamp_to_cell(const Vec<Dim>& xi) {
  return xi.cwiseMin(xi_max).cwiseMax(-xi_max);
}

/// x(xi) [m], from the corners (also in a Cartesian cell).
template <int Dim>
Vec<Dim> to_physical(const CellGeometry<Dim>& cell, const Vec<Dim>& xi);

/// J(i, d) = dx_i / dxi_d [m], from the corners (also in a Cartesian cell).
template <int Dim>
Eigen::Matrix<double, Dim, Dim> jacobian(const CellGeometry<Dim>& cell, const Vec<Dim>& xi);

/// The inverse map from the corners alone. Q4: the root of the quadratic on which the Jacobian is
/// positive, and one Newton step against rounding. H8: the affine part of the map as first guess,
/// then Newton with backtracking. Returns false, with xi the affine estimate, where no point of the
/// extended cell maps to x or the iteration does not end; both happen only outside a valid cell.
template <int Dim>
bool inverse_map_isoparametric(const CellGeometry<Dim>& cell, const Vec<Dim>& x, Vec<Dim>& xi);

/// Newton's method (with backtracking) from a given start; xi is the last iterate, returns whether
/// it converged. `residual` [m]: distance of x(xi) from x. For points that inverse_map() could not
/// map.
template <int Dim>
bool inverse_map_newton(const CellGeometry<Dim>& cell, const Vec<Dim>& x, Vec<Dim>& xi,
                        double& residual);

/// Natural coordinates of x, which may lie outside the cell (|xi| > 1); the direction in which the
/// cell was left is right even where false is returned. Neither throws nor allocates.
template <int Dim>
inline bool inverse_map(const CellGeometry<Dim>& cell, const Vec<Dim>& x, Vec<Dim>& xi) {
  if (!cell.cartesian) return inverse_map_isoparametric(cell, x, xi);
  for (int d = 0; d < Dim; ++d) xi[d] = 2.0 * (x[d] - cell.centre[d]) / cell.length[d];
  return true;
}

}  // namespace lahar
