// Tractions on a row of particles act at its surface: a column under a load has its stress in all
// rows, and one under a pond the pond's pressure at all depths.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tests/verification/case.h"
#include "tests/within.h"

using namespace lahar;
using namespace lahar::verification;

namespace {

/// A column of 1 m; its two particles per cell and direction begin at quarters of cells.
std::string column(const std::string& materials, const std::string& material,
                   const std::string& loads, const std::string& analysis) {
  return fmt::format(R"({{
    "mesh": {{"structured": {{"cell_size": 0.1, "counts": [1, 12]}},
      "boundary_conditions": {{"velocity_constraints": [
        {{"nset": -1, "dir": "x", "velocity": 0}}, {{"nset": "base", "dir": "y", "velocity": 0}}]}}}},
    "sets": {{"nodes": {{"base": {{"half_space": {{"point": [0, 0], "normal": [0, 1]}}}}}},
             "particles": {{"top": {{"half_space": {{"point": [0, 0.95], "normal": [0, -1]}}}}}}}},
    "materials": [{}],
    "particles": [{{"generator": {{"type": "region", "material": {}, "per_cell": 2,
      "region": {{"box": {{"min": [0, 0], "max": [0.1, 1]}}}}}}}}],
    "external_loading_conditions": {{{}}},
    "analysis": {{"preset": "lahar", {}}}}})",
                     materials, material, loads, analysis);
}

const char* const elastic =
    R"({"name": "soil", "type": "LinearElastic", "density": 2650, "youngs_modulus": 1e8,
        "poisson_ratio": 0.2, "porosity": 0.4, "k_x": 1e-3})";
const char* const water =
    R"({"name": "water", "type": "Newtonian", "density": 1000, "bulk_modulus": 1e9,
        "dynamic_viscosity": 1e-3})";

constexpr double applied = 1e5;  // [Pa]

/// The largest error of the stress of a row.
double error_of_stress(const std::string& functions, const std::string& scheme) {
  const std::string text =
      column(elastic, "\"soil\"",
             fmt::format(R"("particle_surface_traction": [{{"pset": "top", "dir": "y",
                            "traction": {}}}])",
                         -applied),
             fmt::format(R"("shape_functions": "{}", {})", functions, scheme));
  Simulation simulation(model_of_text<2>(text));
  simulation.run();
  const State state(simulation.frame());
  double error = 0;
  for (Index p = 0; p < state.size(); ++p)
    error = std::max(error, std::abs(state.get("stress", p, 1) / -applied - 1));
  MESSAGE(functions, ": error of the stress ", error);
  return error;
}

}  // namespace

TEST_CASE("tractions: all rows of a column have the stress of the load on its top") {
  const std::string quasi_static =
      R"("mpm_scheme": "newmark", "scheme_settings": {"quasi_static": true}, "dt": 0.1, "nsteps": 1)";
  CHECK(error_of_stress("element", quasi_static) < 1e-6);
  CHECK(error_of_stress("gimp", quasi_static) < 1e-6);
  CHECK(error_of_stress("quadratic_spline", quasi_static) < 1e-6);
  CHECK(error_of_stress("cubic_spline", quasi_static) < 1e-6);
}

