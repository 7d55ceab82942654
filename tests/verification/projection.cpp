// Projections: liquids at rest, in free fall, in a vortex, and in the pores of a soil.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <string>

#include "tests/terzaghi.h"
#include "tests/verification/case.h"
#include "tests/within.h"

using namespace lahar;
using namespace lahar::verification;

namespace {

constexpr double pi = std::numbers::pi;

struct Tank {
  double kept = 0;
  double height = 1;  ///< [m] of the mesh
  double dt = 0.002;
  std::string surface = "density";
  std::string cells = "";  ///< "cell_type": ..., of the mesh
};

/// Water that is 1 m deep in a tank.
template <int Dim>
Model<Dim> tank(const Tank& of, int steps) {
  const bool flat = Dim == 2;
  return model_of_text<Dim>(fmt::format(
      R"({{
    "mesh": {{{13}"structured": {{"cell_size": 0.1, "extent": [0.4, {0}{1}]}},
      "boundary_conditions": {{"velocity_constraints": [
        {{"nset": "x", "dir": "x", "velocity": 0}},{2}
        {{"nset": "base", "dir": "{3}", "velocity": 0}}]}}}},
    "sets": {{"nodes": {{
      "x": {{"union": [{{"half_space": {{"point": [0, 0{4}], "normal": [1, 0{4}]}}}},
                       {{"half_space": {{"point": [0.4, 0{4}], "normal": [-1, 0{4}]}}}}]}},
      {5}
      "base": {{"union": [{{"half_space": {{"point": [0, 0{4}], "normal": [0{4}, 1]}}}},
                          {{"half_space": {{"point": [0, {6}], "normal": [0{4}, -1]}}}}]}}}}}},
    "materials": [{{"type": "Newtonian", "density": 1000, "bulk_modulus": 2e9,
                    "dynamic_viscosity": 1e-3}}],
    "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": 0,
                    "region": {{"box": {{"min": [0, 0{4}], "max": [0.4, {7}]}}}}}}}}],
    "external_loading_conditions": {{"gravity": [0, {8}]}},
    "analysis": {{"mpm_scheme": "projection", "dt": {9}, "nsteps": {10},
      "scheme_settings": {{"beta": {11}}}, "free_surface_detection": {{"type": "{12}"}}}}}})",
      flat ? "" : "0.3, ", of.height, flat ? "" : R"({"nset": "y", "dir": "y", "velocity": 0},)",
      flat ? "y" : "z", flat ? "" : ", 0",
      flat ? "" : R"("y": {"union": [{"half_space": {"point": [0, 0, 0], "normal": [0, 1, 0]}},
                 {"half_space": {"point": [0, 0.3, 0], "normal": [0, -1, 0]}}]},)",
      flat ? fmt::format("{}", of.height) : fmt::format("0, {}", of.height), flat ? "1" : "0.3, 1",
      flat ? "-10" : "0, -10", of.dt, steps, of.kept, of.surface, of.cells));
}

struct Water {
  double pressure = 0;  ///< largest error, over that at the base
  double scatter = 0;   ///< largest difference from the mean of a layer, over the same
  double speed = 0;     ///< [m/s]
};

/// Against rho g times the depth, or up to a constant where `closed`.
template <int Dim>
Water water_after(const Tank& of, int steps, bool closed = false) {
  Simulation simulation(tank<Dim>(of, steps));
  simulation.run();
  const State state(simulation.frame());
  const auto pressure = [&](Index p) { return state.get("pressure", p); };
  const auto expected = [&](Index p) { return 1e4 * (1.0 - state.x(p, Dim - 1)); };
  const auto all = [](Index) { return true; };
  const double shift =
      closed ? mean(state, all, [&](Index p) { return pressure(p) - expected(p); }) : 0.0;
  Water water;
  for (Index p = 0; p < state.size(); ++p) {
    const double layer = mean(
        state, [&](Index q) { return std::abs(state.x(q, Dim - 1) - state.x(p, Dim - 1)) < 1e-3; },
        pressure);
    water.scatter = std::max(water.scatter, std::abs(pressure(p) - layer) / 1e4);
    water.pressure = std::max(water.pressure, std::abs(pressure(p) - shift - expected(p)) / 1e4);
    for (int d = 0; d < Dim; ++d)
      water.speed = std::max(water.speed, std::abs(state.get("velocity", p, d)));
  }
  return water;
}

}  // namespace

