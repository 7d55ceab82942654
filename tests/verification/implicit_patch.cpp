// Patch tests of implicit steps: nodes at the border of a body are moved by a linear field, those
// inside find their equilibrium. Where the particles' volumes integrate the gradients of the
// functions exactly, that is the linear field (Irons 1966), and the stress of a neo-Hookean body is
//   sigma = (lambda ln J 1 + G (F F^T - 1)) / J
// everywhere, to rounding, in one step of any size.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <string>

#include "physics/mesh/element_map.h"
#include "tests/verification/case.h"
#include "tests/verification/distorted_mesh.h"

using namespace lahar;
using namespace lahar::verification;

namespace {

constexpr double E = 1e6, nu = 0.3;

constexpr const char* rest_of_scenario = R"(
    "materials": [{"type": "NeoHookean", "density": 1500, "youngs_modulus": 1e6,
                   "poisson_ratio": 0.3}],
    "analysis": {"mpm_scheme": "newmark", "dt": 1, "nsteps": 1, "patch_particles": 300,
                 "scheme_settings": {"quasi_static": true, "max_iteration": 30,
                                     "displacement_tolerance": 0, "residual_tolerance": 1e-8,
                                     "relative_residual_tolerance": 0}}})";

/// Weight of a Gauss point of n per direction; of simplices all have the same.
template <int Dim>
double weight(Element element, const Vec<Dim>& xi, int n) {
  double product = 1;
  for (int d = 0; d < Dim && !info(element).simplex && n == 3; ++d)
    product *= std::abs(xi[d]) < 0.1 ? 8.0 / 9 : 5.0 / 9;
  return product;
}

/// A body of Gauss points that fills the mesh. Their volumes are weight times det J.
template <int Dim>
Model<Dim> distorted_body(Element element, bool b_bar) {
  const DistortedMesh<Dim> files(element, Eigen::Matrix<double, Dim, Dim>::Zero(), true);
  const int n = info(element).order == 1 || info(element).simplex ? 2 : 3;
  const std::string text = fmt::format(
      R"({{"mesh": {{"mesh": "mesh.txt", "cell_type": "{}", "isoparametric": true}},
    "particles": [{{"generator": {{"type": "gauss", "nparticles_per_dir": {}, "material": 0}}}}],{})",
      info(element).name, n, rest_of_scenario);
  Scenario scenario = read_scenario_text(text, files.folder(), test::plain_defaults(text));
  Model<Dim> model = std::get<Model<Dim>>(std::move(scenario.model));
  model.analysis.mean_volume = b_bar;
  double before = 0;
  Index cell = -1;
  std::vector<double>& volume = model.particles.volume;
  for (std::size_t p = 0; p < model.particles.x.size(); ++p) {
    if (model.particles.cell[p] != cell) before = 0;
    cell = model.particles.cell[p];
    const auto geometry = model.mesh->element_geometry(cell);
    Vec<Dim> xi = Vec<Dim>::Zero();
    REQUIRE(inverse_map<Dim>(geometry, model.particles.x[p], xi) == Mapped::yes);
    volume[p] = weight<Dim>(element, xi, n) * geometry.jacobian(xi).determinant();
    if (info(element).simplex) volume[p] /= Dim == 2 ? 6 : 24;
    before += volume[p];
  }
  REQUIRE(before == doctest::Approx(model.mesh->element_geometry(cell).volume()).epsilon(1e-10));
  return model;
}

/// A square or cube of 1 m in the middle of a larger mesh, which functions of any width do not
/// leave.
template <int Dim>
Model<Dim> straight_body(const std::string& functions) {
  const std::string least = Dim == 2 ? "[0.5, 0.5]" : "[0.5, 0.5, 0.5]";
  const std::string most = Dim == 2 ? "[1.5, 1.5]" : "[1.5, 1.5, 1.5]";
  const std::string text = fmt::format(
      R"({{"mesh": {{"structured": {{"cell_size": 0.125, "extent": {}}}}},
    "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": 0,
                                 "region": {{"box": {{"min": {}, "max": {}}}}}}}}}],{})",
      Dim == 2 ? "[2, 2]" : "[2, 2, 2]", least, most, rest_of_scenario);
  ScenarioOptions options;
  options.overrides = {"analysis.shape_functions=" + functions};
  Scenario scenario = read_scenario_text(text, "", test::plain_defaults(text, options));
  return std::get<Model<Dim>>(std::move(scenario.model));
}

/// Prescribes H (x - o) where nodes are not `inside`; returns how many are.
template <int Dim>
Index move_border(Model<Dim>& model, const Eigen::Matrix<double, Dim, Dim>& H, const Vec<Dim>& o,
                  double least, double most) {
  Index free = 0;
  for (Index n = 0; n < model.mesh->n_nodes(); ++n) {
    const Vec<Dim> x = model.mesh->node(n);
    if ((x.array() > least + 1e-9).all() && (x.array() < most - 1e-9).all()) {
      ++free;
      continue;
    }
    const Vec<Dim> u = H * (x - o);
    for (int d = 0; d < Dim; ++d) entries_of<NodeDisplacement>(model).push_back({n, d, u[d]});
  }
  return free;
}