// A load at the centres of the last particles was not in balance with the stress that bears it: the
// particles at the end were torn off at 5 % with 80 cells, at 15 % with 20. Stress / E = ln(1 + u).
TEST_CASE("tractions: a bar that is pulled becomes as long as it should, and is not torn") {
  struct Bar {
    const char *functions, *update;
    double cell, stress;
  };
  for (const Bar& bar :
       {Bar{"quadratic_spline", "apic", 0.05, 0.1}, Bar{"quadratic_spline", "apic", 0.025, 0.1},
        Bar{"quadratic_spline", "flip", 0.05, 0.1}, Bar{"cubic_spline", "apic", 0.05, 0.1},
        Bar{"gimp", "flip", 0.05, 0.1}, Bar{"cpdi", "flip", 0.05, 0.1}}) {
    CAPTURE(bar.functions);
    CAPTURE(bar.cell);
    constexpr double E = 1e6;
    Simulation simulation(model_by_default<2>(fmt::format(
        R"({{
        "mesh": {{"structured": {{"cell_size": {0}, "extent": [1.6, 0.6]}},
          "boundary_conditions": {{"velocity_constraints": [
            {{"nset": "left", "dir": "x", "velocity": 0}}]}}}},
        "sets": {{"nodes": {{"left": {{"half_space": {{"point": [0, 0], "normal": [1, 0]}}}}}},
          "particles": {{"tip": {{"box": {{"min": [{1}, 0], "max": [1, 1]}}}}}}}},
        "materials": [{{"name": "m", "type": "LinearElastic", "density": 1000,
          "youngs_modulus": {2}, "poisson_ratio": 0}}],
        "particles": [{{"generator": {{"type": "region", "material": "m", "per_cell": 2,
          "region": {{"box": {{"min": [0, 0.2], "max": [1, 0.4]}}}}}}}}],
        "math_functions": [{{"name": "ramp", "type": "Linear", "xvalues": [0, 0.5],
          "fxvalues": [0, 1]}}],
        "external_loading_conditions": {{"particle_surface_traction": [
          {{"pset": "tip", "dir": "x", "traction": {3}, "math_function_id": "ramp"}}]}},
        "analysis": {{"shape_functions": "{4}", "velocity_update": "{5}", "end_time": 1,
          "damping": {{"type": "Cundall", "damping_factor": 0.6}}}}}})",
        bar.cell, 1 - bar.cell / 2, E, bar.stress * E, bar.functions, bar.update)));
    simulation.run();
    const State end(simulation.frame());
    double tip = 0;
    for (Index p = 0; p < end.size(); ++p) tip = std::max(tip, end.x(p, 0));
    const double length = tip / (1 - bar.cell / 4);
    const HistoryRow row = simulation.history();
    MESSAGE(bar.functions, ", cell ", bar.cell, ": ", length, ", balance ",
            row.balance / row.external);
    CHECK(std::abs(length / std::exp(bar.stress) - 1) < 0.006);
    CHECK(std::abs(row.balance) < 0.01 * row.external);
  }
}

TEST_CASE(
    "tractions: the load is that of the surface, in cells of any shape and where they are cut") {
  struct Column {
    double width, height;  ///< of cells [m]
    double top;            ///< of the column [m]
    const char* law;
    double load;  ///< [Pa]
  };
  const char* const stiff = R"("type": "LinearElastic", "youngs_modulus": 1e9)";
  const char* const rubber = R"("type": "NeoHookean", "youngs_modulus": 1e5)";
  for (const Column& c :
       {Column{0.1, 0.1, 1.0, stiff, -1e5}, Column{0.2, 0.1, 1.0, stiff, -1e5},
        Column{0.05, 0.1, 1.0, stiff, -1e5}, Column{0.1, 0.1, 0.968, stiff, -1e5},
        Column{0.1, 0.1, 0.985, stiff, -1e5}, Column{0.1, 0.1, 1.0, rubber, 2e4}}) {
    CAPTURE(c.width);
    CAPTURE(c.top);
    CAPTURE(c.law);
    Simulation simulation(model_of_text<2>(fmt::format(
        R"({{"mesh": {{"structured": {{"cell_size": [{0}, {1}], "counts": [1, 16]}},
          "boundary_conditions": {{"velocity_constraints": [
            {{"nset": -1, "dir": "x", "velocity": 0}}, {{"nset": "base", "dir": "y", "velocity": 0}}]}}}},
        "sets": {{"nodes": {{"base": {{"half_space": {{"point": [0, 0], "normal": [0, 1]}}}}}},
                 "particles": {{"top": {{"half_space": {{"point": [0, 0.95], "normal": [0, -1]}}}}}}}},
        "materials": [{{{3}, "name": "m", "density": 1000, "poisson_ratio": 0}}],
        "particles": [{{"generator": {{"type": "region", "material": "m", "per_cell": 2,
          "cut_cells": "exact", "region": {{"box": {{"min": [0, 0], "max": [{0}, {2}]}}}}}}}}],
        "external_loading_conditions": {{"particle_surface_traction": [
          {{"pset": "top", "dir": "y", "traction": {4}}}]}},
        "analysis": {{"preset": "lahar", "mpm_scheme": "newmark", "shape_functions": "element",
          "scheme_settings": {{"quasi_static": true}}, "dt": 0.1, "nsteps": 1}}}})",
        c.width, c.height, c.top, c.law, c.load)));
    simulation.run();
    const State state(simulation.frame());
    // Above the first cell nothing but the load is pulled or pushed by it.
    const auto low = [&](Index p) { return state.x(p, 1) < c.height; };
    const double stress = mean(state, low, [&](Index p) { return state.get("stress", p, 1); });
    CHECK(stress == test::within(1e-6, c.load));
  }
}

