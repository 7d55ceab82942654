// Spellings of published CB-Geo cases, of several years: read, or refused with what to write.
#include <doctest/doctest.h>

#include "tests/io/scenario/broken_case.h"

using namespace lahar::broken;

namespace {

constexpr const char* constraints = R"([{"nset_id": 0, "dir": 1, "velocity": 0.0}])";

}  // namespace

// clang-format off
TEST_CASE("spellings that still say what is meant are read, older ones with a warning") {
  const std::vector<Entry> table = {
    {"constraints as names of files",
     {replace("mpm.json", constraints, R"("v.txt", "friction_constraints": "f.txt")"),
      write("v.txt", "0 1 0.0\n1 1 0.0\n2 1 0.0\n"), write("f.txt", "0\t1\t-1\t0.3\n")},
     {},
     R"(accepted
mpm.json:8:31: warning: the name of a file is the older form of 'velocity_constraints' [/mesh/boundary_conditions/velocity_constraints]
        "velocity_constraints": "v.txt", "friction_constraints": "f.txt"
                                ^
  hint: it is read; CB-Geo MPM has [{"file": ...}] now
mpm.json:8:64: warning: the name of a file is the older form of 'friction_constraints' [/mesh/boundary_conditions/friction_constraints]
        "velocity_constraints": "v.txt", "friction_constraints": "f.txt"
                                                                 ^
  hint: it is read; CB-Geo MPM has [{"file": ...}] now
mpm.json:8:64: warning: two-sided friction, as in CB-Geo MPM, slows what slides by more than the coefficient says, and stiff material by much more [/mesh/boundary_conditions/friction_constraints]
        "velocity_constraints": "v.txt", "friction_constraints": "f.txt"
                                                                 ^
  hint: set "two_sided": false for Coulomb's friction
)"},
    {"a file of constraints that is not there",
     {replace("mpm.json", constraints, R"("v.txt")")},
     {},
     R"(mpm.json:8:31: error: file 'v.txt' does not exist [/mesh/boundary_conditions/velocity_constraints]
        "velocity_constraints": "v.txt"
                                ^
  hint: file names are relative to the scenario's folder
)"},
    {"particles with a set_id",
     {replace("mpm.json", R"("material_id": 0}})", R"("material_id": 0}, "set_id": 0})")},
     {},
     R"(accepted
mpm.json:12:84: warning: 'set_id' is ignored in an entry of particles [/particles/0/set_id]
   {"generator": {"type": "file", "location": "particles.txt", "material_id": 0}, "set_id": 0}
                                                                                  ^
  hint: the reference code ignores it too
)"},
    {"names of state variables as a list",
     {replace("mpm.json", R"("output_steps": 5)", R"("output_steps": 5, "vtk_statevars": ["pdstrain"])")},
     {},
     R"(accepted
mpm.json:20:60: warning: no material has a state variable 'pdstrain' [/post_processing/vtk_statevars/0]
    "post_processing": {"output_steps": 5, "vtk_statevars": ["pdstrain"]}
                                                             ^
)"},
    {"triangles that are not isoparametric",
     {replace("mpm.json", R"("ED2Q4")", R"("ED2T3", "isoparametric": false)"),
      write("mesh.txt", "6 4\n0 0\n1 0\n2 0\n0 1\n1 1\n2 1\n0 1 4\n0 4 3\n1 2 5\n1 5 4\n")},
     {},
     "accepted\n"},
    {"no state variables",
     {replace("mpm.json", R"("output_steps": 5)", R"("output_steps": 5, "vtk": [], "vtk_statevars": [])")},
     {},
     "accepted\n"},
    {"how much is logged",
     {replace("mpm.json", R"("dt": 0.001)", R"("verbosity": 100, "dt": 0.001)")},
     {},
     R"(accepted
mpm.json:19:41: warning: 'verbosity' is ignored in analysis [/analysis/verbosity]
    "analysis": {"type": "MPMExplicit2D", "verbosity": 100, "dt": 0.001, "nsteps": 10},
                                          ^
  hint: the reference code ignores it too
)"},
    {"damping by its documented name",
     {replace("mpm.json", R"("dt": 0.001)", R"("damping": {"type": "Cundall", "damping_ratio": 0.05}, "dt": 0.001)")},
     {},
     R"(accepted
mpm.json:19:89: warning: 'damping_ratio' is read as 'damping_factor' [/analysis/damping/damping_ratio]
  sis": {"type": "MPMExplicit2D", "damping": {"type": "Cundall", "damping_ratio": 0.05}, "dt": 0.001, "nsteps": 10},
                                                                                  ^
  hint: CB-Geo MPM, whose documentation has it, ignores this key and damps nothing; --as-cbgeo does the same
)"},
    {"damping without a factor",
     {replace("mpm.json", R"("dt": 0.001)", R"("damping": {"type": "Cundall"}, "dt": 0.001)")},
     {},
     R"(mpm.json:19:52: error: 'damping_factor' is missing in analysis.damping [/analysis/damping]
    "analysis": {"type": "MPMExplicit2D", "damping": {"type": "Cundall"}, "dt": 0.001, "nsteps": 10},
                                                     ^
  hint: damping_factor: share of the unbalanced force [-], or rate of "Viscous" damping [1/s]
)"},
    {"cells of particles by their documented name, and forces that are no list",
     {replace("mpm.json", R"("cell_type")", R"("particles_cells": "c.txt", "cell_type")"),
      replace("mpm.json", R"("gravity")", R"("concentrated_nodal_forces": {"file": "f.txt"}, "gravity")"),
      replace("mpm.json", R"("analysis")", R"("math_functions": [{"id": 0, "type": "Linear", "file": "m.csv"}],
     "analysis")"),
      write("c.txt", "0 0\n"), write("f.txt", "0 0 1.5\n"), write("m.csv", "0.0,0.0\t\n0.5,1.0\t\n")},
     {},
     "accepted\n"},
    {"functions of time in bad files",
     {replace("mpm.json", R"("analysis")", R"("math_functions": [{"type": "Linear", "file": "m.csv"},
     {"type": "Linear", "file": "n.csv", "xvalues": [0]}, {"type": "Linear", "xvalues": [0]}],
     "analysis")"),
      write("m.csv", "0.0,0.0\n0.0,1.0\n1,x\n"), write("n.csv", "# nothing\n")},
     {},
     R"(mpm.json:20:53: error: 'xvalues' does not go together with 'file' [/math_functions/1/xvalues]
       {"type": "Linear", "file": "n.csv", "xvalues": [0]}, {"type": "Linear", "xvalues": [0]}],
                                                      ^
  hint: the file has a time and a value in each row
mpm.json:20:59: error: 'fxvalues' is missing in a math function [/math_functions/2]
       {"type": "Linear", "file": "n.csv", "xvalues": [0]}, {"type": "Linear", "xvalues": [0]}],
                                                            ^
  hint: give xvalues [s] and fxvalues, or a file
