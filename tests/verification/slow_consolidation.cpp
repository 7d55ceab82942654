// Water in the pores of a soil: one-dimensional consolidation (Terzaghi 1923), by every scheme and
// shape function, on finer cells, and for conductivities that differ by orders of magnitude at one
// time step.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>

#include "tests/terzaghi.h"
#include "tests/verification/case.h"

using namespace lahar;
using namespace lahar::verification;

namespace {

constexpr double porosity = 0.4, poisson = 0.2, bulk_modulus = 2.2e9;

/// c_v [m^2/s] with the water's compressibility.
double consolidation(double conductivity, double youngs_modulus) {
  const double oedometric = youngs_modulus * (1 - poisson) / ((1 + poisson) * (1 - 2 * poisson));
  return conductivity / 9810 / (1 / oedometric + porosity / bulk_modulus);
}

struct Column {
  std::string scheme = "musl", functions = "element";
  int cells = 20;
  double conductivity = 1e-3, youngs_modulus = 1e7;
  double dt = 0;      ///< [s]; 0 = adaptive
  double load = 1e4;  ///< [Pa]
};

std::string text_of(const Column& c, double end_time) {
  const double h = 1.0 / c.cells;
  return fmt::format(R"({{
    "mesh": {{"structured": {{"cell_size": {0}, "counts": [1, {1}]}},
      "particles_pore_pressures": {{"type": "isotropic", "values": {12}}},
      "boundary_conditions": {{"velocity_constraints": [
        {{"nset": -1, "dir": "x", "velocity": 0}},
        {{"nset": "base", "dir": "y", "velocity": 0}}]}}}},
    "sets": {{"nodes": {{"base": {{"half_space": {{"point": [0, 0], "normal": [0, 1]}}}}}},
             "particles": {{"top": {{"half_space": {{"point": [0, {2}], "normal": [0, -1]}}}}}}}},
    "materials": [
      {{"name": "soil", "type": "LinearElastic", "density": 2650, "youngs_modulus": {3},
       "poisson_ratio": {4}, "porosity": {5}, "k_x": {6}}},
      {{"name": "water", "type": "Newtonian", "density": 1000, "bulk_modulus": {7},
       "dynamic_viscosity": 1e-3}}],
    "particles": [{{"generator": {{"type": "region", "material": ["soil", "water"], "per_cell": 2,
      "region": {{"box": {{"min": [0, 0], "max": [{0}, 1]}}}}}}}}],
    "external_loading_conditions": {{"particle_surface_traction": [
      {{"pset": "top", "dir": "y", "traction": -{12}}}]}},
    "analysis": {{"preset": "lahar", "mpm_scheme": "{8}", "shape_functions": "{9}",
                 "end_time": {10}{11}}}}})",
                     h, c.cells + 2, 1 - 0.5 * h, c.youngs_modulus, poisson, porosity,
                     c.conductivity, bulk_modulus, c.scheme, c.functions, end_time,
                     c.dt > 0 ? fmt::format(", \"dt\": {}", c.dt) : "", c.load);
}

struct Errors {
  double base = 0;    ///< of the lowest particles, over the load
  double column = 0;  ///< largest of all particles
  double energy = 0;  ///< made of nothing, over what the load put in
};

Errors errors_at(const Column& column, double T) {
  const double c_v = consolidation(column.conductivity, column.youngs_modulus);
  Simulation simulation(model_of_text<2>(text_of(column, T / c_v)));
  simulation.run();
  const State state(simulation.frame());
  const HistoryRow row = simulation.history();
  Errors errors{.energy = std::abs(row.balance) / row.external};
  double lowest = 1;
  for (Index p = 0; p < state.size(); ++p) {
    const double z = state.x(p, 1) - state.get("displacement", p, 1);
    const double error = std::abs(state.get("pore_pressure", p) / column.load -
                                  test::terzaghi(state.time() * c_v, 1 - z));
    errors.column = std::max(errors.column, error);
    if (z < lowest) lowest = z, errors.base = error;
  }
  return errors;
}

}  // namespace

TEST_CASE("consolidation: the base follows Terzaghi within 1 % from T = 0.05 to 1") {
  for (const std::string scheme : {"usf", "usl", "musl"})
    for (const std::string functions : {"element", "gimp", "quadratic_spline", "cpdi"})
      for (const double T : {0.05, 0.1, 0.2, 0.5, 1.0}) {
        CAPTURE(scheme);
        CAPTURE(functions);
        CAPTURE(T);
        const Errors errors = errors_at({.scheme = scheme, .functions = functions}, T);
        CHECK(errors.base < 0.01);
        CHECK(errors.energy < (scheme == "usl" ? 0.02 : 0.01));
      }
}

TEST_CASE("consolidation: pressures of all particles converge with the cells") {
  for (const std::string functions : {"element", "quadratic_spline"}) {
    CAPTURE(functions);
    double before = 1;
    for (const int cells : {10, 20, 40}) {
      CAPTURE(cells);
      const double error = errors_at({.functions = functions, .cells = cells}, 0.25).column;
      CHECK(error < 0.65 * before);
      before = error;
    }
    CHECK(before < 0.013);
  }
}

TEST_CASE("consolidation: conductivities from 1e-2 to 1e-10 m/s at one time step") {
  constexpr double dt = 2e-5;
  struct Case {
    double conductivity, youngs_modulus, T;
  };
  // Drained faster than waves pass, soil swings; softer soil does not. Where next to nothing drains
  // in some thousand steps, the water has to go on bearing all of the load.
  const auto steps = [](double k) { return 4000 * dt * consolidation(k, 1e7); };
  for (const Case& c :
       {Case{1e-2, 1e6, 0.2}, Case{1e-3, 1e7, 0.2}, Case{1e-4, 1e7, 0.2}, Case{1e-5, 1e7, 0.2},
        Case{1e-6, 1e7, 0.002}, Case{1e-7, 1e7, steps(1e-7)}, Case{1e-8, 1e7, steps(1e-8)},
        Case{1e-9, 1e7, steps(1e-9)}, Case{1e-10, 1e7, steps(1e-10)}}) {
    CAPTURE(c.conductivity);
    const Errors errors = errors_at(
        {.cells = 10,
         .conductivity = c.conductivity,
         .youngs_modulus = c.youngs_modulus,
         .dt = dt,
         .load = 1e-3 * c.youngs_modulus},  // at 0.01 of it soil gets less permeable by 6 %
        c.T);
    MESSAGE(
        fmt::format("k = {:.0e} m/s, T = {:.2g}: base {:.4f}", c.conductivity, c.T, errors.base));
    // Ten cells start a wave of 4 % of the load, which nothing damps where the water cannot flow.
    CHECK(errors.base < (c.conductivity < 1e-6 ? 0.05 : 0.01));
  }
}
