// Water outside of saturated soil presses on its surface, on grains and water alike: of a
// reservoir, a pond, a well. Its pressure is prescribed at nodes.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "tests/verification/case.h"
#include "tests/within.h"

using namespace lahar;
using namespace lahar::verification;

namespace {

constexpr double gravity = 9.81, water = 1000, porosity = 0.4;  // [m/s^2], [kg/m^3], [-]
constexpr double conductivity = 1e-3;                           // [m/s]
constexpr double outside = 5e4;                                 // [Pa]
constexpr double unit_weight = water * gravity;                 // [N/m^3]
constexpr double buoyant = (1 - porosity) * (2650 - water) * gravity;
constexpr double critical_gradient = buoyant / unit_weight;

struct WetColumn {
  int cells = 10;
  std::string scheme = "musl", functions = "element";
  double safety = 0.4;
  std::string pressures = "";  ///< entries of pressure_constraints; sets are base, middle and top
  std::string function = "";   ///< of time; entries have "math_function_id": 0
  bool closed = false;         ///< the base holds water, too
  double weight = gravity, end = 0.5, modulus = 1e8;
};

/// A column of saturated soil, 1 m high.
State run_column(const WetColumn& of, HistoryRow* last = nullptr) {
  const double h = 1.0 / of.cells;
  Simulation simulation(model_of_text<2>(fmt::format(
      R"({{
    "mesh": {{"structured": {{"cell_size": {0}, "counts": [1, {1}]}},
      "boundary_conditions": {{
        "velocity_constraints": [
          {{"nset": -1, "dir": "x", "velocity": 0}},
          {{"nset": "base", "dir": "y", "phase": "skeleton", "velocity": 0}}{2}],
        "pressure_constraints": [{3}]}}}},
    "sets": {{"nodes": {{
      "base": {{"half_space": {{"point": [0, 0], "normal": [0, 1]}}}},
      "middle": {{"box": {{"min": [0, 0.499], "max": [{0}, 0.501]}}}},
      "top": {{"box": {{"min": [0, 0.999], "max": [{0}, 1.001]}}}}}}}},
    "materials": [
      {{"name": "soil", "type": "LinearElastic", "density": 2650, "youngs_modulus": {13},
       "poisson_ratio": 0, "porosity": {4}, "k_x": {5}}},
      {{"name": "water", "type": "Newtonian", "density": {6}, "bulk_modulus": 1e8,
       "dynamic_viscosity": 1e-3}}],
    "particles": [{{"generator": {{"type": "region", "material": ["soil", "water"], "per_cell": 2,
      "region": {{"box": {{"min": [0, 0], "max": [{0}, 1]}}}}}}}}],
    "external_loading_conditions": {{"gravity": [0, -{7}]}},
    "math_functions": [{8}],
    "analysis": {{"preset": "lahar", "mpm_scheme": "{9}", "shape_functions": "{10}",
                 "end_time": {11}, "time_step": {{"safety": {12}}}}}}})",
      h, of.cells + 3,
      of.closed ? R"(, {"nset": "base", "dir": "y", "phase": "liquid", "velocity": 0})" : "",
      of.pressures, porosity, conductivity, water, of.weight, of.function, of.scheme, of.functions,
      of.end, of.safety, of.modulus)));
  simulation.run();
  if (last) *last = simulation.history();
  return State(simulation.frame());
}

std::string pressure_at(const char* set, double pressure, const char* more = "") {
  return fmt::format(R"({{"nset": "{}", "phase_id": 1, "pressure": {}{}}})", set, pressure, more);
}

/// The largest difference of a field's means in rows of cells from `expected(height)`.
template <class Expected>
double error_of(const State& state, int cells, const char* field, int component,
                Expected expected) {
  double worst = 0;
  for (int k = 0; k < cells; ++k) {
    const auto height = [&](Index p) { return state.x(p, 1) - state.get("displacement", p, 1); };
    const auto in_cell = [&](Index p) { return static_cast<int>(height(p) * cells) == k; };
    const double found =
        mean(state, in_cell, [&](Index p) { return state.get(field, p, component); });
    worst = std::max(worst, std::abs(found - expected((k + 0.5) / cells)));
  }
  return worst;
}

}  // namespace

