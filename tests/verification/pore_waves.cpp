// Waves along a saturated bar (Biot 1956, without added mass): a fast one, in which skeleton and
// water move together, and a slow one, in which they move against each other. With the drag so
// large that they cannot, a single wave is left.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "tests/verification/case.h"
#include "tests/within.h"

using namespace lahar;
using namespace lahar::verification;

namespace {

constexpr double grains = 2650, water = 1000, porosity = 0.4;                // densities [kg/m^3]
constexpr double youngs_modulus = 1e8, poisson = 0.2, bulk_modulus = 2.2e9;  // [Pa]
constexpr double oedometric = youngs_modulus * (1 - poisson) / ((1 + poisson) * (1 - 2 * poisson));

/// A plane wave: c^2 [m_s 0; 0 m_l] {U, W} = [E + (1-n)^2 K/n, (1-n) K; (1-n) K, n K] {U, W}.
struct Wave {
  double speed;             ///< [m/s]
  double skeleton, liquid;  ///< amplitudes of the velocities
};

Wave biot(bool fast) {
  const double n = porosity, s = 1 - n, K = bulk_modulus;
  const double m_s = s * grains, m_l = n * water;
  const double a = oedometric + s * s * K / n, b = s * K, d = n * K;  // the stiffness
  // m_s m_l c^4 - (a m_l + d m_s) c^2 + (a d - b^2) = 0
  const double half = 0.5 * (a / m_s + d / m_l);
  const double root = std::sqrt(half * half - (a * d - b * b) / (m_s * m_l));
  const double square = fast ? half + root : half - root;
  return {std::sqrt(square), 1, (square * m_s - a) / b};
}

Wave undrained() {
  const double mixture = (1 - porosity) * grains + porosity * water;
  return {std::sqrt((oedometric + bulk_modulus / porosity) / mixture), 1, 1};
}

struct Bar {
  int cells = 20;
  double safety = 0.4;
  std::string scheme = "musl", functions = "element";
};

/// 1 m long, held at both ends and along its sides.
Model<2> model_of(const Bar& bar, double conductivity, const Wave& wave) {
  const double h = 1.0 / bar.cells;
  Model<2> model = model_of_text<2>(fmt::format(
      R"({{
    "mesh": {{"structured": {{"cell_size": {0}, "counts": [{1}, 1]}},
      "boundary_conditions": {{"velocity_constraints": [
        {{"nset": -1, "dir": "y", "velocity": 0}},
        {{"nset": "ends", "dir": "x", "velocity": 0}}]}}}},
    "sets": {{"nodes": {{"ends": {{"union": [
      {{"half_space": {{"point": [0, 0], "normal": [1, 0]}}}},
      {{"half_space": {{"point": [1, 0], "normal": [-1, 0]}}}}]}}}}}},
    "materials": [
      {{"name": "soil", "type": "LinearElastic", "density": {2}, "youngs_modulus": {3},
       "poisson_ratio": {4}, "porosity": {5}, "k_x": {6}}},
      {{"name": "water", "type": "Newtonian", "density": {7}, "bulk_modulus": {8},
       "dynamic_viscosity": 1e-3}}],
    "particles": [{{"generator": {{"type": "region", "material": ["soil", "water"], "per_cell": 2,
      "region": {{"box": {{"min": [0, 0], "max": [1, {0}]}}}}}}}}],
    "analysis": {{"preset": "lahar", "mpm_scheme": "{9}", "shape_functions": "{10}", "end_time": 1,
                 "time_step": {{"safety": {11}}}}}}})",
      h, bar.cells, grains, youngs_modulus, poisson, porosity, conductivity, water, bulk_modulus,
      bar.scheme, bar.functions, bar.safety));
  auto& p = model.particles;
  p.velocity.clear();
  p.liquid_velocity.clear();
  for (const Vec<2>& x : p.x) {
    const double shape = 1e-3 * std::sin(std::numbers::pi * x[0]);
    p.velocity.emplace_back(wave.skeleton * shape, 0);
    p.liquid_velocity.emplace_back(wave.liquid * shape, 0);
  }
  return model;
}

/// Speed of the wave from one and a half periods of the bar's first mode [m/s].
double measured_speed(Model<2> model) {
  Simulation simulation(std::move(model));
  constexpr int last = 4;
  double first_time = 0, before = 1, time_before = 0;
  for (int crossings = 0; !simulation.finished();) {
    simulation.advance(1);
    const State state(simulation.frame());
    double mode = 0;
    for (Index p = 0; p < state.size(); ++p)
      mode += state.get("velocity", p, 0) * std::sin(std::numbers::pi * state.x(p, 0));
    if (mode * before < 0) {
      const double at = time_before + before / (before - mode) * (state.time() - time_before);
      if (++crossings == 1) first_time = at;
      if (crossings == last) return (last - 1) / (at - first_time);
    }
    before = mode;
    time_before = state.time();
  }
  return 0;
}

void check_speeds(const Bar& bar) {
  CAPTURE(bar.cells);
  CAPTURE(bar.safety);
  CAPTURE(bar.scheme);
  CAPTURE(bar.functions);
  constexpr double no_drag = 1e9, no_flow = 1e-9;  // conductivities [m/s]
  const struct {
    const char* name;
    double conductivity;
    Wave wave;
  } cases[] = {{"fast", no_drag, biot(true)},
               {"slow", no_drag, biot(false)},
               {"undrained", no_flow, undrained()}};
  for (const auto& c : cases) {
    const double speed = measured_speed(model_of(bar, c.conductivity, c.wave));
    MESSAGE(fmt::format("{}: {:.1f} m/s, exact {:.1f} m/s, error {:+.2f} % ({} cells, {}, {}, {})",
                        c.name, speed, c.wave.speed, 100 * (speed / c.wave.speed - 1), bar.cells,
                        bar.safety, bar.scheme, bar.functions));
    CHECK(speed == test::within(0.01, c.wave.speed));
  }
}

}  // namespace

TEST_CASE("a saturated bar has a fast and a slow wave, and one where water cannot flow") {
  CHECK(biot(true).speed > 4 * biot(false).speed);
  check_speeds({});
  check_speeds({.safety = 0.2});
  check_speeds({.cells = 40});
  check_speeds({.scheme = "usl"});
  check_speeds({.functions = "quadratic_spline"});
}
