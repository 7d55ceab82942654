// A rough strip footing on clay without weight: Prandtl (1920), q = (2 + pi) s_u.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <string>

#include "tests/verification/case.h"
#include "tests/within.h"

using namespace lahar;
using namespace lahar::verification;

namespace {

// Half of it: a block of half width 1 on 5 x 3 of clay. The rigidity G / s_u decides how far it has
// to go down until the clay flows (1 % for 500); density is what makes that slow beside waves.
constexpr double su = 1, nu = 0.45, rho = 1, width = 5, height = 3;

struct Method {
  std::string functions, update;
  int per_cell;
  bool b_bar = false;
  int cells = 16;  ///< in the half width
  double courant = 0.4;
  double G = 500, settlement = 0.02;  ///< the last
};

/// Mean pressure under the footing over s_u in the last quarter of its settlement: from the work of
/// the footing, and carried by the ground.
struct Load {
  double work, ground;
};

/// The footing is an elastic block whose upper part is driven by nodes: those of the surface would
/// soon have no clay under them. What is exact is the balance: without weight, and with smooth
/// sides, the lowest cells carry what the footing pushes. No damping: it acts as friction in the
/// flow, and made 10 % of the load.
Load bearing_capacity(const Method& method) {
  const double G = method.G, lambda = 2 * G * nu / (1 - 2 * nu),
               c = std::sqrt((lambda + 2 * G) / rho);
  const double h = 1.0 / method.cells;
  const double speed = 0.2 * su / std::sqrt(G * rho), dt = method.courant * h / c;
  Model<2> model = model_of_text<2>(fmt::format(
      R"({{
    "mesh": {{"structured": {{"cell_size": {h}, "extent": [{width}, {top}]}},
             "boundary_conditions": {{"velocity_constraints": [
               {{"nset": "sides", "dir": "x", "velocity": 0}},
               {{"nset": "base", "dir": "x", "velocity": 0}},
               {{"nset": "base", "dir": "y", "velocity": 0}},
               {{"nset": "footing", "dir": "x", "velocity": 0}},
               {{"nset": "footing", "dir": "y", "velocity": {velocity}}}]}}}},
    "sets": {{"nodes": {{
      "sides": {{"union": [{{"half_space": {{"point": [0, 0], "normal": [1, 0]}}}},
                          {{"half_space": {{"point": [{width}, 0], "normal": [-1, 0]}}}}]}},
      "base": {{"half_space": {{"point": [0, 0], "normal": [0, 1]}}}},
      "footing": {{"box": {{"min": [0, {driven}], "max": [{reach}, {top}]}}}}}}}},
    "materials": [
      {{"type": "MohrCoulomb", "density": {rho}, "youngs_modulus": {E}, "poisson_ratio": {nu},
       "friction": 0, "dilation": 0, "cohesion": {su}, "tension_cutoff": 1e9, "softening": false}},
      {{"type": "LinearElastic", "density": {rho}, "youngs_modulus": {E}, "poisson_ratio": 0}}],
    "particles": [
      {{"generator": {{"type": "region", "per_cell": {per_cell}, "material": 0,
                     "region": {{"box": {{"min": [0, 0], "max": [{width}, {height}]}}}}}}}},
      {{"generator": {{"type": "region", "per_cell": {per_cell}, "material": 1,
                     "region": {{"box": {{"min": [0, {height}], "max": [1, {block}]}}}}}}}}],
    "analysis": {{"mpm_scheme": "usl", "shape_functions": "{functions}",
                 "velocity_update": "{update}", "b_bar": {b_bar}, "dt": {dt},
                 "nsteps": 1000000}}}})",
      fmt::arg("h", h), fmt::arg("width", width), fmt::arg("height", height),
      fmt::arg("top", height + 7 * h), fmt::arg("velocity", -speed),
      fmt::arg("driven", height + 2 * h), fmt::arg("reach", 1 + h), fmt::arg("rho", rho),
      fmt::arg("E", 2 * G * (1 + nu)), fmt::arg("nu", nu), fmt::arg("su", su),
      fmt::arg("per_cell", method.per_cell), fmt::arg("block", height + 5 * h),
      fmt::arg("functions", method.functions), fmt::arg("update", method.update),
      fmt::arg("b_bar", method.b_bar), fmt::arg("dt", dt)));
  Simulation simulation(std::move(model));
  const auto go_to = [&](double settlement) {
    simulation.advance(std::llround((settlement / speed - simulation.time()) / dt));
    return simulation.history().external;
  };
  const double first = go_to(0.75 * method.settlement);
  double last = first, ground = 0;
  constexpr int samples = 5;
  for (int k = 1; k <= samples; ++k) {
    last = go_to((0.75 + 0.25 * k / samples) * method.settlement);
    const State state(simulation.frame());
    for (Index p = 0; p < state.size(); ++p)
      if (state.x(p, 1) < 2 * h)
        ground -= state.get("stress", p, 1) * state.get("volume", p) / (2 * h * samples);
  }
  const Load load{(last - first) / (0.25 * method.settlement) / su, ground / su};
  MESSAGE(method.functions << " " << method.update << ", " << method.per_cell << " x "
                           << method.per_cell << " particles, b_bar " << method.b_bar << ", "
                           << method.cells << " cells, step " << method.courant << ": " << load.work
                           << " from work, " << load.ground << " in the ground, "
                           << 100 * (load.ground / (2 + std::numbers::pi) - 1)
                           << " % above Prandtl");
  return load;
}

