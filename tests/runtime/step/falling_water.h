/// \file Water whose pressure is that of projections.
#pragma once

#include "tests/runtime/step/models.h"

namespace lahar::test {

/// Water in a tank, held by a wall that has gone.
inline Model<2> falling_water(LinearSolver::Method method) {
  Model<2> model = model_of_text<2>(R"({
    "mesh": {"structured": {"cell_size": 0.1, "extent": [2, 1.5]},
             "boundary_conditions": {"velocity_constraints": [
               {"nset": "walls", "dir": "x", "velocity": 0},
               {"nset": "floor", "dir": "y", "velocity": 0}]}},
    "sets": {"nodes": {
      "walls": {"union": [{"half_space": {"point": [0, 0], "normal": [1, 0]}},
                          {"half_space": {"point": [2, 0], "normal": [-1, 0]}}]},
      "floor": {"half_space": {"point": [0, 0], "normal": [0, 1]}}}},
    "materials": [{"type": "Newtonian", "density": 1000, "bulk_modulus": 2e9,
                   "dynamic_viscosity": 1}],
    "particles": [{"generator": {"type": "region", "per_cell": 2, "material": 0,
                                 "region": {"box": {"min": [0, 0], "max": [0.8, 1]}}}}],
    "external_loading_conditions": {"gravity": [0, -10]},
    "analysis": {"mpm_scheme": "projection", "dt": 0.01, "nsteps": 1000, "patch_particles": 24}})");
  model.analysis.linear.method = method;
  return model;
}

}  // namespace lahar::test