struct Errors {
  double stress = 0;  ///< over Young's modulus
  double x = 0;       ///< [m]
};

template <int Dim>
Errors errors_of(Model<Dim> model, const Eigen::Matrix<double, Dim, Dim>& H, const Vec<Dim>& o) {
  Simulation simulation(std::move(model));
  const State start(simulation.frame());
  simulation.run();
  const State end(simulation.frame());
  Eigen::Matrix3d F = Eigen::Matrix3d::Identity();
  F.template topLeftCorner<Dim, Dim>() += H;
  const double lambda = E * nu / ((1 + nu) * (1 - 2 * nu)), G = E / (2 * (1 + nu));
  const double J = F.determinant();
  const Eigen::Matrix3d one = Eigen::Matrix3d::Identity();
  const Eigen::Matrix3d s = (lambda * std::log(J) * one + G * (F * F.transpose() - one)) / J;
  const double exact[6] = {s(0, 0), s(1, 1), s(2, 2), s(0, 1), s(1, 2), s(0, 2)};
  Errors worst;
  for (Index p = 0; p < end.size(); ++p) {
    Vec<Dim> x0, x;
    for (int d = 0; d < Dim; ++d) {
      x0[d] = start.x(p, d) - o[d];
      x[d] = end.x(p, d) - o[d];
    }
    worst.x = std::max(worst.x, (x - x0 - H * x0).norm());
    for (int k = 0; k < 6; ++k)
      worst.stress = std::max(worst.stress, std::abs(end.get("stress", p, k) - exact[k]) / E);
  }
  return worst;
}

template <int Dim>
void check(Model<Dim> model, const Eigen::Matrix<double, Dim, Dim>& H, bool whole_mesh,
           double reach) {
  const Vec<Dim> o = Vec<Dim>::Constant(whole_mesh ? 0.5 : 1.0);
  const double least = whole_mesh ? 0.0 : 0.5 + reach, most = whole_mesh ? 1.0 : 1.5 - reach;
  const Index free = move_border<Dim>(model, H, o, least, most);
  REQUIRE(free > 0);
  const Errors errors = errors_of<Dim>(std::move(model), H, o);
  MESSAGE(free << " free nodes, stress " << errors.stress << ", x " << errors.x);
  CHECK(errors.stress < 1e-10);
  CHECK(errors.x < 1e-10);
}

/// Nothing leaves the square or cube.
template <int Dim>
Eigen::Matrix<double, Dim, Dim> strain() {
  Eigen::Matrix3d H;
  H << -0.08, 0.04, 0.01, -0.02, -0.06, 0.03, 0.02, -0.04, -0.09;
  return H.topLeftCorner<Dim, Dim>();
}

/// By 30 degrees, in 3D about (1, 1, 1).
template <int Dim>
Eigen::Matrix<double, Dim, Dim> turn() {
  const double angle = std::numbers::pi / 6;
  if constexpr (Dim == 2)
    return Eigen::Rotation2D<double>(angle).toRotationMatrix() - Eigen::Matrix2d::Identity();
  else
    return Eigen::AngleAxis<double>(angle, Eigen::Vector3d::Ones().normalized())
               .toRotationMatrix() -
           Eigen::Matrix3d::Identity();
}

}  // namespace

TEST_CASE("implicit patch test: uniform stress on distorted meshes of every element") {
  using enum Element;
  for (const Element element : {Q4, T3, T6, Q9}) {
    CAPTURE(info(element).name);
    check<2>(distorted_body<2>(element, false), strain<2>(), true, 0);
  }
  for (const Element element : {H8, Tet4, H27}) {
    CAPTURE(info(element).name);
    check<3>(distorted_body<3>(element, false), strain<3>(), true, 0);
  }
}

TEST_CASE("implicit patch test: the mean of volumetric strains leaves a uniform stress as it is") {
  check<2>(distorted_body<2>(Element::Q4, true), strain<2>(), true, 0);
  check<3>(distorted_body<3>(Element::H8, true), strain<3>(), true, 0);
}

TEST_CASE("implicit patch test: functions that reach beyond the cell") {
  // Nodes to whose functions the border of the body comes near are moved, too.
  for (const auto& [functions, reach] : {std::pair("element", 0.0),
                                         {"gimp", 0.125},
                                         {"quadratic_spline", 0.125},
                                         {"cubic_spline", 0.25}}) {
    CAPTURE(std::string(functions));
    check<2>(straight_body<2>(functions), strain<2>(), false, reach);
    check<3>(straight_body<3>(functions), strain<3>(), false, reach);
  }
}

TEST_CASE("implicit steps: a body whose border is turned by 30 degrees turns without stress") {
  for (const char* const functions : {"element", "gimp", "quadratic_spline"}) {
    CAPTURE(std::string(functions));
    for (const bool b_bar : {false, true}) {
      if (b_bar && std::string(functions) != "element") continue;
      Model<2> square = straight_body<2>(functions);
      Model<3> cube = straight_body<3>(functions);
      square.analysis.mean_volume = cube.analysis.mean_volume = b_bar;
      check<2>(std::move(square), turn<2>(), false, 0.125);
      check<3>(std::move(cube), turn<3>(), false, 0.125);
    }
  }
}
