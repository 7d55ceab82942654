// A thick-walled cylinder under internal pressure, on cells that follow its shape: Lame's stresses
//   sigma_r,theta = p a^2 / (b^2 - a^2) (1 -+ b^2 / r^2).
#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <numbers>

#include "tests/verification/case.h"

using namespace lahar;
using namespace lahar::verification;

namespace {

constexpr double a = 1, b = 2;   // m
constexpr double pressure = 10;  // Pa; E = 1 MPa, so that nothing moves far
constexpr Index n_r = 16, n_theta = 24;

Vec<2> polar(double r, double theta) {
  return {r * std::cos(theta), r * std::sin(theta)};
}
Index node(Index i, Index j) {
  return i + j * (n_r + 1);
}

/// A quarter of the ring: nodes along the radius first, cells counter-clockwise.
std::shared_ptr<const Mesh<2>> ring() {
  std::vector<Vec<2>> nodes;
  for (Index j = 0; j <= n_theta; ++j)
    for (Index i = 0; i <= n_r; ++i)
      nodes.push_back(polar(a + (b - a) * static_cast<double>(i) / n_r,
                            0.5 * std::numbers::pi * static_cast<double>(j) / n_theta));
  std::vector<Mesh<2>::Corners> cells;
  for (Index j = 0; j < n_theta; ++j)
    for (Index i = 0; i < n_r; ++i)
      cells.push_back({node(i, j), node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)});
  return std::make_shared<const Mesh<2>>(
      Mesh<2>::from_tables(std::move(nodes), std::move(cells), true));
}

/// Four particles at the Gauss points of each cell, with the volumes of these.
void fill(Model<2>& model) {
  const double g = 1 / std::sqrt(3.0);
  for (Index c = 0; c < model.mesh->n_cells(); ++c) {
    const auto corner = model.mesh->cell_nodes(c);
    for (const Vec<2>& xi : {Vec<2>(-g, -g), Vec<2>(g, -g), Vec<2>(g, g), Vec<2>(-g, g)}) {
      constexpr std::array<std::array<double, 2>, 4> sign{{{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}};
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
      model.particles.volume.push_back(J(0, 0) * J(1, 1) - J(0, 1) * J(1, 0));
      model.particles.material.push_back(0);
    }
  }
}

/// Consistent nodal forces of the pressure on the inner edges, and symmetry on both straight sides.
void load(Model<2>& model) {
  for (Index j = 0; j < n_theta; ++j) {
    const Vec<2> edge = model.mesh->node(node(0, j + 1)) - model.mesh->node(node(0, j));
    const Vec<2> half = 0.5 * pressure * Vec<2>(edge[1], -edge[0]);  // outwards from the axis
    for (const Index k : {j, j + 1})
      for (int d = 0; d < 2; ++d)
        entries_of<NodeForce>(model).push_back({.node = node(0, k), .dir = d, .force = half[d]});
  }
  for (Index i = 0; i <= n_r; ++i) {
    entries_of<NodeVelocity>(model).push_back({node(i, 0), 1, 0});
    entries_of<NodeVelocity>(model).push_back({node(i, n_theta), 0, 0});
  }
}

}  // namespace

TEST_CASE("a thick-walled cylinder under internal pressure has Lame's stresses") {
  for (const Scheme scheme : {Scheme::usf, Scheme::usl, Scheme::musl}) {
    CAPTURE(static_cast<int>(scheme));
    Model<2> model;
    model.mesh = ring();
    model.materials = {{.id = 0,
                        .name = "steel",
                        .density = 1000,
                        .law = LinearElastic{.youngs_modulus = 1e6, .poisson_ratio = 0.3}}};
    fill(model);
    load(model);
    model.analysis.scheme = scheme;
    model.analysis.damping = 0.05;
    model.analysis.transfer.flip = 0.99;
    model.analysis.step.dt = 5e-4;
    model.analysis.nsteps = 20000;
    Simulation simulation(std::move(model));
    simulation.run();
    const State state(simulation.frame());
    const double scale = pressure * a * a / (b * b - a * a);
    // Means over cells: within a cell, linear functions do not follow the stress.
    double worst_r = 0, worst_theta = 0;
    for (Index first = 0; first < state.size(); first += 4) {
      double r = 0, theta = 0, exact_r = 0, exact_theta = 0;
      for (Index p = first; p < first + 4; ++p) {
        const double x = state.x(p, 0), y = state.x(p, 1), r2 = x * x + y * y;
        const double xx = state.get("stress", p, 0), yy = state.get("stress", p, 1),
                     xy = state.get("stress", p, 3);
        const double sigma_r = (x * x * xx + y * y * yy + 2 * x * y * xy) / r2;
        r += 0.25 * sigma_r;
        theta += 0.25 * (xx + yy - sigma_r);
        exact_r += 0.25 * scale * (1 - b * b / r2);
        exact_theta += 0.25 * scale * (1 + b * b / r2);
      }
      worst_r = std::max(worst_r, std::abs(r - exact_r) / pressure);
      worst_theta = std::max(worst_theta, std::abs(theta / exact_theta - 1));
    }
    CAPTURE(worst_r);
    CAPTURE(worst_theta);
    CHECK(worst_theta < 0.01);
    CHECK(worst_r < 0.01);
  }
}
