/// \file Bodies of quadrilaterals with a particle at each Gauss point: Cook's membrane (1974), of
/// rubber whose volume hardly changes.
#pragma once

#include <Eigen/LU>
#include <array>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "physics/mesh/element_map.h"
#include "tests/verification/case.h"

namespace lahar::verification {

/// A patch of n x m quadrilaterals, node (i, j) at `place`, with a particle at each Gauss point.
inline Model<2> body_of_cells(Index n, Index m, auto place) {
  Model<2> model;
  std::vector<Vec<2>> nodes;
  for (Index j = 0; j <= m; ++j)
    for (Index i = 0; i <= n; ++i)
      nodes.push_back(place(static_cast<double>(i) / static_cast<double>(n),
                            static_cast<double>(j) / static_cast<double>(m)));
  std::vector<Mesh<2>::Corners> cells;
  for (Index j = 0; j < m; ++j)
    for (Index i = 0; i < n; ++i) {
      const Index first = i + j * (n + 1);
      cells.push_back({first, first + 1, first + n + 2, first + n + 1});
    }
  model.mesh = std::make_shared<const Mesh<2>>(
      Mesh<2>::from_tables(std::move(nodes), std::move(cells), true));
  for (Index c = 0; c < model.mesh->n_cells(); ++c)
    for (const Vec<2>& xi : gauss_points<2>(Element::Q4, 2)) {
      const auto geometry = model.mesh->element_geometry(c);
      model.particles.x.push_back(geometry.point(xi));
      model.particles.cell.push_back(c);
      model.particles.volume.push_back(geometry.jacobian(xi).determinant());
      model.particles.material.push_back(0);
    }
  return model;
}

/// So small that strains are.
inline constexpr double cook_load = 1e-4;
/// Limit of quadrilaterals of nine nodes, 0.2633, 0.2709 and 0.2747 for n = 8, 16 and 32, by a
/// program of its own; the corner at which the stress is infinite makes it slow.
inline constexpr double cook_limit = 0.278;

/// Corners (0, 0), (48, 44), (48, 60), (0, 44), held at its left side and sheared by a force of 1
/// in all at its right one, E = 70, nu = 0.499; n x n cells.
inline Model<2> cook_membrane(Index n) {
  Model<2> model = body_of_cells(
      n, n, [](double s, double t) { return Vec<2>(48 * s, 44 * s + t * (44 - 28 * s)); });
  model.materials = {{.id = 0,
                      .name = "rubber",
                      .density = 1000,
                      .law = LinearElastic{.youngs_modulus = 70, .poisson_ratio = 0.499}}};
  for (Index j = 0; j <= n; ++j) {
    for (int d = 0; d < 2; ++d) entries_of<NodeVelocity>(model).push_back({j * (n + 1), d, 0});
    const double share = (j == 0 || j == n ? 0.5 : 1.0) / static_cast<double>(n);
    entries_of<NodeForce>(model).push_back(
        {.node = j * (n + 1) + n, .dir = 1, .force = cook_load * share});
  }
  return model;
}

/// How far the upper right corner is up, over the load. The displacement is nearly linear in the
/// last cell: from its Gauss points to the corner.
inline double cook_corner(const Simulation& simulation) {
  const State state(simulation.frame());
  const Index last = state.size() - 4;
  const double g = std::sqrt(3.0);
  double up = 0;
  for (Index p = 0; p < 4; ++p) {
    constexpr std::array<std::array<int, 2>, 4> sign{{{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}};
    const auto& at = sign[static_cast<std::size_t>(p)];
    up += 0.25 * (1 + g * at[0]) * (1 + g * at[1]) * state.get("displacement", last + p, 1);
  }
  return up / cook_load;
}

}  // namespace lahar::verification
