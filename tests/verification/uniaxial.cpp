// Homogeneous states of an elastic block, approached slowly with damping: linear functions are
// exact.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include "tests/verification/case.h"

using namespace lahar;
using namespace lahar::verification;

namespace {

constexpr double E = 1000, nu = 0.3;

/// A block of 2 x 2 (x 2) cells on rollers, pushed down by `velocity` at its top until it is 0.1 %
/// shorter; sides free or on rollers.
std::string block(int dim, bool confined) {
  std::string constraints;
  for (int d = 0; d < dim; ++d) {
    constraints += fmt::format(R"({{"nset": "low{0}", "dir": {0}, "velocity": 0}},)", d);
    if (confined && d != 1)
      constraints += fmt::format(R"({{"nset": "high{0}", "dir": {0}, "velocity": 0}},)", d);
  }
  constraints += R"({"nset": "high1", "dir": 1, "velocity": -0.001})";
  auto side = [&](int d, double at, int sign) {
    std::string point = "0, 0", normal = "0, 0";
    if (dim == 3) point = normal = "0, 0, 0";
    point.replace(static_cast<std::size_t>(3 * d), 1, fmt::format("{}", at));
    normal.replace(static_cast<std::size_t>(3 * d), 1, fmt::format("{}", sign));
    return fmt::format(R"({{"half_space": {{"point": [{}], "normal": [{}]}}}})", point, normal);
  };
  std::string sets;
  for (int d = 0; d < dim; ++d)
    sets += fmt::format(R"({}"low{}": {}, "high{}": {})", d ? "," : "", d, side(d, 0, 1), d,
                        side(d, 1, -1));
  return fmt::format(R"({{
    "mesh": {{"structured": {{"cell_size": 0.5, "counts": [{}]}},
             "boundary_conditions": {{"velocity_constraints": [{}]}}}},
    "sets": {{"nodes": {{{}}}}},
    "materials": [{{"type": "LinearElastic", "density": 0.01, "youngs_modulus": 1000, "poisson_ratio": 0.3}}],
    "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": 0}}}}],
    "analysis": {{"dt": 1e-3, "nsteps": 1000}}}})",
                     dim == 3 ? "2, 2, 2" : "2, 2", constraints, sets);
}

template <int Dim>
void check_stress(bool confined, const double (&expected)[3], double tolerance) {
  Model<Dim> model = model_of_text<Dim>(block(Dim, confined));
  if (!confined) model.analysis.transfer.flip = 0;
  // The final motion from the start: no waves, also not of what nodes take from particles around.
  model.analysis.sudden_velocities = false;
  for (const Vec<Dim>& x : model.particles.x) {
    Vec<Dim> v = Vec<Dim>::Zero();
    v[1] = -0.001 * x[1];
    model.particles.velocity.push_back(v);
  }
  Simulation simulation(std::move(model));
  simulation.run();
  const State state(simulation.frame());
  double worst = 0;
  for (int k = 0; k < 6; ++k) {
    const double exact = k < 3 ? expected[k] : 0;
    auto stress = [&](Index p) { return state.get("stress", p, k); };
    CHECK(std::abs(mean(
                       state, [](Index) { return true; }, stress) -
                   exact) < tolerance / 5);
    for (Index p = 0; p < state.size(); ++p) worst = std::max(worst, std::abs(stress(p) - exact));
  }
  MESSAGE("largest error " << worst << " Pa");
  CHECK(worst < tolerance);
}

}  // namespace

TEST_CASE("uniaxial strain: eps_yy = -0.001 gives E (1 - nu) / ((1 + nu) (1 - 2 nu)) eps") {
  const double factor = E / ((1 + nu) * (1 - 2 * nu)) * -0.001;
  check_stress<2>(true, {nu * factor, (1 - nu) * factor, nu * factor}, 1e-7);
  check_stress<3>(true, {nu * factor, (1 - nu) * factor, nu * factor}, 1e-7);
}

TEST_CASE(
    "uniaxial compression with free sides: sigma_yy = E eps / (1 - nu^2) in plane strain, E eps in "
    "3D") {
  const double plane = -0.001 * E / (1 - nu * nu);
  check_stress<2>(false, {0, plane, nu * plane}, 0.002);
  check_stress<3>(false, {0, -0.001 * E, 0}, 0.002);
}
