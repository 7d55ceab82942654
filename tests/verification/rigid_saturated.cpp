// Saturated soil on rigid bodies that cut the mesh: grains and water are held along the normal, no
// water goes through, and friction takes the effective stress.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "tests/verification/case.h"
#include "tests/within.h"

using namespace lahar;
using namespace lahar::verification;

namespace {

constexpr double grains = 2650, water = 1000, porosity = 0.4;  // densities [kg/m^3]
constexpr double g = 9.81;
constexpr double buoyant = (1 - porosity) * (grains - water) * g;               // [N/m^3]
constexpr double saturated = ((1 - porosity) * grains + porosity * water) * g;  // [N/m^3]
constexpr double skeleton = 1e8 * 0.8 / (1.2 * 0.6), pores = 1e8 / porosity;    // [Pa] moduli

std::string materials(double conductivity) {
  return fmt::format(
      R"([{{"name": "soil", "type": "LinearElastic", "density": {}, "youngs_modulus": 1e8,
            "poisson_ratio": 0.2, "porosity": {}, "k_x": {}}},
          {{"name": "water", "type": "Newtonian", "density": {}, "bulk_modulus": 1e8,
            "dynamic_viscosity": 1e-3}}])",
      grains, porosity, conductivity, water);
}

/// The stresses that soil with its surface at y = `top` has at rest.
std::string at_rest(double top) {
  return fmt::format(R"("particles_stresses": {{"type": "k0", "k0": 0.25}},
    "particles_pore_pressures": {{"type": "water_table",
                                 "water_tables": [{{"position": 0, "h0": {}}}]}})",
                     top);
}

std::string half_space(double x, double y, double normal_x, double normal_y) {
  return fmt::format(R"({{"half_space": {{"point": [{}, {}], "normal": [{}, {}]}}}})", x, y,
                     normal_x, normal_y);
}

/// A column of 2 m on a floor at y = `level`, in cells of 0.1 m.
struct Floor {
  double level;
  std::string functions = "quadratic_spline";
  double end_time = 0.3;
};

/// What differs from hydrostatic pressure and buoyant weight, over those at the base; mean
/// settlement of the water [m]; force on the floor over the weight; what energy does not close by,
/// over what is stored.
struct Rest {
  double pressure = 0, stress = 0, settlement, force, balance;
};
Rest rest(const Floor& floor) {
  constexpr double height = 2, width = 0.2, conductivity = 1e-3;
  const double top = floor.level + height;
  Simulation simulation(model_by_default<2>(fmt::format(
      R"({{
    "mesh": {{"structured": {{"origin": [0, -0.5], "cell_size": 0.1, "extent": [{0}, 3.2]}},
      "boundary_conditions": {{"velocity_constraints": [
        {{"nset": "sides", "dir": "x", "velocity": 0}}]}}, {1}}},
    "sets": {{"nodes": {{"sides": {{"union": [{2}, {3}]}}}}}},
    "materials": {4},
    "rigid_bodies": [{{"name": "floor", "region": {5}, "friction": 0.3}}],
    "particles": [{{"generator": {{"type": "region", "material": ["soil", "water"], "per_cell": 2,
      "region": {{"box": {{"min": [0, {6}], "max": [{0}, {7}]}}}}}}}}],
    "external_loading_conditions": {{"gravity": [0, -{8}]}},
    "analysis": {{"shape_functions": "{9}",
                 "end_time": {10}}}}})",
      width, at_rest(top), half_space(0, 0, 1, 0), half_space(width, 0, -1, 0),
      materials(conductivity), half_space(0, floor.level, 0, 1), floor.level, top, g,
      floor.functions, floor.end_time)));
  simulation.run();
  const State state(simulation.frame());
  Rest found;
  for (Index p = 0; p < state.size(); ++p) {
    const double depth = top - state.x(p, 1);
    const auto wrong = [&](double value, double weight) {
      return std::abs(value - weight * depth) / (weight * height);
    };
    found.pressure = std::max(found.pressure, wrong(state.get("pore_pressure", p), water * g));
    found.stress = std::max(found.stress, wrong(-state.get("stress", p, 1), buoyant));
  }
  const HistoryRow end = simulation.history();
  const double area = width * height, pressure = water * g * height, stress = buoyant * height;
  found.settlement = std::abs(end.external) / (porosity * water * area * g);
  found.force = -end.bodies[0].force[1] / (saturated * area);
  found.balance =
      end.balance / (area / 6 * (pressure * pressure / pores + stress * stress / skeleton));
  return found;
}

