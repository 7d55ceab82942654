/// \file Models with rigid bodies at rest, in prescribed motion, and free.
#pragma once

#include <string>

#include "tests/runtime/step/models.h"

namespace lahar::test {

/// A heap of small pieces on a bed that cuts the mesh, between a wall that moves and two free
/// discs that fall on it and on each other. `analysis`: keys beside scheme and step.
inline Model<2> heap_and_bodies(const std::string& scheme, const std::string& analysis) {
  return model_of_text<2>(R"({
    "mesh": {"structured": {"cell_size": 0.1, "extent": [4, 2.5]}},
    "materials": [{"type": "LinearElastic", "density": 1500, "youngs_modulus": 2e5,
                   "poisson_ratio": 0.2}],
    "math_functions": [{"type": "Linear", "xvalues": [0, 0.1, 0.2], "fxvalues": [0, 1, 0.5]}],
    "rigid_bodies": [
      {"name": "bed", "region": {"half_space": {"point": [0, 0.83], "normal": [0.1, 1]}},
       "friction": 0.4},
      {"name": "wall", "region": {"box": {"min": [0.5, 0.7], "max": [0.79, 1.6]}},
       "friction": 0.1, "velocity": [1.5, 0], "spin": 0.4, "centre": [0.6, 0.7],
       "math_function_id": 0},
      {"name": "disc", "region": {"sphere": {"centre": [1.7, 1.75], "radius": 0.21}},
       "density": 2000, "velocity": [0.5, -2], "spin": 3, "friction": 0.5},
      {"name": "box", "region": {"box": {"min": [1.5, 2.0], "max": [1.8, 2.2]}},
       "mass": 60, "velocity": [0, -4], "friction": 0.2}],
    "particles": [{"generator": {"type": "region", "per_cell": 2, "material": 0,
                                 "region": {"difference": [
                      {"box": {"min": [0.8, 0.4], "max": [2.4, 1.5]}},
                      {"half_space": {"point": [0, 0.84], "normal": [0.1, 1]}}]}}}],
    "external_loading_conditions": {"gravity": [0, -10]},
    "analysis": {"mpm_scheme": ")" +
                          scheme + R"(", "nsteps": 100, "patch_particles": 64, )" + analysis +
                          "}}");
}

/// A saturated bank on a bed that cuts the mesh, which a wall pushes. `analysis`: keys beside the
/// scheme.
inline Model<2> bank_and_wall(const std::string& analysis) {
  return model_of_text<2>(R"({
    "mesh": {"structured": {"cell_size": 0.1, "extent": [3, 2]},
      "particles_stresses": {"type": "k0", "k0": 0.4},
      "particles_pore_pressures": {"type": "water_table",
                                   "water_tables": [{"position": 0, "h0": 1.2}]}},
    "materials": [
      {"name": "soil", "type": "LinearElastic", "density": 2600, "youngs_modulus": 5e5,
       "poisson_ratio": 0.2, "porosity": 0.4, "k_x": 1e-3},
      {"name": "water", "type": "Newtonian", "density": 1000, "bulk_modulus": 1e6,
       "dynamic_viscosity": 1e-3}],
    "rigid_bodies": [
      {"name": "bed", "region": {"half_space": {"point": [0, 0.63], "normal": [-0.1, 1]}},
       "friction": 0.4},
      {"name": "wall", "region": {"box": {"min": [0.5, 0.3], "max": [0.79, 1.6]}},
       "friction": 0.1, "velocity": [0.5, 0]}],
    "particles": [{"generator": {"type": "region", "per_cell": 2, "material": ["soil", "water"],
                                 "region": {"difference": [
                      {"box": {"min": [0.8, 0.4], "max": [2.4, 1.2]}},
                      {"half_space": {"point": [0, 0.63], "normal": [-0.1, 1]}}]}}}],
    "external_loading_conditions": {"gravity": [0, -10]},
    "analysis": {"mpm_scheme": "musl", "nsteps": 100, "patch_particles": 64, )" +
                          analysis + "}}");
}

}  // namespace lahar::test