/// Reaction of a rough plate over Prandtl's load, in the mean over penetrations of 5 to 7 % of its
/// width of 1 m. It is a body in contact, with velocities prescribed at its particles; half of it.
double plate_reaction(double cell, double safety) {
  constexpr double yield = 20000, speed = 0.2;  // [Pa], [m/s]
  const std::string text = fmt::format(
      R"({{
    "mesh": {{"structured": {{"cell_size": {cell}, "extent": [5, 4]}},
             "boundary_conditions": {{
               "velocity_constraints": [{{"nset": "base", "dir": "x", "velocity": 0}},
                                        {{"nset": "base", "dir": "y", "velocity": 0}},
                                        {{"nset": "sides", "dir": "x", "velocity": 0}}],
               "particles_velocity_constraints": [{{"pset": "plate", "dir": "x", "velocity": 0}},
                                                  {{"pset": "plate", "dir": "y", "velocity": {v}}}]}}}},
    "sets": {{"nodes": {{
      "base": {{"half_space": {{"point": [0, 0], "normal": [0, 1]}}}},
      "sides": {{"union": [{{"half_space": {{"point": [0, 0], "normal": [1, 0]}}}},
                          {{"half_space": {{"point": [5, 0], "normal": [-1, 0]}}}}]}}}}}},
    "materials": [
      {{"name": "clay", "type": "VonMises", "density": 1800, "youngs_modulus": 1e7,
       "poisson_ratio": 0.45, "yield_stress": {yield}}},
      {{"name": "steel", "type": "LinearElastic", "density": 7800, "youngs_modulus": 2e7,
       "poisson_ratio": 0.2}}],
    "particles": [
      {{"generator": {{"type": "region", "per_cell": 2, "material": "clay",
                     "region": {{"box": {{"max": [5, 3]}}}}}}}},
      {{"generator": {{"type": "region", "per_cell": 2, "material": "steel", "pset": "plate",
                     "region": {{"box": {{"min": [0, 3], "max": [0.5, 3.3]}}}}}}}}],
    "analysis": {{"interface": true, "contact": {{"friction": 1}}, "end_time": 0.35,
                 "time_step": {{"safety": {safety}}}}},
    "post_processing": {{"output_dt": 0.25}}}})",
      fmt::arg("cell", cell), fmt::arg("v", -speed), fmt::arg("yield", yield),
      fmt::arg("safety", safety));
  Scenario scenario = read_scenario_text(text, LAHAR_SOURCE_DIR);  // native defaults
  Simulation simulation(std::get<Model<2>>(std::move(scenario.model)));
  while (simulation.time() < 0.25 * (1 - 1e-9)) simulation.advance(1);
  const HistoryRow first = simulation.history();
  simulation.run();
  const HistoryRow last = simulation.history();
  CHECK(std::abs(last.balance) < 0.01 * last.external);
  const double reaction = (last.external - first.external) / (speed * (last.time - first.time));
  return reaction / (0.5 * (2 + std::numbers::pi) * yield / std::numbers::sqrt3);
}

