/// \file A quarter of the plane between two circles, of cells that follow them.
#pragma once

#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <utility>
#include <vector>

#include "tests/verification/case.h"

namespace lahar::verification {

struct CurvedQuarter {
  double inner = 1, outer = 2;  ///< [m] radii
  Index n_r = 16, n_theta = 24;

  /// Along the radius first; those of the last row are at x = 0.
  Index node(Index i, Index j) const { return i + j * (n_r + 1); }

  /// Cells counter-clockwise.
  std::shared_ptr<const Mesh<2>> mesh() const {
    std::vector<Vec<2>> nodes;
    for (Index j = 0; j <= n_theta; ++j)
      for (Index i = 0; i <= n_r; ++i) {
        const double r = inner + (outer - inner) * static_cast<double>(i) / n_r,
                     theta = 0.5 * std::numbers::pi * static_cast<double>(j) / n_theta;
        nodes.push_back(j == n_theta ? Vec<2>(0, r)
                                     : Vec<2>(r * std::cos(theta), r * std::sin(theta)));
      }
    std::vector<Mesh<2>::Corners> cells;
    for (Index j = 0; j < n_theta; ++j)
      for (Index i = 0; i < n_r; ++i)
        cells.push_back({node(i, j), node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)});
    return std::make_shared<const Mesh<2>>(
        Mesh<2>::from_tables(std::move(nodes), std::move(cells), true));
  }

  /// Both straight sides are planes of symmetry.
  void hold_sides(Model<2>& model) const {
    for (Index i = 0; i <= n_r; ++i) {
      entries_of<NodeVelocity>(model).push_back({node(i, 0), 1, 0});
      entries_of<NodeVelocity>(model).push_back({node(i, n_theta), 0, 0});
    }
  }
};

/// Four particles at the Gauss points of each cell, with the volumes of these: of a plane model, or
/// of rings around x = 0.
inline void fill_with_gauss_points(Model<2>& model) {
  const double g = 1 / std::sqrt(3.0);
  constexpr std::array<std::array<double, 2>, 4> sign{{{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}};
  for (Index c = 0; c < model.mesh->n_cells(); ++c) {
    const auto corner = model.mesh->cell_nodes(c);
    for (const Vec<2>& xi : {Vec<2>(-g, -g), Vec<2>(g, -g), Vec<2>(g, g), Vec<2>(-g, g)}) {
      Vec<2> x = Vec<2>::Zero();
      Eigen::Matrix2d J = Eigen::Matrix2d::Zero();
      for (std::size_t k = 0; k < 4; ++k) {
        const Vec<2> at = model.mesh->node(corner[k]);
        const double w0 = 1 + sign[k][0] * xi[0], w1 = 1 + sign[k][1] * xi[1];
        x += 0.25 * w0 * w1 * at;
        J.col(0) += 0.25 * sign[k][0] * w1 * at;
        J.col(1) += 0.25 * sign[k][1] * w0 * at;
      }
      model.particles.x.push_back(x);
      model.particles.cell.push_back(c);
      model.particles.volume.push_back(depth_at(model.analysis, x[0]) *
                                       (J(0, 0) * J(1, 1) - J(0, 1) * J(1, 0)));
      model.particles.material.push_back(0);
    }
  }
}

}  // namespace lahar::verification
