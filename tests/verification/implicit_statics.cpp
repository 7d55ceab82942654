// Quasi-static steps: equilibria that are known, and loads that have none.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>
#include <string>

#include "tests/verification/case.h"
#include "tests/within.h"

using namespace lahar;
using namespace lahar::verification;

namespace {

/// A block of 1 x 1 m of cells of 0.25 m on a smooth floor. `sides` hold it, and all nodes of its
/// upper edge go down by `down` in each step if that is not zero.
struct Block {
  std::string functions = "element";
  std::string law = R"("type": "LinearElastic", "youngs_modulus": 1e10, "poisson_ratio": 0.3)";
  double gravity_x = 0, gravity_y = 0;
  bool sides = true;
  double down = 0;  ///< [m]
  int steps = 1;
};

Model<2> model_of(const Block& block) {
  std::string conditions = R"({"nset": "floor", "dir": "y", "velocity": 0})";
  if (block.sides) conditions += R"(, {"nset": -1, "dir": "x", "velocity": 0})";
  std::string moved;
  if (block.down != 0)
    moved = fmt::format(
        R"(, "displacement_constraints": [{{"nset": "top", "dir": "y", "displacement": {}}}])",
        -block.down);
  return model_of_text<2>(fmt::format(
      R"({{"mesh": {{"structured": {{"cell_size": 0.25, "extent": [2, 1.5]}},
                "boundary_conditions": {{"velocity_constraints": [{}]{}}}}},
        "sets": {{"nodes": {{"floor": {{"half_space": {{"point": [0, 0], "normal": [0, 1]}}}},
                           "top": {{"half_space": {{"point": [0, 1], "normal": [0, -1]}}}}}}}},
        "materials": [{{{}, "density": 1000}}],
        "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": 0,
                                     "region": {{"box": {{"max": [1, 1]}}}}}}}}],
        "external_loading_conditions": {{"gravity": [{}, {}]}},
        "analysis": {{"mpm_scheme": "newmark", "shape_functions": "{}", "dt": 1, "nsteps": {},
                     "scheme_settings": {{"quasi_static": true, "displacement_tolerance": 0,
                                         "residual_tolerance": 1e-8,
                                         "relative_residual_tolerance": 1e-12}}}}}})",
      conditions, moved, block.law, block.gravity_x, block.gravity_y, block.functions,
      block.steps));
}

}  // namespace

TEST_CASE("quasi-static: a column carries its weight, after one step and after many") {
  // So stiff that nothing moves. Cells have the stress of their centres, sides K0 of it.
  for (const char* const functions : {"element", "gimp"})
    for (const int steps : {1, 20}) {
      Simulation simulation(model_of({.functions = functions, .gravity_y = -10, .steps = steps}),
                            {.threads = 1});
      simulation.run();
      const State state(simulation.frame());
      for (int row = 0; row < 4; ++row) {
        const double y = 0.25 * (row + 0.5), exact = -1000 * 10 * (1 - y);
        const auto in_row = [&](Index p) { return std::abs(state.x(p, 1) - y) < 0.125; };
        CAPTURE(std::string(functions));
        CAPTURE(steps);
        CAPTURE(row);
        for (int k = 0; k < 3; ++k) {
          const double stress =
              mean(state, in_row, [&](Index p) { return state.get("stress", p, k); });
          CHECK(stress == test::within(1e-5, k == 1 ? exact : 3.0 / 7 * exact));
        }
      }
    }
}