/// Pressure under a rough rigid body that equilibria press into Tresca's clay, over its strength,
/// in the last quarter of a settlement of 0.3 % of its half width, or radius, of 1 m.
double body_pressure(int cells, int steps, const std::string& plane = "strain") {
  constexpr double yield = 1000, settlement = 0.003, modulus = 1.45e7;  // [Pa], [m], [Pa]
  const double h = 1.0 / cells;
  const std::string text = fmt::format(
      R"({{
    "mesh": {{"structured": {{"cell_size": {h}, "extent": [5, {top}]}},
             "boundary_conditions": {{
               "velocity_constraints": [{{"nset": "base", "dir": "x", "velocity": 0}},
                                        {{"nset": "base", "dir": "y", "velocity": 0}},
                                        {{"nset": "sides", "dir": "x", "velocity": 0}}]}}}},
    "sets": {{"nodes": {{
      "base": {{"half_space": {{"point": [0, 0], "normal": [0, 1]}}}},
      "sides": {{"union": [{{"half_space": {{"point": [0, 0], "normal": [1, 0]}}}},
                          {{"half_space": {{"point": [5, 0], "normal": [-1, 0]}}}}]}}}}}},
    "materials": [
      {{"name": "clay", "type": "MohrCoulomb", "density": 1800, "youngs_modulus": {E},
       "poisson_ratio": 0.45, "friction": 0, "dilation": 0, "cohesion": {yield},
       "tension_cutoff": 1e6}}],
    "particles": [
      {{"generator": {{"type": "region", "per_cell": 2, "material": "clay",
                     "region": {{"box": {{"max": [5, 3]}}}}}}}}],
    "rigid_bodies": [{{"name": "footing", "region": {{"box": {{"min": [-1, 3], "max": [1, 4]}}}},
                      "velocity": [0, {v}], "friction": "rough"}}],
    "analysis": {{"mpm_scheme": "newmark", "scheme_settings": {{"quasi_static": true}},
                 "shape_functions": "element", "b_bar": true, "plane": "{plane}", "dt": {dt},
                 "nsteps": {n}}}}})",
      fmt::arg("h", h), fmt::arg("top", 3 + 4 * h), fmt::arg("v", -settlement),
      fmt::arg("yield", yield), fmt::arg("E", modulus), fmt::arg("dt", 1.0 / steps),
      fmt::arg("n", steps), fmt::arg("plane", plane));
  Scenario scenario = read_scenario_text(text, LAHAR_SOURCE_DIR);  // native defaults
  Simulation simulation(std::get<Model<2>>(std::move(scenario.model)));
  simulation.advance(steps - steps / 4);
  double sum = 0;
  for (int k = 0; k < steps / 4; ++k) {
    simulation.advance(1);
    sum += simulation.history().bodies.front().force[1];
  }
  const double area = plane == "strain" ? 1.0 : std::numbers::pi;
  return sum / (steps / 4) / area / yield;
}

}  // namespace

TEST_CASE("a rigid footing that equilibria press into clay meets Prandtl's load") {
  const double prandtl = 2 + std::numbers::pi, coarse = body_pressure(8, 20) / prandtl,
               half_step = body_pressure(8, 40) / prandtl,
               half_cell = body_pressure(16, 20) / prandtl;
  MESSAGE("reaction over Prandtl's: " << coarse << ", half the step " << half_step
                                      << ", half the cell " << half_cell);
  // It acts half a cell wider.
  CHECK(half_step == test::within(0.002, coarse));
  CHECK(coarse == test::within(0.01, 1 + 0.5 / 8));
  CHECK(half_cell == test::within(0.01, 1 + 0.5 / 16));
}