TEST_CASE("projection: water at rest stays at rest, and its pressure is that of its depth") {
  for (const double dt : {0.002, 0.02}) {
    CAPTURE(dt);
    const Water flat = water_after<2>({.height = 1.4, .dt = dt}, 50);
    CHECK(flat.pressure < 1e-6);
    CHECK(flat.scatter < 1e-6);
    CHECK(flat.speed < 1e-6);
  }
  const Water triangles = water_after<2>({.height = 1.4, .cells = R"("cell_type": "ED2T3", )"}, 50);
  CHECK(triangles.pressure < 1e-6);
  CHECK(triangles.speed < 1e-6);
  const Water solid = water_after<3>({.height = 1.4}, 10);
  CHECK(solid.pressure < 1e-6);
  CHECK(solid.speed < 1e-6);
}

TEST_CASE("projection: pressure that is kept becomes that of the depth") {
  const Water water = water_after<2>({.kept = 1, .height = 1.4}, 500);
  CHECK(water.pressure < 0.005);
  CHECK(water.scatter < 1e-6);
  CHECK(water.speed < 1e-3);
}

TEST_CASE("projection: a full tank has the gradient of the pressure, and no free surface") {
  const Water water = water_after<2>({}, 50, true);
  CHECK(water.pressure < 1e-6);
  CHECK(water.speed < 1e-6);
}

TEST_CASE("projection: a drop falls freely, without a pressure") {
  Model<2> model = tank<2>({.height = 1.4}, 20);
  for (Vec<2>& x : model.particles.x) x[1] = 0.6 + 0.5 * x[1];
  for (std::size_t p = 0; p < model.particles.x.size(); ++p)
    model.particles.cell[p] = model.mesh->locate(model.particles.x[p]).cell;
  Simulation simulation(std::move(model));
  simulation.run();
  const State state(simulation.frame());
  for (Index p = 0; p < state.size(); ++p) {
    CHECK(state.get("velocity", p, 1) == test::within(1e-6, -10 * 0.04));
    CHECK(std::abs(state.get("pressure", p)) < 1e-3);
  }
}

namespace {

/// Taylor and Green's vortex between walls without friction, in a unit square: u = sin(pi x)
/// cos(pi y), v = -cos(pi x) sin(pi y), which decay as exp(-2 nu pi^2 t), with the pressure
/// (cos(2 pi x) + cos(2 pi y)) / 4 of their square. Velocities err by so much, over the largest.
double vortex_error(int cells, double dt, double end) {
  Model<2> model = model_of_text<2>(fmt::format(
      R"({{
    "mesh": {{"structured": {{"cell_size": {0}, "counts": [{1}, {1}]}},
      "boundary_conditions": {{"velocity_constraints": [
        {{"nset": "x", "dir": "x", "velocity": 0}}, {{"nset": "y", "dir": "y", "velocity": 0}}]}}}},
    "sets": {{"nodes": {{
      "x": {{"union": [{{"half_space": {{"point": [0, 0], "normal": [1, 0]}}}},
                       {{"half_space": {{"point": [1, 0], "normal": [-1, 0]}}}}]}},
      "y": {{"union": [{{"half_space": {{"point": [0, 0], "normal": [0, 1]}}}},
                       {{"half_space": {{"point": [0, 1], "normal": [0, -1]}}}}]}}}}}},
    "materials": [{{"type": "Newtonian", "density": 1, "bulk_modulus": 1e9,
                    "dynamic_viscosity": 0.01}}],
    "particles": [{{"generator": {{"type": "region", "per_cell": 3, "material": 0,
                    "region": {{"box": {{"min": [0, 0], "max": [1, 1]}}}}}}}}],
    "analysis": {{"mpm_scheme": "projection", "dt": {2}, "end_time": {3},
      "free_surface_detection": {{"type": "none"}}}}}})",
      1.0 / cells, cells, dt, end));
  const auto u = [](double x, double y) { return std::sin(pi * x) * std::cos(pi * y); };
  model.particles.velocity.clear();
  for (const Vec<2>& x : model.particles.x)
    model.particles.velocity.emplace_back(u(x[0], x[1]), -u(x[1], x[0]));
  Simulation simulation(std::move(model));
  simulation.run();
  const State state(simulation.frame());
  const double decay = std::exp(-2 * 0.01 * pi * pi * end);
  double square = 0;
  for (Index p = 0; p < state.size(); ++p) {
    const double x = state.x(p, 0), y = state.x(p, 1);
    square += std::pow(state.get("velocity", p, 0) - decay * u(x, y), 2) +
              std::pow(state.get("velocity", p, 1) + decay * u(y, x), 2);
  }
  return std::sqrt(square / static_cast<double>(state.size())) / decay;
}

}  // namespace

