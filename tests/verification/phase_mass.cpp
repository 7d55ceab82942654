// Both phases of a saturated soil keep their mass while it deforms by far: grains keep their
// volume, water fills what is left of that of the particle, and what cannot leave is compressed.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "tests/verification/case.h"

using namespace lahar;
using namespace lahar::verification;

namespace {

constexpr double grains = 2650, water = 1000, porosity = 0.4, bulk_modulus = 1e8;

/// A block of soft soil, 1 m by 1 m, falls apart in a tank under its weight.
Model<2> falling_apart(double cell, double safety, double conductivity) {
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
       "porosity": {2}, "k_x": {6}}},
      {{"name": "water", "type": "Newtonian", "density": {3}, "bulk_modulus": {4},
       "dynamic_viscosity": 1e-3}}],
    "particles": [{{"generator": {{"type": "region", "material": ["soil", "water"], "per_cell": 2,
      "region": {{"box": {{"min": [0, 0], "max": [1, 1]}}}}}}}}],
    "external_loading_conditions": {{"gravity": [0, -9.81]}},
    "analysis": {{"preset": "lahar", "end_time": 0.4, "time_step": {{"safety": {5}}}}},
    "post_processing": {{"vtk": ["porosity", "liquid_mass"]}}}})",
      cell, grains, porosity, water, bulk_modulus, safety, conductivity));
}

/// Of what is rounded in sums over some thousand steps and particles.
constexpr double rounding = 1e-12;

/// Density of the water at a pressure [Pa], over that at none.
double density_at(double pressure) {
  return std::exp(pressure / bulk_modulus);
}

void check_masses(double cell, double safety, double conductivity) {
  CAPTURE(cell);
  CAPTURE(safety);
  CAPTURE(conductivity);
  Simulation simulation(falling_apart(cell, safety, conductivity));
  const double whole = simulation.history().mass;
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
    const double of_water =
        after.get("liquid_mass", p) / (water * density_at(after.get("pore_pressure", p)));
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
  const double change = simulation.history().mass / whole - 1;
  MESSAGE(fmt::format("cells of {} m, k = {} m/s: the mass changes by {:.2g}", cell, conductivity,
                      change));
  CHECK(sheared > 0.5);
  // Nothing passes a surface at 1e-9 m/s in this time. Particles have volumes of their own, but a
  // pressure with their cell: what they lose by that.
  if (conductivity < 1e-8) CHECK(std::abs(change) < 1e-5);
}

struct Column {
  std::string scheme = "musl";
  double modulus = bulk_modulus;  ///< [Pa] of the water
  double safety = 0.4;
  double conductivity = 1e-12;  ///< [m/s]
};

/// A column of 1 m under a load that grows to 1 MPa.
Model<2> undrained(const Column& column) {
  return model_by_default<2>(fmt::format(
      R"({{
    "mesh": {{"structured": {{"cell_size": 0.1, "counts": [1, 12]}},
      "boundary_conditions": {{"velocity_constraints": [
        {{"nset": -1, "dir": "x", "velocity": 0}},
        {{"nset": "base", "dir": "y", "velocity": 0}}]}}}},
    "sets": {{"nodes": {{"base": {{"half_space": {{"point": [0, 0], "normal": [0, 1]}}}}}},
             "particles": {{"top": {{"half_space": {{"point": [0, 0.95], "normal": [0, -1]}}}}}}}},
    "materials": [
      {{"name": "soil", "type": "LinearElastic", "density": {}, "youngs_modulus": 1e6,
       "poisson_ratio": 0.2, "porosity": {}, "k_x": {}}},
      {{"name": "water", "type": "Newtonian", "density": {}, "bulk_modulus": {},
       "dynamic_viscosity": 1e-3}}],
    "particles": [{{"generator": {{"type": "region", "material": ["soil", "water"], "per_cell": 2,
      "region": {{"box": {{"min": [0, 0], "max": [0.1, 1]}}}}}}}}],
    "external_loading_conditions": {{"particle_surface_traction": [
      {{"pset": "top", "dir": "y", "traction": -1e6, "math_function_id": 0}}]}},
    "math_functions": [{{"id": 0, "type": "Linear", "xvalues": [0, 0.2], "fxvalues": [0, 1]}}],
    "analysis": {{"mpm_scheme": "{}", "shape_functions": "element", "end_time": 0.3,
                 "time_step": {{"safety": {}}}}},
    "post_processing": {{"vtk": ["liquid_mass"]}}}})",
      grains, porosity, column.conductivity, water, column.modulus, column.scheme, column.safety));
}

/// By how much the mass of the water has changed, as a share: all of it, and most of a particle.
struct Change {
  double all = 0, most = 0;
};

Change change_in(const Column& column) {
  Simulation simulation(undrained(column));
  const State before(simulation.frame());
  const double whole = simulation.history().mass;
  simulation.run();
  const State after(simulation.frame());
  double from = 0, to = 0, pressure = 0;
  Change change;
  for (Index p = 0; p < after.size(); ++p) {
    const double was = before.get("liquid_mass", p), is = after.get("liquid_mass", p);
    from += was, to += is;
    pressure += after.get("pore_pressure", p) / static_cast<double>(after.size());
    change.most = std::max(change.most, std::abs(is / was - 1));
  }
  change.all = to / from - 1;
  MESSAGE(
      fmt::format("{}, K = {:.0e} Pa, {} of the step, k = {} m/s: pressure {:.3g} Pa, mass "
                  "{:.2g}, of a particle {:.2g}",
                  column.scheme, column.modulus, column.safety, column.conductivity, pressure,
                  change.all, change.most));
  CHECK(pressure > 0.9e6);
  CHECK(pressure < 1.05e6);
  CHECK(std::abs(simulation.history().mass - whole - (to - from)) < rounding * whole);
  return change;
}

}  // namespace

TEST_CASE("grains and water keep their mass while a saturated block falls apart") {
  for (const double conductivity : {1e-2, 1e-9}) {
    check_masses(0.1, 0.2, conductivity);
    check_masses(0.1, 0.1, conductivity);
    check_masses(0.05, 0.2, conductivity);
  }
}

TEST_CASE("water that cannot leave keeps its mass while a load compresses it") {
  // At 1 MPa it takes 1 % less room. What Darcy's law lets out of the uppermost cell is 1e-9 of it,
  // and less with the conductivity. Schemes that strain by velocities of particles let some water
  // pass from cell to cell.
  for (const std::string scheme : {"usl", "musl"})
    for (const double safety : {0.4, 0.2}) {
      const Change change = change_in({.scheme = scheme, .safety = safety});
      CHECK(std::abs(change.all) < 2e-9);
      CHECK(change.most < 5e-8);
    }
  CHECK(std::abs(change_in({.scheme = "usl", .conductivity = 1e-13}).all) < 2e-10);
  // With a tenth of the modulus the column becomes 4 % shorter, and particles change cells. Then
  // those of a cell have porosities of their own, but changes of the pressure in common.
  CHECK(std::abs(change_in({.modulus = 0.1 * bulk_modulus}).all) < 5e-6);
}
