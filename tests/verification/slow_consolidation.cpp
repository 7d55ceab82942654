// Water in the pores of a soil: one-dimensional consolidation (Terzaghi 1923), by every scheme and
// shape function, on finer cells, and for conductivities that differ by orders of magnitude at one
// time step.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "tests/terzaghi.h"
#include "tests/verification/case.h"

using namespace lahar;
using namespace lahar::verification;

namespace {

constexpr double porosity = 0.4, poisson = 0.2, bulk_modulus = 2.2e9;

double oedometric(double youngs_modulus) {
  return youngs_modulus * (1 - poisson) / ((1 + poisson) * (1 - 2 * poisson));
}

/// c_v [m^2/s] with the water's compressibility.
double consolidation(double conductivity, double youngs_modulus) {
  return conductivity / 9810 / (1 / oedometric(youngs_modulus) + porosity / bulk_modulus);
}

struct SoilColumn {
  std::string scheme = "musl", functions = "element";
  int cells = 20;
  double conductivity = 1e-3, youngs_modulus = 1e7;
  double dt = 0;      ///< [s]; 0 = adaptive
  double load = 1e4;  ///< [Pa]
  /// [s] in which the load grows. 0 = it is there from the beginning, and the water bears it.
  double ramp = 0;
};

/// Where a load that grows has grown to after k pieces of its time. It begins and ends smoothly, so
/// that it starts no wave.
constexpr int pieces = 20;
double grown(int k) {
  return 0.5 - 0.5 * std::cos(std::numbers::pi * k / pieces);
}

std::string growth(double ramp) {
  std::string times, values;
  for (int k = 0; k <= pieces; ++k) {
    times += fmt::format("{}{}", k ? ", " : "", k * ramp / pieces);
    values += fmt::format("{}{}", k ? ", " : "", grown(k));
  }
  return fmt::format(R"({{"id": 0, "type": "Linear", "xvalues": [{}], "fxvalues": [{}]}})", times,
                     values);
}

std::string text_of(const SoilColumn& c, double end_time) {
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
      {{"pset": "top", "dir": "y", "traction": -{13}{14}}}]}},
    "math_functions": [{15}],
    "analysis": {{"preset": "lahar", "mpm_scheme": "{8}", "shape_functions": "{9}",
                 "end_time": {10}{11}}}}})",
                     h, c.cells + 2, 1 - 0.5 * h, c.youngs_modulus, poisson, porosity,
                     c.conductivity, bulk_modulus, c.scheme, c.functions, end_time,
                     c.dt > 0 ? fmt::format(", \"dt\": {}", c.dt) : "", c.ramp > 0 ? 0 : c.load,
                     c.load, c.ramp > 0 ? R"(, "math_function_id": 0)" : "",
                     c.ramp > 0 ? growth(c.ramp) : "");
}

struct Errors {
  double base = 0;    ///< of the lowest particles, over the load
  double column = 0;  ///< largest of all particles
  double energy = 0;  ///< made of nothing, over what the load put in
};

Errors errors_at(const SoilColumn& column, double T) {
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

/// Over what the water bears of the load without drainage.
struct RampErrors {
  double T, base, middle;
};

/// At T = 0.05, 0.1, 0.2, 0.5 and 1, as far as these are below `last`, and there.
std::vector<RampErrors> errors_until(const SoilColumn& column, double last) {
  const double c_v = consolidation(column.conductivity, column.youngs_modulus);
  const double share =
      1 / (1 + porosity * oedometric(column.youngs_modulus) / bulk_modulus) * column.load;
  Simulation simulation(model_of_text<2>(text_of(column, last / c_v)));
  std::vector<RampErrors> all;
  for (const double T : {0.05, 0.1, 0.2, 0.5, 1.0, last}) {
    if (T > last || (!all.empty() && T <= all.back().T)) continue;
    simulation.advance(std::lround((T / c_v - simulation.time()) / column.dt));
    const State state(simulation.frame());
    // Each piece of the load consolidates from its own time on.
    const auto exact = [&](double depth) {
      double sum = 0;
      for (int k = 0; k < pieces; ++k) {
        const double since = state.time() - (k + 0.5) * column.ramp / pieces;
        if (since > 0) sum += (grown(k + 1) - grown(k)) * test::terzaghi(since * c_v, depth);
      }
      return sum;
    };
    const auto found = [&](double from, double to) {
      return mean(
          state,
          [&](Index p) {
            const double y = state.x(p, 1) - state.get("displacement", p, 1);
            return y > from && y < to;
          },
          [&](Index p) { return state.get("pore_pressure", p) / share; });
    };
    const double h = 1.0 / column.cells;
    all.push_back({T, found(0, 0.5 * h) - exact(1), found(0.5 - h, 0.5 + h) - exact(0.5)});
  }
  return all;
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
    double conductivity, youngs_modulus;
    double T;  ///< that is reached
  };
  // Stiffer soil is drained faster. Where that is faster than waves pass, it swings: soft soil does
  // not. So T = 1 is reached in a hundred thousand steps down to 1e-5 m/s. Below, not even rock
  // drains faster, as the water's own compressibility rules: 1e-6 m/s take half a million steps.
  // What drains in a million or a hundred thousand is looked at from there on: with 1e-8 m/s and
  // less, water has to go on bearing its share of the load.
  for (const Case& c :
       {Case{1e-2, 4e5, 1}, Case{1e-3, 1e7, 1}, Case{1e-4, 1e8, 1}, Case{1e-5, 1e9, 1},
        Case{1e-6, 1e9, 1}, Case{1e-7, 1e9, 0.2}, Case{1e-8, 1e9, 0.0019}, Case{1e-9, 1e9, 1.9e-4},
        Case{1e-10, 1e9, 1.9e-5}}) {
    const SoilColumn column{
        .cells = 10,
        .conductivity = c.conductivity,
        .youngs_modulus = c.youngs_modulus,
        .dt = dt,
        .load = 1e-3 * c.youngs_modulus,  // at 0.01 it gets less permeable by 6 %
        .ramp = 0.02};
    CAPTURE(c.conductivity);
    for (const RampErrors& errors : errors_until(column, c.T)) {
      MESSAGE(fmt::format("k = {:.0e} m/s, T = {:.2g}: base {:+.4f}, middle {:+.4f}",
                          c.conductivity, errors.T, errors.base, errors.middle));
      CAPTURE(errors.T);
      CHECK(std::abs(errors.base) < 0.01);
      CHECK(std::abs(errors.middle) < 0.01);
    }
  }
}
