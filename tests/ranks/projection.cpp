// Projections on several ranks and threads, and over a restart: the bits of one rank.
#include <doctest/doctest.h>

#include "tests/ranks/same_checkpoints.h"
#include "tests/runtime/step/falling_water.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// A column of wet soil that a load begins to squeeze.
Model<2> squeezed_soil() {
  return model_of_text<2>(R"({
    "mesh": {"structured": {"cell_size": 0.1, "extent": [1, 1.2]},
             "boundary_conditions": {"velocity_constraints": [
               {"nset": "walls", "dir": "x", "velocity": 0},
               {"nset": "floor", "dir": "y", "velocity": 0}],
               "pressure_constraints": [{"nset": "well", "phase_id": 1, "pressure": 500}]}},
    "sets": {"nodes": {
      "walls": {"union": [{"half_space": {"point": [0, 0], "normal": [1, 0]}},
                          {"half_space": {"point": [1, 0], "normal": [-1, 0]}}]},
      "well": {"box": {"min": [0.5, 0], "max": [0.5, 0.3]}},
      "floor": {"half_space": {"point": [0, 0], "normal": [0, 1]}}}},
    "materials": [
      {"name": "soil", "type": "LinearElastic", "density": 2650, "youngs_modulus": 1e6,
       "poisson_ratio": 0.2, "porosity": 0.4, "k_x": 1e-4},
      {"name": "water", "type": "Newtonian", "density": 1000, "bulk_modulus": 2e9,
       "dynamic_viscosity": 1e-3}],
    "particles": [{"generator": {"type": "region", "per_cell": 2, "material": ["soil", "water"],
                                 "region": {"box": {"min": [0, 0], "max": [1, 1]}}}}],
    "external_loading_conditions": {"gravity": [0, -10]},
    "analysis": {"mpm_scheme": "projection", "dt": 5e-4, "nsteps": 1000, "patch_particles": 24,
                 "scheme_settings": {"beta": 0}}})");
}

/// Saturated soil that flies through cells of all patches.
Model<2> thrown_soil() {
  return model_of_text<2>(R"({
    "mesh": {"structured": {"cell_size": 0.1, "extent": [2, 2]}},
    "materials": [
      {"name": "soil", "type": "LinearElastic", "density": 2650, "youngs_modulus": 1e6,
       "poisson_ratio": 0.2, "porosity": 0.4, "k_x": 1e-4},
      {"name": "water", "type": "Newtonian", "density": 1000, "bulk_modulus": 1e8,
       "dynamic_viscosity": 1e-3}],
    "particles": [{"generator": {"type": "region", "per_cell": 2, "material": ["soil", "water"],
                                 "velocity": [9, -5],
                                 "region": {"sphere": {"centre": [0.6, 1.4], "radius": 0.33}}}}],
    "external_loading_conditions": {"gravity": [0, -10]},
    "analysis": {"mpm_scheme": "projection", "dt": 2e-3, "nsteps": 1000, "patch_particles": 24}})");
}

}  // namespace

TEST_CASE("projections of a fluid with a direct and an iterative solver") {
  for (const auto method : {LinearSolver::Method::direct, LinearSolver::Method::iterative}) {
    CAPTURE(static_cast<int>(method));
    check_same_checkpoints(falling_water(method), 20);
  }
}

TEST_CASE("projections of soil with water in its pores") {
  Model<2> soil = squeezed_soil();
  check_same_checkpoints(soil, 20);
  soil.analysis.projection.kept = 1;
  check_same_checkpoints(soil, 20);
  check_same_checkpoints(thrown_soil(), 40);
}
