/// \file Inverse mapping of the bilinear quadrilateral (closed form) and the trilinear hexahedron.
#include "physics/mesh/inverse_mapping.h"

#include <algorithm>
#include <cmath>

#include "physics/mesh/cell_polynomial.h"
#include "physics/mesh/newton.h"

namespace lahar {
namespace {

template <int Dim>
using Matrix = Eigen::Matrix<double, Dim, Dim>;

/// x(xi) - x0 as a polynomial: c[m] is the factor of the product of those xi_d whose bit is set in
/// m. Taking x0 off the corners first keeps full precision far from the origin.
template <int Dim>
struct Multilinear {
  std::array<Vec<Dim>, corners<Dim>> c;

  Multilinear(const CellGeometry<Dim>& cell, const Vec<Dim>& x0) {
    for (int a = 0; a < corners<Dim>; ++a) c[a] = cell.corner[a] - x0;
    corners_to_coefficients<Dim>(c);
    for (auto& factor : c) factor /= corners<Dim>;
  }

  Vec<Dim> value(const Vec<Dim>& xi) const {
    if constexpr (Dim == 2) {
      return c[0] + xi[0] * c[1] + xi[1] * (c[2] + xi[0] * c[3]);
    } else {
      return c[0] + xi[0] * c[1] + xi[1] * (c[2] + xi[0] * c[3]) +
             xi[2] * (c[4] + xi[0] * c[5] + xi[1] * (c[6] + xi[0] * c[7]));
    }
  }

  Matrix<Dim> gradient(const Vec<Dim>& xi) const {
    Matrix<Dim> J;
    if constexpr (Dim == 2) {
      J.col(0) = c[1] + xi[1] * c[3];
      J.col(1) = c[2] + xi[0] * c[3];
    } else {
      J.col(0) = c[1] + xi[1] * c[3] + xi[2] * (c[5] + xi[1] * c[7]);
      J.col(1) = c[2] + xi[0] * c[3] + xi[2] * (c[6] + xi[0] * c[7]);
      J.col(2) = c[4] + xi[0] * c[5] + xi[1] * (c[6] + xi[0] * c[7]);
    }
    return J;
  }

  /// The map without its products of coordinates: exact in a parallelepiped.
  Matrix<Dim> linear_part() const {
    Matrix<Dim> A;
    for (int d = 0; d < Dim; ++d) A.col(d) = c[1 << d];
    return A;
  }
};

/// With x(xi) - x = -r + b xi + c eta + d xi eta = 0, eliminating eta leaves A xi^2 + B xi + C = 0.
/// At a root 2 A xi + B = -det J, so that the root sought has the negative sign of the square root.
bool invert_quadrilateral(const Multilinear<2>& map, Vec<2>& xi) {
  const Vec<2> r = -map.c[0];
  const Vec<2>&b = map.c[1], &c = map.c[2], &d = map.c[3];
  const double A = -cross(b, d);
  const double B = cross(r, d) - cross(b, c);
  const double C = cross(r, c);
  const double discriminant = B * B - 4 * A * C;
  if (!(discriminant >= 0)) return false;
  const double root = std::sqrt(discriminant);
  // Both forms are the same root; each is free of cancellation for its sign of B. B < 0 inside.
  const double s = B <= 0 ? 2 * C / (root - B) : (-B - root) / (2 * A);
  const Vec<2> edge = c + s * d;
  const double t = (r - s * b).dot(edge) / edge.squaredNorm();
  if (!std::isfinite(s) || !std::isfinite(t)) return false;
  xi = {s, t};
  Vec<2> step;
  if (solve_positive(map.gradient(xi), map.value(xi), step)) xi -= step;
  return true;
}

bool invert_hexahedron(const Multilinear<3>& map, const Vec<3>& guess, Vec<3>& xi) {
  xi = guess;
  // The Jacobian is positive in the cell; far outside it may not be: start from the boundary there.
  if (!(map.gradient(xi).determinant() > 0)) xi = clamp_to_cell<3>(xi);
  double residual;
  return newton<3>(map, xi, residual);
}

}  // namespace

template <int Dim>
Vec<Dim> to_physical(const CellGeometry<Dim>& cell, const Vec<Dim>& xi) {
  Vec<Dim> x = Vec<Dim>::Zero();
  for (int a = 0; a < corners<Dim>; ++a) {
    double N = 1;
    for (int d = 0; d < Dim; ++d) N *= 0.5 * (1.0 + corner_sign(a, d) * xi[d]);
    x += N * cell.corner[a];
  }
  return x;
}

template <int Dim>
Eigen::Matrix<double, Dim, Dim> jacobian(const CellGeometry<Dim>& cell, const Vec<Dim>& xi) {
  return Multilinear<Dim>(cell, cell.corner[0]).gradient(xi);
}

template <int Dim>
bool inverse_map_isoparametric(const CellGeometry<Dim>& cell, const Vec<Dim>& x, Vec<Dim>& xi) {
  const Multilinear<Dim> map(cell, x);
  const auto affine = [&]() -> Vec<Dim> { return -(map.linear_part().inverse() * map.c[0]); };
  if constexpr (Dim == 2) {
    if (invert_quadrilateral(map, xi)) return true;
    xi = affine();
    return false;
  } else {
    const Vec<3> guess = affine();
    if (invert_hexahedron(map, guess, xi)) return true;
    xi = guess;
    return false;
  }
}

template <int Dim>
bool inverse_map_newton(const CellGeometry<Dim>& cell, const Vec<Dim>& x, Vec<Dim>& xi,
                        double& residual) {
  return newton<Dim>(Multilinear<Dim>(cell, x), xi, residual);
}

template Vec<2> to_physical(const CellGeometry<2>&, const Vec<2>&);
template Vec<3> to_physical(const CellGeometry<3>&, const Vec<3>&);
template Matrix<2> jacobian(const CellGeometry<2>&, const Vec<2>&);
template Matrix<3> jacobian(const CellGeometry<3>&, const Vec<3>&);
template bool inverse_map_isoparametric(const CellGeometry<2>&, const Vec<2>&, Vec<2>&);
template bool inverse_map_isoparametric(const CellGeometry<3>&, const Vec<3>&, Vec<3>&);
template bool inverse_map_newton(const CellGeometry<2>&, const Vec<2>&, Vec<2>&, double&);
template bool inverse_map_newton(const CellGeometry<3>&, const Vec<3>&, Vec<3>&, double&);

}  // namespace lahar
