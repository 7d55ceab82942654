// Patch test: nodes of a distorted mesh move with a linear velocity field, v = L (x - o).
// Isoparametric functions reproduce linear fields on any mesh (Irons 1966), so that whatever the
// cells' shapes
//   strain = n dt sym(L) (engineering shear), stress = D strain at every particle,
//   x_n = o + (I + dt L)^n (x_0 - o),
// to rounding, also after particles have crossed cells. Bernstein polynomials do the same with the
// values at control points, which are the nodes where edges are straight.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>

#include "tests/verification/case.h"
#include "tests/verification/distorted_mesh.h"

using namespace lahar;
using namespace lahar::verification;

namespace {

constexpr double E = 1e6, nu = 0.3;
constexpr Index steps = 200;
constexpr double dt = 2e-4;

template <int Dim>
Model<Dim> patch_model(Element element, const DistortedMesh<Dim>& files, Scheme scheme,
                       bool lagrange, bool b_bar) {
  ScenarioOptions options;
  options.overrides = {fmt::format("mesh.cell_type={}", info(element).name),
                       Dim == 3 ? "sets.cells.inner.sphere.centre=[0.5,0.5,0.5]"
                                : "sets.cells.inner.sphere.centre=[0.5,0.5]"};
  Scenario scenario = read_scenario_text(R"({
    "mesh": {"mesh": "mesh.txt", "cell_type": "", "isoparametric": true, "boundary_conditions": {
      "velocity_constraints": [{"file": "velocity.txt"}]}},
    "sets": {"cells": {"inner": {"sphere": {"centre": [], "radius": 0.4}}}},
    "materials": [{"type": "LinearElastic", "density": 1500, "youngs_modulus": 1e6,
                   "poisson_ratio": 0.3}],
    "particles": [{"generator": {"type": "gauss", "cset": "inner", "nparticles_per_dir": 2,
                                 "material": 0}}],
    "analysis": {"preset": "cbgeo", "dt": 2e-4, "nsteps": 200, "patch_particles": 16}})",
                                         files.folder(), options);
  Model<Dim> model = std::get<Model<Dim>>(std::move(scenario.model));
  model.analysis.scheme = scheme;
  model.analysis.lagrange_functions = lagrange;
  model.analysis.mean_volume = b_bar;
  return model;
}

template <int Dim>
void check_patch(Element element, const Eigen::Matrix<double, Dim, Dim>& L, Scheme scheme,
                 bool lagrange = true, bool b_bar = false) {
  const DistortedMesh<Dim> files(element, L, !lagrange);
  Simulation simulation(patch_model<Dim>(element, files, scheme, lagrange, b_bar));
  const State start(simulation.frame());
  REQUIRE(start.size() > 0);
  simulation.run();
  const State end(simulation.frame());

  const Eigen::Matrix<double, Dim, Dim> D = dt * steps * (L + L.transpose());  // twice the strain
  double strain[6] = {D(0, 0) / 2, D(1, 1) / 2, 0, D(0, 1), 0, 0};
  if constexpr (Dim == 3) {
    strain[2] = D(2, 2) / 2;
    strain[4] = D(1, 2);
    strain[5] = D(0, 2);
  }
  const double lambda = E * nu / ((1 + nu) * (1 - 2 * nu)), G = E / (2 * (1 + nu));
  const double volumetric = strain[0] + strain[1] + strain[2];
  Eigen::Matrix<double, Dim, Dim> motion = Eigen::Matrix<double, Dim, Dim>::Identity();
  for (Index n = 0; n < steps; ++n) motion = motion + dt * L * motion;

  double worst_strain = 0, worst_stress = 0, worst_x = 0;
  for (Index p = 0; p < end.size(); ++p) {
    Vec<Dim> x0, x;
    for (int d = 0; d < Dim; ++d) {
      x0[d] = start.x(p, d) - 0.5;
      x[d] = end.x(p, d) - 0.5;
    }
    worst_x = std::max(worst_x, (x - motion * x0).norm());
    for (int k = 0; k < 6; ++k) {
      const double stress = k < 3 ? lambda * volumetric + 2 * G * strain[k] : G * strain[k];
      worst_strain = std::max(worst_strain, std::abs(end.get("strain", p, k) - strain[k]));
      worst_stress = std::max(worst_stress, std::abs(end.get("stress", p, k) - stress));
    }
  }
  // Relative to the largest strain, 0.03, and stress, about E times that. 200 steps of rounding.
  const double rounding = element == multilinear<Dim> ? 1e-12 : 1e-11;
  CHECK(worst_strain < rounding * 0.03);
  CHECK(worst_stress < rounding * 0.03 * E);
  CHECK(worst_x < rounding);
}

Eigen::Matrix2d gradient_2d() {
  Eigen::Matrix2d L;
  L << 0.5, 0.75, -0.25, -0.3;
  return L;
}

Eigen::Matrix3d gradient_3d() {
  Eigen::Matrix3d L;
  L << 0.5, 0.75, 0.1, -0.25, -0.3, 0.4, 0.2, -0.6, 0.35;
  return L;
}

}  // namespace

TEST_CASE(
    "patch test: a linear velocity field gives uniform strain and stress on distorted meshes of "
    "every element in 2D") {
  const Eigen::Matrix2d L = gradient_2d();
  using enum Element;
  for (const Element element : {Q4, T3, T6, Q8, Q9})
    for (const Scheme scheme : {Scheme::usf, Scheme::usl, Scheme::musl}) {
      CAPTURE(info(element).name);
      CAPTURE(static_cast<int>(scheme));
      check_patch<2>(element, L, scheme);
    }
}

TEST_CASE(
    "patch test: a linear velocity field gives uniform strain and stress on distorted meshes of "
    "every element in 3D") {
  const Eigen::Matrix3d L = gradient_3d();
  using enum Element;
  for (const Element element : {H8, Tet4, H20, H27})
    for (const Scheme scheme : {Scheme::usf, Scheme::usl, Scheme::musl}) {
      CAPTURE(info(element).name);
      CAPTURE(static_cast<int>(scheme));
      check_patch<3>(element, L, scheme);
    }
}

TEST_CASE("patch test: the mean of volumetric strains keeps uniform strains on distorted meshes") {
  const Eigen::Matrix2d L = gradient_2d();
  const Eigen::Matrix3d M = gradient_3d();
  for (const Scheme scheme : {Scheme::usf, Scheme::usl, Scheme::musl}) {
    CAPTURE(static_cast<int>(scheme));
    for (const Element element : {Element::Q4, Element::Q8, Element::Q9})
      check_patch<2>(element, L, scheme, true, true);
    for (const Element element : {Element::H8, Element::H27})
      check_patch<3>(element, M, scheme, true, true);
  }
}

TEST_CASE("patch test: positive functions of second order on distorted cells of straight edges") {
  const Eigen::Matrix2d L = gradient_2d();
  const Eigen::Matrix3d M = gradient_3d();
  for (const Scheme scheme : {Scheme::usf, Scheme::usl, Scheme::musl}) {
    CAPTURE(static_cast<int>(scheme));
    check_patch<2>(Element::T6, L, scheme, false);
    check_patch<2>(Element::Q9, L, scheme, false);
    check_patch<3>(Element::H27, M, scheme, false);
  }
}