TEST_CASE("projection: a vortex decays as its viscosity says, the better the finer the cells") {
  const double coarse = vortex_error(10, 0.01, 0.5), fine = vortex_error(20, 0.005, 0.5);
  MESSAGE("velocities err by ", coarse, " and ", fine);
  CHECK(coarse < 0.03);
  CHECK(fine < 0.7 * coarse);
}

namespace {

/// Largest error of the pore pressures over the load, at T = 0.3.
double consolidation_error(double conductivity, double dt) {
  const double c_v = conductivity * 1e7 / 9810;
  Simulation simulation(model_of_text<2>(fmt::format(
      R"({{
    "mesh": {{"structured": {{"cell_size": 0.05, "counts": [1, 22]}},
      "particles_pore_pressures": {{"type": "isotropic", "values": 1e4}},
      "boundary_conditions": {{"velocity_constraints": [
        {{"nset": -1, "dir": "x", "velocity": 0}}, {{"nset": "base", "dir": "y", "velocity": 0}}]}}}},
    "sets": {{"nodes": {{"base": {{"half_space": {{"point": [0, 0], "normal": [0, 1]}}}}}},
             "particles": {{"top": {{"half_space": {{"point": [0, 0.975], "normal": [0, -1]}}}}}}}},
    "materials": [
      {{"name": "soil", "type": "LinearElastic", "density": 2650, "youngs_modulus": 1e7,
       "poisson_ratio": 0, "porosity": 0.4, "k_x": {}}},
      {{"name": "water", "type": "Newtonian", "density": 1000, "bulk_modulus": 2e10,
       "dynamic_viscosity": 1e-3}}],
    "particles": [{{"generator": {{"type": "region", "material": ["soil", "water"], "per_cell": 2,
      "region": {{"box": {{"min": [0, 0], "max": [0.05, 1]}}}}}}}}],
    "external_loading_conditions": {{"particle_surface_traction": [
      {{"pset": "top", "dir": "y", "traction": -1e4}}]}},
    "analysis": {{"mpm_scheme": "projection", "dt": {}, "end_time": {}}}}})",
      conductivity, dt, 0.3 / c_v)));
  simulation.run();
  const State state(simulation.frame());
  double error = 0;
  for (Index p = 0; p < state.size(); ++p) {
    const double depth = 1 - (state.x(p, 1) - state.get("displacement", p, 1));
    error = std::max(error, std::abs(state.get("pore_pressure", p) / 1e4 -
                                     test::terzaghi(state.time() * c_v, depth)));
  }
  return error;
}

}  // namespace

TEST_CASE("projection: soil consolidates as Terzaghi says, at steps that water's waves forbid") {
  for (const double dt : {2e-4, 4e-4}) {
    CAPTURE(dt);
    CHECK(consolidation_error(1e-3, dt) < 0.01);
    CHECK(consolidation_error(1e-4, dt) < 0.01);
  }
}

