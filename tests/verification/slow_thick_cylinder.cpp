// A thick-walled cylinder under internal pressure, on cells that follow its shape: Lame's stresses
//   sigma_r,theta = p a^2 / (b^2 - a^2) (1 -+ b^2 / r^2).
#include <doctest/doctest.h>

#include <cmath>

#include "tests/verification/curved_quarter.h"

using namespace lahar;
using namespace lahar::verification;

namespace {

constexpr double a = 1, b = 2;   // m
constexpr double pressure = 10;  // Pa; E = 1 MPa, so that nothing moves far
const CurvedQuarter quarter{.inner = a, .outer = b};

/// Consistent nodal forces of the pressure on the inner edges, and symmetry on both straight sides.
void load(Model<2>& model) {
  for (Index j = 0; j < quarter.n_theta; ++j) {
    const Vec<2> edge =
        model.mesh->node(quarter.node(0, j + 1)) - model.mesh->node(quarter.node(0, j));
    const Vec<2> half = 0.5 * pressure * Vec<2>(edge[1], -edge[0]);  // outwards from the axis
    for (const Index k : {j, j + 1})
      for (int d = 0; d < 2; ++d)
        entries_of<NodeForce>(model).push_back(
            {.node = quarter.node(0, k), .dir = d, .force = half[d]});
  }
  quarter.hold_sides(model);
}

}  // namespace

TEST_CASE("a thick-walled cylinder under internal pressure has Lame's stresses") {
  for (const Scheme scheme : {Scheme::usf, Scheme::usl, Scheme::musl}) {
    CAPTURE(static_cast<int>(scheme));
    Model<2> model;
    model.mesh = quarter.mesh();
    model.materials = {{.id = 0,
                        .name = "steel",
                        .density = 1000,
                        .law = LinearElastic{.youngs_modulus = 1e6, .poisson_ratio = 0.3}}};
    fill_with_gauss_points(model);
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
