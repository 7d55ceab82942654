/// \file Gauss's points of cells with linear functions, for integrals over a cell as if its
/// material filled all of it evenly.
#pragma once

#include <Eigen/LU>
#include <array>
#include <cmath>
#include <vector>

#include "physics/basis/any_basis.h"

namespace lahar {

template <int Dim, int Nodes>
struct QuadraturePoint {
  double weight;  ///< share of the cell's volume
  double N[Nodes];
  double dN[Dim][Nodes];  ///< [1/m]
};

/// Two points per axis, which are exact for products of two gradients in boxes.
template <int Dim>
class CornerQuadrature {
 public:
  static constexpr int n = 1 << Dim;
  using Points = std::array<QuadraturePoint<Dim, corners<Dim>>, n>;

  /// Of a local cell, nodes in tensor order.
  static Points of(const Patch<Dim>& patch, std::size_t cell) {
    Points points;
    double volume = 0;
    for (int g = 0; g < n; ++g) {
      auto& point = points[static_cast<std::size_t>(g)];
      Eigen::Matrix<double, Dim, corners<Dim>> natural;
      for (int i = 0; i < corners<Dim>; ++i) point.N[i] = functions(g, i, natural);
      Eigen::Matrix<double, Dim, Dim> J;  // J(k, d) = dx_d / ds_k
      if (patch.cartesian) {
        J.setZero();
        for (int d = 0; d < Dim; ++d)
          J(d, d) = 1.0 / patch.box[cell][static_cast<std::size_t>(Dim + d)];
      } else {
        Eigen::Matrix<double, corners<Dim>, Dim> X;
        const auto& corner = patch.topology.corner_nodes[cell];
        for (int i = 0; i < corners<Dim>; ++i)
          for (int d = 0; d < Dim; ++d)
            X(i, d) =
                patch.node_position[static_cast<std::size_t>(corner[static_cast<std::size_t>(i)]) *
                                        node_width +
                                    static_cast<std::size_t>(d)];
        J = natural * X;
      }
      const Eigen::Matrix<double, Dim, corners<Dim>> dN = J.inverse() * natural;
      for (int d = 0; d < Dim; ++d)
        for (int i = 0; i < corners<Dim>; ++i) point.dN[d][i] = dN(d, i);
      point.weight = std::abs(J.determinant());
      volume += point.weight;
    }
    for (auto& point : points) point.weight /= volume;
    return points;
  }

 private:
  static double functions(int g, int i, Eigen::Matrix<double, Dim, corners<Dim>>& natural) {
    static const double place = 1.0 / std::sqrt(3.0);
    double half[Dim], sign[Dim], N = 1.0;
    for (int d = 0; d < Dim; ++d) {
      sign[d] = (i >> d & 1) ? 1.0 : -1.0;
      half[d] = 0.5 * (1.0 + sign[d] * ((g >> d & 1) ? place : -place));
      N *= half[d];
    }
    for (int d = 0; d < Dim; ++d) {
      natural(d, i) = 0.5 * sign[d];
      for (int e = 0; e < Dim; ++e)
        if (e != d) natural(d, i) *= half[e];
    }
    return N;
  }
};

/// Call add(point, nodes) for the points of a bin's cell: of Q4 and H8 those above, of simplices
/// the centroid.
template <int Dim, class Basis, class Add>
void for_each_quadrature_point(const Patch<Dim>& patch, const Basis& basis, const ParticleBin& bin,
                               const Local* nodes, Add add) {
  const auto cell = static_cast<std::size_t>(bin.cell);
  if (!patch.topology.corner_nodes.empty()) {
    for (const auto& point : CornerQuadrature<Dim>::of(patch, cell))
      add(point, patch.topology.corner_nodes[cell].data());
    return;
  }
  constexpr int n = Basis::nodes;
  QuadraturePoint<Dim, n> point;
  point.weight = 1.0;
  Scalar dN[Dim][n];
  basis.gradients(bin.begin, dN);
  for (int i = 0; i < n; ++i) {
    point.N[i] = 1.0 / n;
    for (int d = 0; d < Dim; ++d) point.dN[d][i] = dN[d][i][0];
  }
  add(point, nodes);
}

}  // namespace lahar