namespace {

/// A saturated column of 1 m on a base that holds it; g = 10 m/s^2 where there is gravity.
Model<2> saturated_column(double kept, double gravity, const std::string& pressures, double end) {
  return model_of_text<2>(fmt::format(
      R"({{
    "mesh": {{"structured": {{"cell_size": 0.05, "extent": [0.05, 1]}},
      "boundary_conditions": {{
        "velocity_constraints": [
          {{"nset": "all", "dir": "x", "velocity": 0}}, {{"nset": "all", "dir": 2, "velocity": 0}},
          {{"nset": "base", "dir": "y", "phase": "skeleton", "velocity": 0}}{}],
        "pressure_constraints": [{{"phase_id": 1, "nset": "top", "pressure": 0}}{}]}}}},
    "sets": {{"nodes": {{
      "all": {{"all": true}},
      "base": {{"half_space": {{"point": [0, 0], "normal": [0, 1]}}}},
      "top": {{"half_space": {{"point": [0, 1], "normal": [0, -1]}}}}}}}},
    "materials": [
      {{"name": "soil", "type": "LinearElastic", "density": 2650, "youngs_modulus": 1e7,
       "poisson_ratio": 0, "porosity": 0.4, "k_x": 1e-3}},
      {{"name": "water", "type": "Newtonian", "density": 1000, "bulk_modulus": 2e10,
       "dynamic_viscosity": 1e-3}}],
    "particles": [{{"generator": {{"type": "region", "material": ["soil", "water"], "per_cell": 2,
      "region": {{"box": {{"min": [0, 0], "max": [0.05, 1]}}}}}}}}],
    "external_loading_conditions": {{"gravity": [0, {}]}},
    "analysis": {{"mpm_scheme": "projection", "dt": 4e-4, "end_time": {},
                 "scheme_settings": {{"beta": {}}}, "free_surface_detection": {{"type": "none"}}}}}})",
      pressures.empty() ? R"(, {"nset": "base", "dir": "y", "phase": "liquid", "velocity": 0})"
                        : "",
      pressures, gravity, end, kept));
}

}  // namespace

TEST_CASE("projection: water in pores at rest has the pressure of its depth, whatever is kept") {
  for (const double kept : {0.0, 0.5, 1.0}) {
    CAPTURE(kept);
    Simulation simulation(saturated_column(kept, -10, "", 3));
    simulation.run();
    const State state(simulation.frame());
    for (Index p = 0; p < state.size(); ++p) {
      const double error = state.get("pore_pressure", p) / 1e4 - (1 - state.x(p, 1));
      CHECK(std::abs(error) < (state.x(p, 1) < 0.05 ? 0.04 : 0.01));  // the lowest cell: 0.03
    }
  }
}

// From equilibrium. Operators that differ at borders let the skeleton take over the weight of the
// water, the more the less permeable it is.
TEST_CASE("projection: water at rest in pores stays so in soil of any permeability") {
  for (const double k : {1e-3, 1e-5})
    for (const double kept : {0.0, 0.5, 1.0}) {
      CAPTURE(k);
      CAPTURE(kept);
      Simulation simulation(model_of_text<2>(fmt::format(
          R"({{
        "mesh": {{"structured": {{"cell_size": 0.1, "counts": [1, 11]}},
          "boundary_conditions": {{
            "velocity_constraints": [{{"nset": -1, "dir": "x", "velocity": 0}},
                                     {{"nset": "base", "dir": "y", "velocity": 0}}],
            "pressure_constraints": [{{"phase_id": 1, "nset": "top", "pressure": 0}}]}},
          "particles_stresses": {{"type": "k0", "k0": 0.25}},
          "particles_pore_pressures": {{"type": "water_table", "dir_v": 1, "dir_h": 0,
                                       "water_tables": [{{"position": 0, "h0": 1}}]}}}},
        "sets": {{"nodes": {{"base": {{"half_space": {{"point": [0, 0], "normal": [0, 1]}}}},
                            "top": {{"half_space": {{"point": [0, 1], "normal": [0, -1]}}}}}}}},
        "materials": [
          {{"name": "soil", "type": "LinearElastic", "density": 2650, "youngs_modulus": 1e7,
           "poisson_ratio": 0.2, "porosity": 0.4, "k_x": {}}},
          {{"name": "water", "type": "Newtonian", "density": 1000, "bulk_modulus": 1e8,
           "dynamic_viscosity": 1e-3}}],
        "particles": [{{"generator": {{"type": "region", "material": ["soil", "water"],
          "per_cell": 2, "region": {{"box": {{"min": [0, 0], "max": [0.1, 1]}}}}}}}}],
        "external_loading_conditions": {{"gravity": [0, -9.81]}},
        "analysis": {{"mpm_scheme": "projection", "dt": 2e-4, "end_time": 1,
                     "scheme_settings": {{"beta": {}}}}}}})",
          k, kept)));
      simulation.run();
      const State state(simulation.frame());
      double worst = 0;
      for (Index p = 0; p < state.size(); ++p)
        worst =
            std::max(worst, std::abs(state.get("pore_pressure", p) / 9810 - (1 - state.x(p, 1))));
      MESSAGE(fmt::format("k = {}, beta = {}: pressure wrong by {:.4f}", k, kept, worst));
      CHECK(worst < 0.002);
    }
}