TEST_CASE("quasi-static: prescribed displacements strain a block uniformly") {
  // Neo-Hookean: sigma_yy = (lambda ln J + G (J^2 - 1)) / J, J = 1 - 10 * 0.02.
  const double E = 1e6, nu = 0.3, lambda = E * nu / ((1 + nu) * (1 - 2 * nu)),
               G = E / (2 * (1 + nu));
  Simulation simulation(
      model_of({.law = R"("type": "NeoHookean", "youngs_modulus": 1e6, "poisson_ratio": 0.3)",
                .down = 0.02,
                .steps = 1}),
      {.threads = 1});
  simulation.run();
  const State state(simulation.frame());
  const double J = 0.98;
  for (Index p = 0; p < state.size(); ++p) {
    const double yy = (lambda * std::log(J) + G * (J * J - 1)) / J;
    CHECK(state.get("stress", p, 0) == doctest::Approx(lambda * std::log(J) / J).epsilon(1e-10));
    CHECK(state.get("stress", p, 1) == doctest::Approx(yy).epsilon(1e-10));
    CHECK(std::abs(state.get("stress", p, 3)) < 1e-10 * E);
    CHECK(state.get("volume", p) == doctest::Approx(J / 64).epsilon(1e-10));
  }
  // A smooth block that is free at its sides has plane stress in them: E / (1 - nu^2).
  Simulation other(model_of({.law = R"("type": "LinearElastic", "youngs_modulus": 1e6,
                                       "poisson_ratio": 0.3)",
                             .sides = false,
                             .down = 1e-7}),
                   {.threads = 1});
  other.run();
  const State free(other.frame());
  for (Index p = 0; p < free.size(); ++p) {
    CHECK(free.get("stress", p, 1) == test::within(1e-6, -1e-7 * E / (1 - nu * nu)));
    CHECK(std::abs(free.get("stress", p, 0)) < 1e-6 * 1e-7 * E);
  }
}

TEST_CASE("quasi-static: loads without an equilibrium end the run with a message") {
  // Down a slope without friction; heavier than cohesion bears.
  const char* const soil =
      R"("type": "MohrCoulomb", "youngs_modulus": 1e7, "poisson_ratio": 0.3, "friction": 0,
         "dilation": 0, "cohesion": 500, "tension_cutoff": 100, "softening": false)";
  for (const Block& block : {Block{.gravity_x = 5, .gravity_y = -10, .sides = false},
                             Block{.law = soil, .gravity_y = -10, .sides = false}}) {
    Simulation simulation(model_of(block), {.threads = 1});
    const Frame before = simulation.frame();
    std::string said;
    try {
      simulation.run();
    } catch (const std::exception& error) {
      said = error.what();
    }
    CAPTURE(said);
    CHECK(said.find("no equilibrium found") != std::string::npos);
    CHECK(said.find("at node") != std::string::npos);
    CHECK(simulation.step() == 0);
    CHECK(simulation.frame().coordinates == before.coordinates);  // the last state
  }
}

TEST_CASE(
    "quasi-static: what holds loose motions adds no stiffness to a beam that keeps its volume") {
  constexpr double L = 5, E = 1e6, nu = 0.499, q = 50, bending = E / (1 - nu * nu) / 12;
  const auto tip_over_theory = [&](int steps) {
    Simulation simulation(model_of_text<2>(fmt::format(
        R"({{"mesh": {{"structured": {{"origin": [0, -2], "cell_size": 0.25, "extent": [6, 4]}},
          "boundary_conditions": {{"velocity_constraints": [
            {{"nset": "left", "dir": "x", "velocity": 0}}, {{"nset": "left", "dir": "y", "velocity": 0}}]}}}},
        "sets": {{"nodes": {{"left": {{"half_space": {{"point": [0, 0], "normal": [1, 0]}}}}}}}},
        "materials": [{{"name": "m", "type": "LinearElastic", "density": 1000, "youngs_modulus": {},
                       "poisson_ratio": {}}}],
        "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": "m",
                        "region": {{"box": {{"min": [0, -0.5], "max": [{}, 0.5]}}}}}}}}],
        "external_loading_conditions": {{"gravity": [0, {}]}},
        "analysis": {{"mpm_scheme": "newmark", "shape_functions": "quadratic_spline", "b_bar": true,
          "scheme_settings": {{"quasi_static": true}}, "dt": 1, "nsteps": {}}}}})",
        E, nu, L, -q / 1000, steps)));
    simulation.run();
    const State state(simulation.frame());
    const auto at_tip = [&](Index p) { return state.x(p, 0) > L - 0.125; };
    const double down =
        -mean(state, at_tip, [&](Index p) { return state.get("displacement", p, 1); });
    // Timoshenko's beam, in its middle.
    return down /
           (q * std::pow(L, 4) / (8 * bending) + q * L * L / (2 * 5.0 / 6 * E / (2 * (1 + nu))));
  };
  const double one = tip_over_theory(1), ten = tip_over_theory(10);
  MESSAGE("deflection over theory: ", one, ", in ten steps ", ten);
  CHECK(one == test::within(0.04, 0.96));
  CHECK(ten == test::within(0.01, one));
}