TEST_CASE("tractions: along a surface they act on its area, not on that across them") {
  // A block of cells that are twice as long as high is sheared by its upper side.
  Simulation simulation(model_of_text<2>(R"({
    "mesh": {"structured": {"cell_size": [0.2, 0.1], "counts": [7, 6]},
      "boundary_conditions": {"velocity_constraints": [
        {"nset": "base", "dir": "x", "velocity": 0}, {"nset": "base", "dir": "y", "velocity": 0}]}},
    "sets": {"nodes": {"base": {"half_space": {"point": [0, 0], "normal": [0, 1]}}},
             "particles": {"top": {"half_space": {"point": [0, 0.45], "normal": [0, -1]}}}},
    "materials": [{"name": "m", "type": "LinearElastic", "density": 1000, "youngs_modulus": 1e9,
                   "poisson_ratio": 0.2}],
    "particles": [{"generator": {"type": "region", "material": "m", "per_cell": 2,
      "region": {"box": {"min": [0.2, 0], "max": [1.2, 0.5]}}}}],
    "external_loading_conditions": {"particle_surface_traction": [
      {"pset": "top", "dir": "x", "traction": 1000}]},
    "analysis": {"preset": "lahar", "mpm_scheme": "newmark", "shape_functions": "element",
      "scheme_settings": {"quasi_static": true}, "dt": 0.1, "nsteps": 1}})"));
  simulation.run();
  const State state(simulation.frame());
  const auto low = [&](Index p) { return state.x(p, 1) < 0.1; };  // the cells on the base
  const double stress = mean(state, low, [&](Index p) { return state.get("stress", p, 3); });
  CHECK(stress == test::within(1e-6, 1000));
}

TEST_CASE("tractions: their work is the energy of the column that they shake") {
  for (const char* functions : {"element", "gimp", "cpdi", "quadratic_spline"}) {
    CAPTURE(functions);
    const auto drift = [&](double safety) {  // over the work
      Simulation simulation(model_of_text<2>(column(
          elastic, "\"soil\"",
          fmt::format(R"("particle_surface_traction": [{{"pset": "top", "dir": "y",
                         "traction": {}}}])",
                      -applied),
          fmt::format(R"("shape_functions": "{}", "mpm_scheme": "musl", "velocity_update": "flip",
                         "time_step": {{"safety": {}}}, "end_time": 0.02)",
                      functions, safety))));
      simulation.run();
      const HistoryRow row = simulation.history();
      CHECK(row.external > 0);
      return std::abs(row.balance) / row.external;
    };
    const double whole = drift(0.4), half = drift(0.2), quarter = drift(0.1);
    MESSAGE(functions, ": ", whole, ", with half the step ", half, ", a quarter ", quarter);
    CHECK(whole < 0.1);
    CHECK(quarter < 0.5 * whole);
    CHECK(quarter < 0.025);
  }
}