// Darcy: discharge n (v_l - v) = k i with the gradient i = p / (rho g L); 9.81 m/s^2 are in k.
TEST_CASE("projection: a pressure below makes water flow upwards as Darcy says") {
  constexpr double base = 5e3, k = 1e-3;
  for (const double kept : {0.0, 1.0}) {
    CAPTURE(kept);
    Simulation simulation(saturated_column(
        kept, 0, fmt::format(R"(, {{"phase_id": 1, "nset": "base", "pressure": {}}})", base), 2));
    simulation.run();
    const State state(simulation.frame());
    double pressure = 0, flow = 0;  // largest errors
    for (Index p = 0; p < state.size(); ++p) {
      const double y = state.x(p, 1), discharge = 0.4 * (state.get("liquid_velocity", p, 1) -
                                                         state.get("velocity", p, 1));
      pressure = std::max(pressure, std::abs(state.get("pore_pressure", p) / base - (1 - y)));
      if (kept == 1.0 || y > 0.2)  // else disturbed in the lowest cells
        flow = std::max(flow, std::abs(discharge / (k * base / (1000 * 9.81)) - 1));
    }
    MESSAGE(
        fmt::format("beta = {}: pressure wrong by {:.4f}, flow by {:.4f}", kept, pressure, flow));
    CHECK(pressure < (kept == 1.0 ? 0.002 : 0.03));
    CHECK(flow < (kept == 1.0 ? 0.01 : 0.03));
  }
}

namespace {

/// Two layers of 0.5 m on a reservoir that presses with `base` [Pa], after a time that is long for
/// consolidation: the largest error of the pore pressure, over that at the base.
double reservoir_error(double below, double above, double cell, double dt) {
  constexpr double base = 14e3, weight = 9810;
  Simulation simulation(model_of_text<2>(fmt::format(
      R"({{
    "mesh": {{"structured": {{"cell_size": {0}, "extent": [{0}, 1.1]}},
      "boundary_conditions": {{
        "velocity_constraints": [
          {{"nset": "all", "dir": "x", "velocity": 0}},
          {{"nset": "base", "dir": "y", "phase": "skeleton", "velocity": 0}}],
        "pressure_constraints": [{{"nset": "base", "phase_id": 1, "pressure": {1}}}]}},
      "particles_stresses": {{"type": "k0", "k0": 0.3333}},
      "particles_pore_pressures": {{"type": "water_table",
                                   "water_tables": [{{"position": 0, "h0": 1}}]}}}},
    "sets": {{"nodes": {{"all": {{"all": true}},
                        "base": {{"half_space": {{"point": [0, 0], "normal": [0, 1]}}}}}}}},
    "materials": [
      {{"name": "below", "type": "LinearElastic", "density": 2650, "youngs_modulus": 1e7,
       "poisson_ratio": 0.25, "porosity": 0.4, "k_x": {2}}},
      {{"name": "above", "type": "LinearElastic", "density": 2650, "youngs_modulus": 1e7,
       "poisson_ratio": 0.25, "porosity": 0.4, "k_x": {3}}},
      {{"name": "water", "type": "Newtonian", "density": 1000, "bulk_modulus": 1e8,
       "dynamic_viscosity": 1e-3}}],
    "particles": [
      {{"generator": {{"type": "region", "per_cell": 2, "material": ["below", "water"],
        "region": {{"box": {{"min": [0, 0], "max": [{0}, 0.5]}}}}}}}},
      {{"generator": {{"type": "region", "per_cell": 2, "material": ["above", "water"],
        "region": {{"box": {{"min": [0, 0.5], "max": [{0}, 1]}}}}}}}}],
    "external_loading_conditions": {{"gravity": [0, -9.81]}},
    "analysis": {{"mpm_scheme": "projection", "dt": {4}, "end_time": 3}}}})",
      cell, base, below, above, dt)));
  simulation.run();
  const State state(simulation.frame());
  const double flow = (base / weight - 1) / (0.5 / below + 0.5 / above);  // discharge [m/s]
  double worst = 0;
  for (Index p = 0; p < state.size(); ++p) {
    const double y = state.x(p, 1);
    const double lost = flow / below * std::min(y, 0.5) + flow / above * std::max(y - 0.5, 0.0);
    worst = std::max(worst, std::abs(state.get("pore_pressure", p) - (base - weight * (y + lost))));
  }
  return worst / base;
}

}  // namespace

