// Both phases of a saturated soil keep their mass while it deforms by far: grains keep their
// volume, and water fills what is left of that of the particle.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tests/verification/case.h"

using namespace lahar;
using namespace lahar::verification;

namespace {

constexpr double grains = 2650, water = 1000, porosity = 0.4, bulk_modulus = 1e8;

/// A block of soft soil, 1 m by 1 m, falls apart in a tank under its weight.
Model<2> falling_apart(double cell, double safety) {
  return model_of_text<2>(fmt::format(
      R"({{
    "mesh": {{"structured": {{"cell_size": {0}, "extent": [4, 1.5]}},
      "boundary_conditions": {{"velocity_constraints": [
        {{"nset": "floor", "dir": "y", "velocity": 0}},
        {{"nset": "walls", "dir": "x", "velocity": 0}}]}}}},
    "sets": {{"nodes": {{
      "floor": {{"half_space": {{"point": [0, 0], "normal": [0, 1]}}}},
      "walls": {{"union": [{{"half_space": {{"point": [0, 0], "normal": [1, 0]}}}},
                           {{"half_space": {{"point": [4, 0], "normal": [-1, 0]}}}}]}}}}}},
    "materials": [
      {{"name": "soil", "type": "MohrCoulomb", "density": {1}, "youngs_modulus": 1e6,
       "poisson_ratio": 0.3, "friction": 10, "dilation": 0, "cohesion": 0, "tension_cutoff": 0,
       "porosity": {2}, "k_x": 1e-2}},
      {{"name": "water", "type": "Newtonian", "density": {3}, "bulk_modulus": {4},
       "dynamic_viscosity": 1e-3}}],
    "particles": [{{"generator": {{"type": "region", "material": ["soil", "water"], "per_cell": 2,
      "region": {{"box": {{"min": [0, 0], "max": [1, 1]}}}}}}}}],
    "external_loading_conditions": {{"gravity": [0, -9.81]}},
    "analysis": {{"preset": "lahar", "end_time": 0.4, "time_step": {{"safety": {5}}}}},
    "post_processing": {{"vtk": ["porosity", "liquid_mass"]}}}})",
      cell, grains, porosity, water, bulk_modulus, safety));
}

/// Of what is rounded in sums over some thousand steps and particles.
constexpr double rounding = 1e-12;

void check_masses(double cell, double safety) {
  CAPTURE(cell);
  CAPTURE(safety);
  Simulation simulation(falling_apart(cell, safety));
  simulation.advance(1);
  const State before(simulation.frame());
  simulation.run();
  const State after(simulation.frame());
  REQUIRE(after.size() == before.size());
  double skeleton = 0, liquid = 0, sheared = 0, swollen = 0;
  for (Index p = 0; p < after.size(); ++p) {
    const double volume = after.get("volume", p), n = after.get("porosity", p);
    CHECK(after.get("mass", p) == before.get("mass", p));
    // What grains and water fill is the particle.
    const double of_grains = after.get("mass", p) / grains;
    const double of_water = after.get("liquid_mass", p) / water;
    CHECK(std::abs((1 - n) * volume / of_grains - 1) < rounding);
    CHECK(std::abs((of_grains + of_water) / volume - 1) < rounding);
    skeleton += after.get("mass", p);
    liquid += after.get("liquid_mass", p);
    sheared = std::max(sheared, std::abs(after.get("strain", p, 3)));
    swollen = std::max(swollen, std::abs(volume / before.get("volume", p) - 1));
  }
  const double expected = (1 - porosity) * grains * 1.0;  // of 1 m^2
  CHECK(skeleton == doctest::Approx(expected).epsilon(rounding));
  CHECK(simulation.history().mass == doctest::Approx(skeleton + liquid).epsilon(rounding));
  MESSAGE(
      fmt::format("shear strain up to {:.2f}, volumes change by up to {:.3f}", sheared, swollen));
  CHECK(sheared > 0.5);
}

}  // namespace

TEST_CASE("grains and water keep their mass while a saturated block falls apart") {
  check_masses(0.1, 0.2);
  check_masses(0.1, 0.1);
  check_masses(0.05, 0.2);
}
