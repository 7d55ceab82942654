/// \file Gauss's points of cells with linear functions, for integrals over a cell as if its
/// material filled all of it evenly.
#pragma once

#include <Eigen/LU>
#include <array>
#include <cmath>

#include "physics/basis/linear_basis.h"

namespace lahar {

template <int Dim, int Nodes>
struct QuadraturePoint {
  double weight;  ///< share of the cell's volume
  double N[Nodes];
  double dN[Dim][Nodes];  ///< [1/m]
};

/// Functions of a basis at its particle p.
template <int Dim, class Basis>
QuadraturePoint<Dim, Basis::nodes> functions_at(const Basis& basis, Local p) {
  QuadraturePoint<Dim, Basis::nodes> point;
  Scalar N[Basis::nodes], dN[Dim][Basis::nodes];
  basis.functions(p, N);
  basis.gradients(p, dN);
  point.weight = 1.0;
  for (int i = 0; i < Basis::nodes; ++i) {
    point.N[i] = N[i][0];
    for (int d = 0; d < Dim; ++d) point.dN[d][i] = dN[d][i][0];
  }
  return point;
}

/// Two points per axis of Q4 and H8, which are exact for products of two gradients in boxes.
template <int Dim>
using CornerPoints = std::array<QuadraturePoint<Dim, corners<Dim>>, 1 << Dim>;

/// Natural coordinates of these points.
template <int Dim>
inline const auto corner_places = [] {
  std::array<std::array<double, 1 << Dim>, Dim> places;
  for (std::size_t d = 0; d < Dim; ++d)
    for (std::size_t g = 0; g < places[d].size(); ++g)
      places[d][g] = (g >> d & 1 ? 1.0 : -1.0) / std::sqrt(3.0);
  return places;
}();

/// The points of a cell with this map, whose rows become their places.
template <int Dim, class Map>
CornerPoints<Dim> corner_points(Map map) {
  for (std::size_t d = 0; d < Dim; ++d) {
    map.rows[d] = corner_places<Dim>[d].data();
    if constexpr (requires { map.origin; }) map.origin[d] = 0.0, map.per_unit[d] = 1.0;
  }
  const LinearBasis<Dim, Map> basis{map};
  CornerPoints<Dim> points;
  double volume = 0;
  for (std::size_t g = 0; g < points.size(); ++g) {
    points[g] = functions_at<Dim>(basis, static_cast<Local>(g));
    Scalar one[Dim][Dim], ds[Dim][Dim];  // ds[k][d] = ds_k/dx_d
    for (int k = 0; k < Dim; ++k)
      for (int d = 0; d < Dim; ++d) one[k][d] = Scalar(k == d ? 1.0 : 0.0);
    map.to_physical(static_cast<Local>(g), one, ds);
    Eigen::Matrix<double, Dim, Dim> inverse;
    for (int k = 0; k < Dim; ++k)
      for (int d = 0; d < Dim; ++d) inverse(k, d) = ds[k][d][0];
    points[g].weight = 1.0 / std::abs(inverse.determinant());
    volume += points[g].weight;
  }
  for (auto& point : points) point.weight /= volume;
  return points;
}

/// The points of a local cell. The patch has Q4 or H8 cells; nodes are in tensor order.
template <int Dim>
CornerPoints<Dim> corner_points_of(const Patch<Dim>& patch, Local cell) {
  if (patch.cartesian) return corner_points<Dim>(CartesianCells<Dim>(patch)[cell]);
  return corner_points<Dim>(IsoparametricCells<Dim>(patch)[cell]);
}

/// Call use(points, nodes) with the points of a bin's cell: of Q4 and H8 those above, of simplices,
/// whose gradients are the same everywhere, the centroid.
template <int Dim, class Basis, class Use>
void with_quadrature(const Patch<Dim>& patch, const Basis& basis, const ParticleBin& bin,
                     const Local* nodes, Use use) {
  if (!patch.topology.corner_nodes.empty())
    return use(corner_points_of(patch, bin.cell),
               patch.topology.corner_nodes[static_cast<std::size_t>(bin.cell)].data());
  std::array points{functions_at<Dim>(basis, bin.begin)};
  for (double& N : points[0].N) N = 1.0 / Basis::nodes;
  use(points, nodes);
}

}  // namespace lahar