// Strains are those of velocities that particles give to nodes again. The work was that of others:
// it was 89 J for a strain energy of 38 J.
TEST_CASE("forces at nodes do the work that a block which they press has as energy") {
  for (const char* functions : {"element", "gimp", "quadratic_spline", "cubic_spline"}) {
    CAPTURE(functions);
    Simulation simulation(model_by_default<2>(fmt::format(
        R"({{
        "mesh": {{"structured": {{"cell_size": 0.05, "extent": [0.8, 0.8]}},
          "boundary_conditions": {{"velocity_constraints": [
            {{"nset": "floor", "dir": "y", "velocity": 0}},
            {{"nset": "left", "dir": "x", "velocity": 0}}]}}}},
        "sets": {{"nodes": {{
          "floor": {{"half_space": {{"point": [0, 0], "normal": [0, 1]}}}},
          "left": {{"half_space": {{"point": [0, 0], "normal": [1, 0]}}}},
          "top": {{"box": {{"min": [-0.01, 0.39], "max": [0.41, 0.41]}}}}}}}},
        "materials": [{{"name": "m", "type": "NeoHookean", "density": 1000,
          "youngs_modulus": 1e6, "poisson_ratio": 0}}],
        "particles": [{{"generator": {{"type": "region", "material": "m", "per_cell": 2,
          "region": {{"box": {{"min": [0, 0], "max": [0.4, 0.4]}}}}}}}}],
        "math_functions": [{{"name": "ramp", "type": "Linear", "xvalues": [0, 0.5],
          "fxvalues": [0, 1]}}],
        "external_loading_conditions": {{"concentrated_nodal_forces": [
          {{"nset": "top", "dir": "y", "force": -888.9, "math_function_id": "ramp"}}]}},
        "analysis": {{"shape_functions": "{}", "end_time": 0.6,
          "damping": {{"type": "Cundall", "damping_factor": 0.3}}}}}})",
        functions)));
    simulation.run();
    const HistoryRow row = simulation.history();
    MESSAGE(functions, ": balance ", row.balance / row.external);
    CHECK(std::abs(row.balance) < 0.01 * row.external);
  }
}

TEST_CASE("tractions: water below a pond has the pond's pressure and its own at all depths") {
  constexpr double pond = 49050, weight = 9810, buoyant = 0.6 * 1650 * 9.81;  // [Pa], [N/m^3]
  const std::string loads = fmt::format(
      R"("gravity": {{"gravity": [0, -9.81], "ramping_time": 0.1}},
         "particle_surface_traction": [
           {{"pset": "top", "dir": "y", "traction": {}}},
           {{"pset": "top", "dir": "y", "phase": "liquid", "traction": {}}}])",
      -pond, -0.4 * pond);
  for (const char* functions : {"element", "gimp"}) {
    CAPTURE(functions);
    Simulation simulation(model_of_text<2>(
        column(std::string(elastic) + ", " + water, R"(["soil", "water"])", loads,
               fmt::format(R"("shape_functions": "{}", "mpm_scheme": "musl", "end_time": 0.6,
                              "velocity_update": "flip",
                              "velocity_update_settings": {{"relaxation": 0.05}})",
                           functions))));
    simulation.run();
    const State state(simulation.frame());
    for (int cell = 0; cell < 8; ++cell) {
      CAPTURE(cell);
      const auto inside = [&](Index p) {
        return std::abs(state.x(p, 1) - 0.1 * cell - 0.05) < 0.05;
      };
      const double depth = 1 - mean(state, inside, [&](Index p) { return state.x(p, 1); });
      const double p = mean(state, inside, [&](Index q) { return state.get("pore_pressure", q); });
      const double s = mean(state, inside, [&](Index q) { return state.get("stress", q, 1); });
      constexpr double most = 0.005;
      CHECK(std::abs(p - pond - weight * depth) < most * pond);
      CHECK(std::abs(-s - buoyant * depth) < most * pond);
    }
  }
}
