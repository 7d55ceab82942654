// Patch test: nodes of a distorted mesh move with a linear velocity field, v = L (x - o).
// Isoparametric functions reproduce linear fields on any mesh (Irons 1966), so that whatever the
// cells' shapes
//   strain = n dt sym(L) (engineering shear), stress = D strain at every particle,
//   x_n = o + (I + dt L)^n (x_0 - o),
// to rounding, also after particles have crossed cells. Bernstein polynomials do the same with the
// values at control points, which are the nodes where edges are straight.
#include <doctest/doctest.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "physics/mesh/element_grid.h"
#include "tests/verification/case.h"

using namespace lahar;
using namespace lahar::verification;

namespace {

constexpr double E = 1e6, nu = 0.3;
constexpr int cells = 4;  // per direction of the unit square or cube
constexpr Index steps = 200;
constexpr double dt = 2e-4;

/// How far nodes inside leave the grid [distances of nodes].
double most_shift(Element element) {
  switch (element) {
    case Element::Q4:
      return 0.25;
    case Element::H8:
      return 0.14;
    default:
      return info(element).order == 1 ? 0.12 : 0.08;
  }
}

/// Files of a distorted mesh and of its nodes' velocities, removed at the end.
template <int Dim>
class DistortedMesh {
 public:
  DistortedMesh(Element element, const Eigen::Matrix<double, Dim, Dim>& L, bool straight) {
    folder_ = std::filesystem::temp_directory_path() /
              fmt::format("lahar_patch_{}_{}", info(element).name, getpid());
    std::filesystem::create_directories(folder_);
    std::ofstream mesh(folder_ / "mesh.txt"), velocity(folder_ / "velocity.txt");
    mesh.precision(17);
    velocity.precision(17);
    std::array<Index, Dim> counts;
    counts.fill(cells);
    const auto grid = element_grid<Dim>(element, Vec<Dim>::Zero(), Vec<Dim>::Ones(), counts);
    const std::size_t per_cell = static_cast<std::size_t>(info(element).nodes);
    std::vector<Vec<Dim>> nodes;
    mesh << grid.nodes.size() << " " << grid.cells.size() / per_cell << "\n";
    for (std::size_t n = 0; n < grid.nodes.size(); ++n) {
      const Vec<Dim>& at = grid.nodes[n];
      Vec<Dim> x;
      for (int d = 0; d < Dim; ++d) {
        // Those of the sides stay there.
        const bool side = at[d] == 0 || at[d] == cells;
        const double shift =
            std::sin(3.7 * at[0] + 5.1 * at[1] * (d + 1) + 2.3 * (Dim == 3 ? at[Dim - 1] : 0) + d);
        x[d] = (at[d] + (side ? 0 : most_shift(element) / info(element).order * shift)) / cells;
      }
      nodes.push_back(x);
    }
    for (std::size_t first = 0; straight && first < grid.cells.size(); first += per_cell)
      straighten(element, &grid.cells[first], nodes);
    for (std::size_t n = 0; n < nodes.size(); ++n) {
      const Vec<Dim>& x = nodes[n];
      const Vec<Dim> v = L * (x - Vec<Dim>::Constant(0.5));
      for (int d = 0; d < Dim; ++d) {
        mesh << x[d] << (d + 1 < Dim ? " " : "\n");
        velocity << n << " " << d << " " << v[d] << "\n";
      }
    }
    for (std::size_t k = 0; k < grid.cells.size(); ++k)
      mesh << grid.cells[k] << ((k + 1) % per_cell == 0 ? "\n" : " ");
  }
  ~DistortedMesh() { std::filesystem::remove_all(folder_); }
  const std::filesystem::path& folder() const { return folder_; }

 private:
  /// Nodes between corners move to the middles of these.
  static void straighten(Element element, const Index* cell, std::vector<Vec<Dim>>& nodes) {
    const ElementInfo& about = info(element);
    for (int a = about.corners; a < about.nodes; ++a) {
      Vec<Dim> sum = Vec<Dim>::Zero();
      int count = 0;
      const auto xi = node_xi<Dim>(element, a);
      for (int c = 0; c < about.corners; ++c) {
        const Vec<Dim> corner = node_xi<Dim>(element, c);
        bool beside = about.simplex ? c == a - 3 || c == (a - 2) % 3 : true;
        for (int d = 0; d < Dim && !about.simplex; ++d)
          beside = beside && (xi[d] == 0 || xi[d] == corner[d]);
        if (!beside) continue;
        sum += nodes[static_cast<std::size_t>(cell[c])];
        ++count;
      }
      nodes[static_cast<std::size_t>(cell[a])] = sum / count;
    }
  }

  std::filesystem::path folder_;
};

template <int Dim>
Model<Dim> patch_model(Element element, const DistortedMesh<Dim>& files, Scheme scheme,
                       bool lagrange) {
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
  return model;
}

template <int Dim>
void check_patch(Element element, const Eigen::Matrix<double, Dim, Dim>& L, Scheme scheme,
                 bool lagrange = true) {
  const DistortedMesh<Dim> files(element, L, !lagrange);
  Simulation simulation(patch_model<Dim>(element, files, scheme, lagrange));
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

}  // namespace

TEST_CASE(
    "patch test: a linear velocity field gives uniform strain and stress on distorted meshes of "
    "every element in 2D") {
  Eigen::Matrix2d L;
  L << 0.5, 0.75, -0.25, -0.3;
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
  Eigen::Matrix3d L;
  L << 0.5, 0.75, 0.1, -0.25, -0.3, 0.4, 0.2, -0.6, 0.35;
  using enum Element;
  for (const Element element : {H8, Tet4, H20, H27})
    for (const Scheme scheme : {Scheme::usf, Scheme::usl, Scheme::musl}) {
      CAPTURE(info(element).name);
      CAPTURE(static_cast<int>(scheme));
      check_patch<3>(element, L, scheme);
    }
}

TEST_CASE("patch test: positive functions of second order on distorted cells of straight edges") {
  Eigen::Matrix2d L;
  L << 0.5, 0.75, -0.25, -0.3;
  Eigen::Matrix3d M;
  M << 0.5, 0.75, 0.1, -0.25, -0.3, 0.4, 0.2, -0.6, 0.35;
  for (const Scheme scheme : {Scheme::usf, Scheme::usl, Scheme::musl}) {
    CAPTURE(static_cast<int>(scheme));
    check_patch<2>(Element::T6, L, scheme, false);
    check_patch<2>(Element::Q9, L, scheme, false);
    check_patch<3>(Element::H27, M, scheme, false);
  }
}