// A pressure that is not kept is that of the cells' Laplacian, and velocities are those of nodal
// gradients: the less permeable the soil, the more their difference looked like a flow.
TEST_CASE("projection: a reservoir's pressure makes water flow through two layers") {
  for (const auto& [below, above] : {std::pair(1e-3, 1e-4), std::pair(1e-4, 1e-3)}) {
    const double error = reservoir_error(below, above, 0.05, 2e-4),
                 half_step = reservoir_error(below, above, 0.05, 1e-4),
                 half_cell = reservoir_error(below, above, 0.025, 1e-4);
    MESSAGE(
        fmt::format("k = {}, {} m/s: pore pressure wrong by {:.4f}, half the step {:.4f}, "
                    "half the cell {:.4f}",
                    below, above, error, half_step, half_cell));
    CHECK(error < 0.005);
    CHECK(half_step < 0.005);
    CHECK(half_cell < 0.0025);
  }
}

// Held nodes are not a free surface. The water ends there, as it does at one.
TEST_CASE("projection: water rests behind a gate and on a floor of nodes within the mesh") {
  for (const double cell : {0.05, 0.025}) {
    CAPTURE(cell);
    Simulation simulation(model_of_text<2>(fmt::format(R"({{
      "mesh": {{"structured": {{"cell_size": {0}, "extent": [1, 0.8]}},
        "boundary_conditions": {{"velocity_constraints": [
          {{"nset": "floor", "dir": "y", "velocity": 0}}, {{"nset": "left", "dir": "x", "velocity": 0}},
          {{"nset": "gate", "dir": "x", "velocity": 0}}]}}}},
      "sets": {{"nodes": {{"floor": {{"box": {{"min": [0, 0.1], "max": [0.4, 0.1]}}}},
        "left": {{"half_space": {{"point": [0, 0], "normal": [1, 0]}}}},
        "gate": {{"box": {{"min": [0.4, 0.1], "max": [0.4, 0.8]}}}}}}}},
      "materials": [{{"name": "water", "type": "Newtonian", "density": 1000, "bulk_modulus": 4e6,
                     "dynamic_viscosity": 1e-3}}],
      "particles": [{{"generator": {{"type": "region", "material": "water", "per_cell": 2,
        "region": {{"box": {{"min": [0, 0.1], "max": [0.4, 0.5]}}}}}}}}],
      "external_loading_conditions": {{"gravity": [0, -9.81]}},
      "analysis": {{"preset": "lahar", "mpm_scheme": "projection", "dt": 0.002, "end_time": 0.5}},
      "post_processing": {{"gauges": [{{"name": "gate", "type": "force", "nset": "gate"}},
                                     {{"name": "floor", "type": "force", "nset": "floor"}}]}}}})",
                                                       cell)));
    simulation.run();
    const State state(simulation.frame());
    double highest = 0, lowest = 1, furthest = 0;
    for (Index p = 0; p < state.size(); ++p) {
      highest = std::max(highest, state.x(p, 1));
      lowest = std::min(lowest, state.x(p, 1));
      furthest = std::max(furthest, state.x(p, 0));
    }
    MESSAGE(fmt::format("cell {}: water from {:.4f} to {:.4f} m, to x = {:.4f} m", cell, lowest,
                        highest, furthest));
    CHECK(highest == test::within(0.01, 0.5 - cell / 4));
    CHECK(lowest == test::within(0.02, 0.1 + cell / 4));
    CHECK(furthest < 0.4);
  }
}