/// A saturated block of 3 x 0.5 m on a plane.
struct Block {
  double degrees, conductivity;
  bool is_body;          ///< in a level grid; else the plane is nodes of a grid along it
  bool at_rest = false;  ///< it begins with the stresses of rest, and 1 m/s; else with none
  double level = 0;      ///< [m] of the plane above a line of nodes, without a slope
};

/// Friction over that of all weight [-], and what energy does not close by, over that of friction.
struct Slide {
  double friction, balance;
};
Slide slide(const Block& block) {
  constexpr double coefficient = 0.2, length = 3, height = 0.5, pi = 3.14159265358979323846;
  const double angle = block.degrees * pi / 180, s = std::sin(angle), c = std::cos(angle);
  const double turned = block.is_body ? angle : 0;
  const std::array<double, 2> along{std::cos(turned), -std::sin(turned)},
      up{std::sin(turned), std::cos(turned)};
  const double x = 0.53, y = 0.5 + block.level + 4.5 * std::sin(turned);
  const auto place = [&](double a, double b) {
    return fmt::format("[{}, {}]", x + a * along[0] + b * up[0], y + a * along[1] + b * up[1]);
  };
  const std::string plane = half_space(x, y, up[0], up[1]);
  const std::string weight =
      block.is_body ? fmt::format("[0, -{}]", g) : fmt::format("[{}, -{}]", g * s, g * c);
  const std::string gravity =
      block.at_rest ? weight : fmt::format(R"({{"gravity": {}, "ramping_time": 0.05}})", weight);
  const std::string speed =
      block.at_rest ? fmt::format(R"("velocity": [{}, {}], )", along[0], along[1]) : "";
  const std::string contact =
      block.is_body ? fmt::format(R"("rigid_bodies": [{{"region": {}, "friction": {}}}],)", plane,
                                  coefficient)
                    : fmt::format(R"("sets": {{"nodes": {{"plane": {}}}}},)", plane);
  const std::string walls =
      block.is_body ? ""
                    : fmt::format(R"(, "boundary_conditions": {{"walls": [{{"nset": "plane",
                        "normal": [0, 1], "friction": {}}}]}})",
                                  coefficient);
  Simulation simulation(model_by_default<2>(fmt::format(
      R"({{
    "mesh": {{"structured": {{"cell_size": 0.1, "extent": [5.4, 4]}}{0}{1}}},
    "materials": {2}, {3}
    "particles": [{{"generator": {{"type": "region", "material": ["soil", "water"], "per_cell": 2,
      {4}"region": {{"polygon": {{"points": [{5}, {6}, {7}, {8}]}}}}}}}}],
    "external_loading_conditions": {{"gravity": {9}}},
    "analysis": {{"end_time": 0.3}}}})",
      walls, block.at_rest ? ", " + at_rest(y + height) : "", materials(block.conductivity),
      contact, speed, place(0, 0), place(length, 0), place(length, height), place(0, height),
      gravity)));
  const auto momentum = [&] {
    const HistoryRow row = simulation.history();
    return (row.momentum[0] * along[0] + row.momentum[1] * along[1]) / row.mass;
  };
  while (simulation.time() < 0.15) simulation.advance(1);
  const double time = simulation.time(), before = momentum();
  simulation.run();
  const double acceleration = (momentum() - before) / (simulation.time() - time);
  const HistoryRow end = simulation.history();
  return {(g * s - acceleration) / (coefficient * g * c), end.balance / end.friction};
}

}  // namespace

TEST_CASE("saturated soil is at rest on a rigid floor, wherever it cuts the cells") {
  for (const double level : {0.0, 0.03, 0.0499, 0.05, 0.06, 0.08}) {
    CAPTURE(level);
    const Rest found = rest({.level = level});
    MESSAGE(fmt::format(
        "floor at {} m: pore pressure wrong by {:.4f} of that at the base, "
        "effective stress {:.4f}; water moved by {:.1e} m, force {:.4f}, "
        "balance {:.4f}",
        level, found.pressure, found.stress, found.settlement, found.force, found.balance));
    CHECK(found.pressure < 0.02);
    CHECK(found.stress < 0.04);
    CHECK(found.settlement < 1e-5);
    CHECK(found.force == test::within(0.01, 1));
    CHECK(std::abs(found.balance) < 0.01);
  }
}