// 6.05: Cox, Eason & Hopkins 1961.
TEST_CASE("a rigid round footing that equilibria press into clay meets the load of its circle") {
  constexpr double exact = 6.05;
  const double coarse = body_pressure(8, 20, "axisymmetric"),
               half_step = body_pressure(8, 40, "axisymmetric"),
               half_cell = body_pressure(16, 20, "axisymmetric");
  MESSAGE("pressure over the strength: " << coarse << ", half the step " << half_step
                                         << ", half the cell " << half_cell);
  CHECK(half_step == test::within(0.002, coarse));
  CHECK(coarse == test::within(0.09, exact));
  CHECK(half_cell == test::within(0.03, exact));
}

TEST_CASE("a strip footing fails at Prandtl's load") {
  const double prandtl = 2 + std::numbers::pi;
  const auto check = [prandtl](const Method& method, double tolerance) {
    const Load load = bearing_capacity(method);
    CHECK(load.work == test::within(0.02, load.ground));
    CHECK(load.ground > prandtl);
    CHECK(load.ground == test::within(tolerance, prandtl));
  };
  // Measured 2.9 and 2.2 %. Nodes share what is beside the footing with it: it is half a cell
  // wider, by 3 % here.
  check({"quadratic_spline", "apic", 1}, 0.05);
  check({"gimp", "flip", 1}, 0.05);
  // Measured 8.6, 11.3 and 13.8 %, with 8 cells instead of 16 13 % for splines: with four particles
  // a cell has more constraints of volume than nodes can meet (locking).
  check({"quadratic_spline", "apic", 2}, 0.11);
  check({"gimp", "flip", 2}, 0.13);
  check({"element", "flip", 2}, 0.17);
}

// Rigid clay flows before the footing has gone down by a tenth of a cell. Loads from work are means
// over all waves in the ground: half the step does not change them. What is too much falls with the
// cell: nodes share what is beside the footing with it, and it is half a cell wider.
TEST_CASE("with the mean of volumetric strains, four particles per cell carry Prandtl's load") {
  const auto excess = [](const std::string& functions, const std::string& update, bool b_bar,
                         int cells, double courant = 0.4) {
    const Load load = bearing_capacity({functions, update, 2, b_bar, cells, courant, 5000, 0.003});
    CHECK(load.work == test::within(0.03, load.ground));
    return load.work / (2 + std::numbers::pi) - 1;
  };
  for (const std::string functions : {"element", "gimp"}) {
    const double coarse = excess(functions, "flip", true, 16);
    CHECK(std::abs(coarse) < 0.03);
    CHECK(std::abs(excess(functions, "flip", true, 16, 0.2) - coarse) < 0.005);
    const double fine = excess(functions, "flip", true, 32);
    CHECK(std::abs(fine) < 0.025);
    CHECK(fine < coarse);
    CHECK(excess(functions, "flip", false, 16) > 0.15);
  }
  // Splines are three cells wide, and so is what flows beside the edge.
  CHECK(excess("quadratic_spline", "apic", true, 16) < 0.08);
  CHECK(excess("quadratic_spline", "apic", false, 16) > 0.085);
}

TEST_CASE("a plate in contact that is pushed into clay meets Prandtl's load as cells get smaller") {
  const double coarse = plate_reaction(0.1, 0.4), half_step = plate_reaction(0.1, 0.2),
               half_cell = plate_reaction(0.05, 0.4);
  MESSAGE("reaction over Prandtl's: " << coarse << ", half the step " << half_step
                                      << ", half the cell " << half_cell);
  // The clay rises beside the plate, and it is sheared along the plate's sides: above 1 at any
  // cell.
  CHECK(half_step == test::within(0.01, coarse));
  CHECK(half_cell == test::within(0.08, coarse));
  CHECK(half_cell < coarse);
  CHECK(half_cell > 1.0);
  CHECK(coarse < 1.4);
}