// The load is on both phases: at last the water bears it all, and the skeleton bears its buoyant
// weight, as with a drained top.
TEST_CASE("water outside: a closed column takes its pressure, and no effective stress from it") {
  const auto check = [&](WetColumn of) {
    of.pressures = pressure_at("top", outside);
    of.closed = true;
    of.modulus = 1e7;
    of.end = 3;
    CAPTURE(of.scheme);
    CAPTURE(of.functions);
    const State state = run_column(of);
    const double pressure = error_of(state, of.cells, "pore_pressure", 0,
                                     [](double y) { return outside + unit_weight * (1 - y); }) /
                            outside;
    const double stress =
        error_of(state, of.cells, "stress", 1, [](double y) { return -buoyant * (1 - y); }) /
        outside;
    MESSAGE(
        fmt::format("{}, {}, {} cells, {} of the stable step: pressure wrong by {:.5f} of that "
                    "outside, effective stress by {:.5f}",
                    of.scheme, of.functions, of.cells, of.safety, pressure, stress));
    CHECK(pressure < 0.01);
    CHECK(stress < 0.01);
  };
  for (const char* functions : {"element", "gimp"})
    for (const char* scheme : {"musl", "usf", "usl"})
      check({.scheme = scheme, .functions = functions});
  check({.safety = 0.2});
  check({.cells = 20});
}

// Darcy: v = k i. The water that flows down presses grains on the base.
TEST_CASE(
    "water outside: a reservoir above a drained base has a linear pressure and Darcy's flow") {
  const auto check = [&](WetColumn of) {
    of.pressures = pressure_at("top", outside) + ", " + pressure_at("base", 0);
    of.weight = 0;
    CAPTURE(of.scheme);
    CAPTURE(of.functions);
    HistoryRow last;
    const State state = run_column(of, &last);
    const double pressure =
        error_of(state, of.cells, "pore_pressure", 0, [](double y) { return outside * y; }) /
        outside;
    const double stress =
        error_of(state, of.cells, "stress", 1, [](double y) { return -outside * (1 - y); }) /
        outside;
    const double darcy = conductivity * outside / unit_weight;
    double flow = 0;
    for (Index p = 0; p < state.size(); ++p) {
      const double relative = state.get("liquid_velocity", p, 1) - state.get("velocity", p, 1);
      flow = std::max(flow, std::abs(-porosity * relative / darcy - 1));
    }
    MESSAGE(
        fmt::format("{}, {}, {} cells, {} of the stable step: pressure wrong by {:.5f}, flow "
                    "{:.5f}, effective stress {:.5f}",
                    of.scheme, of.functions, of.cells, of.safety, pressure, flow, stress));
    CHECK(pressure < 0.01);
    CHECK(flow < 0.01);
    CHECK(stress < 0.01);
    CHECK(std::abs(last.balance) < 0.004 * last.external);
  };
  for (const char* functions : {"element", "gimp"})
    for (const char* scheme : {"musl", "usf", "usl"})
      check({.scheme = scheme, .functions = functions});
  check({.safety = 0.2});
  check({.cells = 20});
}

TEST_CASE("water outside: a pressure that grows with time is followed") {
  const State state =
      run_column({.pressures = pressure_at("top", 5e4, R"(, "math_function_id": 0)"),
                  .function = R"({"id": 0, "type": "Linear",
                                      "xvalues": [0, 0.2], "fxvalues": [0, 1]})",
                  .closed = true,
                  .weight = 0});
  CHECK(error_of(state, 10, "pore_pressure", 0, [](double) { return 5e4; }) < 0.01 * 5e4);
}

TEST_CASE("water inside: a well below a drained top holds its pressure, and its water flows up") {
  const auto error = [](WetColumn of) {
    of.pressures = pressure_at("middle", outside);
    of.closed = true;
    of.weight = 0;
    HistoryRow last;
    const State state = run_column(of, &last);
    const double wrong = error_of(state, of.cells, "pore_pressure", 0,
                                  [](double y) { return outside * std::min(1.0, 2 * (1 - y)); }) /
                         outside;
    MESSAGE(fmt::format("{}, {} cells, {} of the stable step: pressure wrong by {:.5f}",
                        of.functions, of.cells, of.safety, wrong));
    CHECK(std::abs(last.balance) < 0.05 * last.external);
    return wrong;
  };
  const double coarse = error({});
  CHECK(coarse < 0.06);
  CHECK(error({.functions = "gimp"}) < 0.06);
  CHECK(error({.safety = 0.2}) < 0.06);
  CHECK(error({.cells = 20}) < 0.6 * coarse);
}

TEST_CASE("water outside: below the base, the critical gradient takes the weight of the grains") {
  for (const char* functions : {"element", "gimp"}) {
    CAPTURE(functions);
    for (const double share : {0.0, 0.5, 1.0}) {
      const double below = unit_weight * (1 + share * critical_gradient);
      const State state =
          run_column({.functions = functions, .pressures = pressure_at("base", below)});
      const double wrong = error_of(state, 10, "stress", 1,
                                    [&](double y) { return -(1 - share) * buoyant * (1 - y); }) /
                           buoyant;
      MESSAGE(fmt::format("{}, {} of the critical gradient: effective stress wrong by {:.5f}",
                          functions, share, wrong));
      CHECK(wrong < 0.02);
    }
  }
}
