// A long slope with seepage along it, `examples/saturated-slope.json` and the same in 3D. It is at
// the limit where tan(beta) = gamma' / gamma_sat times the friction coefficient (Taylor 1948); with
// the pore pressure of the seepage, gamma_w d cos(beta) at a depth d. Sand that does not dilate has
// the friction sin(phi) along planes that keep their length, as all of the slope's do (Davis 1968).
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/verification/case.h"

using namespace lahar;
using namespace lahar::verification;

namespace {

constexpr double g = 9.81, grains = 2650, water = 1000, porosity = 0.4;  // [m/s^2], [kg/m^3]
constexpr double friction = 0.5;                                         // sin(30 degrees)
constexpr double buoyant = (1 - porosity) * (grains - water);
constexpr double saturated = (1 - porosity) * grains + porosity * water;
constexpr double limit = buoyant / saturated * friction;  // of tan(beta)

struct Resolution {
  double cell = 0.125;  ///< across the slope [m]
  double safety = 0.2;
  double length = 1000;  ///< of cells along the slope [m]
};

/// The example where tan(beta) is `share` of the limit, twenty times as long, so that its ends are
/// not felt. In 3D the slope dips at 30 degrees from the x axis. Softer water takes fewer steps;
/// sand that drains well has the pressures of the seepage while gravity grows.
template <int Dim>
Model<Dim> slope(double share, const Resolution& at) {
  const double beta = std::atan(share * limit), along = g * std::sin(beta);
  const int layers = static_cast<int>(std::lround(1 / at.cell)) + 2;
  const int cells = static_cast<int>(std::lround(6000 / at.length));
  ScenarioOptions options;
  options.overrides = {"materials.1.bulk_modulus=2e7", "materials.0.k_x=5e-2",
                       "analysis.end_time=2",
                       fmt::format("analysis.time_step.safety={}", at.safety),
                       "external_loading_conditions.gravity.ramping_time=0.5"};
  if (Dim == 2) {
    options.overrides.push_back(
        fmt::format("mesh.structured.cell_size=[{},{}]", at.length, at.cell));
    options.overrides.push_back(fmt::format("mesh.structured.counts=[{},{}]", cells, layers));
    options.overrides.push_back("particles.0.generator.region.box.min=[1000,0]");
    options.overrides.push_back("particles.0.generator.region.box.max=[5000,1]");
    options.overrides.push_back(fmt::format("external_loading_conditions.gravity.gravity=[{},{}]",
                                            along, -g * std::cos(beta)));
  } else {
    options.overrides.push_back(
        fmt::format("mesh.structured.cell_size=[{0},{0},{1}]", at.length, at.cell));
    options.overrides.push_back(fmt::format("mesh.structured.counts=[{0},{0},{1}]", cells, layers));
    options.overrides.push_back("particles.0.generator.region.box.min=[1000,1000,0]");
    options.overrides.push_back("particles.0.generator.region.box.max=[5000,5000,1]");
    options.overrides.push_back(
        fmt::format("external_loading_conditions.gravity.gravity=[{},{},{}]",
                    along * std::cos(std::numbers::pi / 6), along * std::sin(std::numbers::pi / 6),
                    -g * std::cos(beta)));
  }
  const std::string file = LAHAR_SOURCE_DIR "/examples/saturated-slope";
  Scenario scenario = read_scenario(file + (Dim == 2 ? ".json" : "-3d.json"), options);
  return std::get<Model<Dim>>(std::move(scenario.model));
}

struct Motion {
  double displacement, speed;  ///< largest, of the middle of the slope [m], [m/s]
  double seepage;              ///< largest error of pore pressures / water's weight over the depth
};

template <int Dim>
Motion move(double share, const Resolution& at) {
  Simulation simulation(slope<Dim>(share, at));
  simulation.run();
  const State state(simulation.frame());
  const double weight = water * g * std::cos(std::atan(share * limit));
  Motion motion{};
  for (Index p = 0; p < state.size(); ++p) {
    bool inside = true;
    double moved = 0, speed = 0;
    for (int d = 0; d < Dim - 1; ++d) {
      inside = inside && std::abs(state.x(p, d) - 3000) < 1000;
      moved = std::hypot(moved, state.get("displacement", p, d));
      speed = std::hypot(speed, state.get("velocity", p, d));
    }
    if (!inside) continue;
    motion.displacement = std::max(motion.displacement, moved);
    motion.speed = std::max(motion.speed, speed);
    const double depth = 1 - state.x(p, Dim - 1);
    motion.seepage =
        std::max(motion.seepage, std::abs(state.get("pore_pressure", p) / weight - depth));
  }
  return motion;
}

template <int Dim>
void check_limit(const Resolution& at) {
  CAPTURE(Dim);
  CAPTURE(at.cell);
  CAPTURE(at.safety);
  const Motion below = move<Dim>(0.98, at), above = move<Dim>(1.02, at);
  for (const Motion& motion : {below, above})
    MESSAGE(fmt::format(
        "{}D, cell {}, {}, length {}: moved {:.5f} m, speed {:.5f} m/s, pore "
        "pressure {:.4f}",
        Dim, at.cell, at.safety, at.length, motion.displacement, motion.speed, motion.seepage));
  CHECK(below.speed < 0.005);
  CHECK(above.speed > 0.05);
  CHECK(below.seepage < 0.6 * at.cell);  // pressures are those of cells
}

}  // namespace

TEST_CASE("a saturated slope slides at more than the limit of its seepage, and not at less") {
  check_limit<2>({});
  check_limit<2>({.safety = 0.1});
  check_limit<2>({.cell = 0.0625});
  check_limit<2>({.length = 500});
}

TEST_CASE("a saturated slope slides in 3D as in 2D") {
  check_limit<3>({});
  check_limit<3>({.safety = 0.1});
  check_limit<3>({.cell = 0.0625});
}