m.csv:2:5: error: times must be ascending, found 0 after 0
  0.0 1.0
      ^
m.csv:3:3: error: the value must be a finite number, found 'x'
  1 x
    ^
n.csv: error: the file holds no data
  hint: rows are: time value
)"},
  };
  check(table, 11);
}

TEST_CASE("keys that the reference no longer reads are refused with where they have gone") {
  const std::vector<Entry> table = {
    {"files named at the top",
     {replace("mpm.json", R"("title": "Broken",)", R"("title": "Broken", "input_files": {"mesh": "mesh.txt"},)"),
      replace("mpm.json", R"("cell_type": "ED2Q4",)", R"("cell_type": "ED2Q4", "mesh_reader": "Ascii2D", "material_id": 0,)")},
     {},
     R"(mpm.json:2:22: error: 'input_files' in the scenario is of an older format, which CB-Geo MPM does not read any more [/input_files]
    "title": "Broken", "input_files": {"mesh": "mesh.txt"},
                       ^
  hint: name files where they belong: mesh.mesh, mesh.particles_volumes, "file" in entries of mesh.boundary_conditions and external_loading_conditions, and "location" in particles[].generator of type "file"
mpm.json:6:27: error: 'mesh_reader' in mesh is of an older format, which CB-Geo MPM does not read any more [/mesh/mesh_reader]
      "cell_type": "ED2Q4", "mesh_reader": "Ascii2D", "material_id": 0,
                            ^
  hint: write io_type
mpm.json:6:53: error: 'material_id' in mesh is of an older format, which CB-Geo MPM does not read any more [/mesh/material_id]
      "cell_type": "ED2Q4", "mesh_reader": "Ascii2D", "material_id": 0,
                                                      ^
  hint: write it in particles[].generator
)"},
    {"gravity in the analysis",
     {replace("mpm.json", R"("dt": 0.001)", R"("gravity": [0, -9.81], "dt": 0.001)")},
     {},
     R"(mpm.json:19:41: error: 'gravity' in analysis is of an older format, which CB-Geo MPM does not read any more [/analysis/gravity]
    "analysis": {"type": "MPMExplicit2D", "gravity": [0, -9.81], "dt": 0.001, "nsteps": 10},
                                          ^
  hint: write external_loading_conditions.gravity
)"},
    {"the viscosity of a Newtonian fluid",
     {replace("mpm.json", R"("LinearElastic2D", "density": 1000,
     "youngs_modulus": 1e6, "poisson_ratio": 0.3)", R"("Newtonian2D", "density": 1000,
     "bulk_modulus": 1e6, "mu": 0.5)")},
     {},
     R"(mpm.json:15:5: error: 'dynamic_viscosity' is missing in a material [/materials/0]
      {"id": 0, "type": "Newtonian2D", "density": 1000,
      ^
  hint: dynamic_viscosity [Pa s]: viscosity
mpm.json:16:27: error: 'mu' in a material is of an older format, which CB-Geo MPM does not read any more [/materials/0/mu]
       "bulk_modulus": 1e6, "mu": 0.5}
                            ^
  hint: write dynamic_viscosity
)"},
    {"particles generated in all cells",
     {replace("mpm.json", R"("cell_type": "ED2Q4",)", R"("cell_type": "ED2Q4", "generate_particles_cells": 2,)")},
     {},
     R"(mpm.json:6:27: error: 'generate_particles_cells' in mesh is of an older format, which CB-Geo MPM does not read any more [/mesh/generate_particles_cells]
      "cell_type": "ED2Q4", "generate_particles_cells": 2,
                            ^
  hint: write a particles[].generator of type "gauss" with "cset_id": -1 and this number as nparticles_per_dir
)"},
    {"absorbing boundaries",
     {replace("mpm.json", constraints, std::string(constraints) + R"(,
      "absorbing_constraints": [{"nset_id": 0, "dir": 1, "delta": 0.1, "h_min": 0.001, "a": 1, "b": 1}])")},
     {},
     R"(mpm.json:9:33: error: 'position' is missing in an absorbing constraint [/mesh/boundary_conditions/absorbing_constraints/0]
        "absorbing_constraints": [{"nset_id": 0, "dir": 1, "delta": 0.1, "h_min": 0.001, "a": 1, "b": 1}]
                                  ^
  hint: position: position of the nodes on the boundary, which gives their area. 2D: h_min on an edge, half of it at the ends of an edge (corner). 3D: h_min^2 inside a face, half of it at the edges of a face, a quarter at its corners
)"},
    {"strengths of Mohr-Coulomb by their older names",
     {replace("mpm.json", R"("LinearElastic2D", "density": 1000,
     "youngs_modulus": 1e6, "poisson_ratio": 0.3)", R"("MohrCoulomb2D", "density": 1000,
     "youngs_modulus": 1e6, "poisson_ratio": 0.3, "friction": 0, "dilation_angle": 0, "cohesion": 1,
     "tension_cutoff": 0, "peak_epds": 1)")},
     {},
     R"(mpm.json:15:5: error: 'dilation' is missing in a material [/materials/0]
      {"id": 0, "type": "MohrCoulomb2D", "density": 1000,
      ^
  hint: dilation [degrees]: dilation angle
mpm.json:16:66: error: 'dilation_angle' in a material is of an older format, which CB-Geo MPM does not read any more [/materials/0/dilation_angle]
       "youngs_modulus": 1e6, "poisson_ratio": 0.3, "friction": 0, "dilation_angle": 0, "cohesion": 1,
                                                                   ^
  hint: write dilation
mpm.json:17:27: error: 'peak_epds' in a material is of an older format, which CB-Geo MPM does not read any more [/materials/0/peak_epds]
       "tension_cutoff": 0, "peak_epds": 1}
                            ^
  hint: write peak_pdstrain, and "softening": true
)"},
  };
  check(table, 6);
}
// clang-format on