TEST_CASE("saturated soil is at rest on a rigid floor with other functions") {
  for (const Floor& floor :
       {Floor{.level = 0, .functions = "element"}, Floor{.level = 0.03, .functions = "gimp"}}) {
    CAPTURE(floor.functions);
    const Rest found = rest(floor);
    CHECK(found.pressure < 0.015);
    CHECK(found.stress < 0.02);
    CHECK(found.force == test::within(0.01, 1));
  }
}

// A leak of a thousandth of the conductivity would lower the base's pressure by as much.
TEST_CASE("no water goes through a rigid floor") {
  const Rest found = rest({.level = 0.03, .end_time = 1.5});
  CHECK(found.pressure < 0.02);
  CHECK(found.settlement < 1e-5);
}

// The water's pressure falls by some per cent at the base of the block, which adds to friction.
TEST_CASE("a saturated block slides on a rigid plane as on a wall of nodes") {
  constexpr double effective = buoyant / saturated;
  for (const double degrees : {10, 20, 30})
    for (const double conductivity : {1e-2, 1e-5}) {
      CAPTURE(degrees);
      const Slide body = slide({.degrees = degrees, .conductivity = conductivity, .is_body = true}),
                  wall =
                      slide({.degrees = degrees, .conductivity = conductivity, .is_body = false});
      MESSAGE(
          fmt::format("{} degrees, k = {} m/s: friction {:.3f} of that of the buoyant weight, "
                      "{:.3f} on a wall; balance {:.1e}",
                      degrees, conductivity, body.friction / effective, wall.friction / effective,
                      body.balance));
      CHECK(body.friction == test::within(0.04, wall.friction));
      CHECK(body.friction > 0.95 * effective);
      CHECK(body.friction < 1.25 * effective);
      CHECK(std::abs(body.balance) < 1e-3);
    }
}

TEST_CASE("soil that does not drain rubs on a rigid plane by the stresses with which it begins") {
  for (const double level : {0.0, 0.03}) {
    CAPTURE(level);
    const Slide found = slide(
        {.degrees = 0, .conductivity = 1e-9, .is_body = true, .at_rest = true, .level = level});
    MESSAGE(fmt::format("floor at {} m: {:.3f}", level, found.friction * saturated / buoyant));
    CHECK(found.friction > 0.9 * buoyant / saturated);
    CHECK(found.friction < 1.25 * buoyant / saturated);
  }
}

TEST_CASE("a rigid body that moves presses saturated soil that does not drain by both moduli") {
  // A floor of a closed column rises by 1 mm.
  Simulation simulation(model_by_default<2>(fmt::format(
      R"({{
    "mesh": {{"structured": {{"origin": [0, -0.5], "cell_size": 0.1, "extent": [0.2, 2.5]}},
      "boundary_conditions": {{"velocity_constraints": [
        {{"nset": "sides", "dir": "x", "velocity": 0}}, {{"nset": "top", "dir": "y", "velocity": 0}}
      ]}}}},
    "sets": {{"nodes": {{"sides": {{"union": [{}, {}]}}, "top": {}}}}},
    "materials": {},
    "math_functions": [{{"type": "Linear", "xvalues": [0, 0.05, 0.1, 1],
                        "fxvalues": [0, 1, 0, 0]}}],
    "rigid_bodies": [{{"name": "piston", "velocity": [0, 0.02], "math_function_id": 0,
                      "region": {{"box": {{"min": [-1, -0.4], "max": [1, 0.03]}}}}}}],
    "particles": [{{"generator": {{"type": "region", "material": ["soil", "water"], "per_cell": 2,
      "region": {{"box": {{"min": [0, 0.03], "max": [0.2, 2]}}}}}}}}],
    "analysis": {{"end_time": 0.2}}}})",
      half_space(0, 0, 1, 0), half_space(0.2, 0, -1, 0), half_space(0, 2, 0, -1),
      materials(1e-9))));
  simulation.run();
  const HistoryRow end = simulation.history();
  const double strain = 1e-3 / 1.97, force = -end.bodies[0].force[1],
               expected = strain * (skeleton + pores) * 0.2;
  MESSAGE(fmt::format("force {:.1f} N of {:.1f}, balance {:.2e} of {:.2e} J", force, expected,
                      end.balance, end.external));
  CHECK(force == test::within(0.05, expected));
  CHECK(std::abs(end.balance) < 0.02 * end.external);
}
