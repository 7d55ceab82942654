#include <doctest/doctest.h>

#include "tests/io/scenario/broken_case.h"

using namespace lahar::broken;

// clang-format off
TEST_CASE("bad keys and values are refused with what is allowed") {
  const std::vector<Entry> table = {
    {"a misspelt key",
     {replace("mpm.json", "\"nsteps\"", "\"nstep\"")},
     {},
     R"(mpm.json:19:54: error: unknown key 'nstep' in analysis [/analysis/nstep]
    "analysis": {"type": "MPMExplicit2D", "dt": 0.001, "nstep": 10},
                                                       ^
  hint: did you mean 'nsteps'?
)"},
    {"an unknown key",
     {replace("mpm.json", "\"title\": \"Broken\",", "\"title\": \"Broken\", \"colour\": 1,")},
     {},
     R"(mpm.json:2:22: error: unknown key 'colour' in the scenario [/colour]
    "title": "Broken", "colour": 1,
                       ^
  hint: known keys: title, mesh, geometry, sets, particles, materials, rigid_bodies, material_sets, external_loading_conditions, math_functions, analysis, post_processing, stages, at_start
)"},
    {"misspelt keys in three places",
     {replace("mpm.json", "\"youngs_modulus\"", "\"young_modulus\""),
      replace("mpm.json", "\"gravity\"", "\"gravitiy\""),
      replace("mpm.json", "\"nset_id\"", "\"nsetid\"")},
     {},
     R"(mpm.json:8:33: error: unknown key 'nsetid' in a velocity constraint [/mesh/boundary_conditions/velocity_constraints/0/nsetid]
        "velocity_constraints": [{"nsetid": 0, "dir": 1, "velocity": 0.0}]
                                  ^
  hint: did you mean 'nset_id'?
mpm.json:16:6: error: unknown key 'young_modulus' in a material [/materials/0/young_modulus]
       "young_modulus": 1e6, "poisson_ratio": 0.3}
       ^
  hint: did you mean 'youngs_modulus'?
mpm.json:18:35: error: unknown key 'gravitiy' in external_loading_conditions [/external_loading_conditions/gravitiy]
    "external_loading_conditions": {"gravitiy": [0, -9.81]},
                                    ^
  hint: did you mean 'gravity'?
)"},
    {"no materials",
     {replace("mpm.json", "\"materials\"", "\"material\"")},
     {},
     R"(mpm.json:14:3: error: unknown key 'material' in the scenario [/material]
    "material": [
    ^
  hint: did you mean 'materials'?
)"},
    {"an empty list of materials",
     {replace("mpm.json", R"([
    {"id": 0, "type": "LinearElastic2D", "density": 1000,
     "youngs_modulus": 1e6, "poisson_ratio": 0.3}
  ])", "[]")},
     {},
     R"(mpm.json:14:16: error: there are no materials [/materials]
    "materials": [],
                 ^
  hint: give at least one material: its type, density and parameters
)"},
    {"no time step",
     {replace("mpm.json", "\"dt\": 0.001, ", "")},
     {},
     R"(mpm.json:19:15: error: 'dt' is missing in analysis [/analysis]
    "analysis": {"type": "MPMExplicit2D", "nsteps": 10},
                ^
  hint: dt [s]: the time step; or "time_step": {"adaptive": true}
)"},
    {"no duration",
     {replace("mpm.json", ", \"nsteps\": 10", "")},
     {},
     R"(mpm.json:19:15: error: 'nsteps' is missing in analysis [/analysis]
    "analysis": {"type": "MPMExplicit2D", "dt": 0.001},
                ^
  hint: nsteps: the number of steps; or end_time [s]
)"},
    {"no mesh",
     {replace("mpm.json", "\"mesh\": \"mesh.txt\",", "")},
     {},
     R"(mpm.json:3:11: error: there is no mesh [/mesh]
    "mesh": {
            ^
  hint: give a mesh file ("mesh": "mesh.txt") or a grid ("structured": {...})
)"},
    {"no density",
     {replace("mpm.json", " \"density\": 1000,", "")},
     {},
     R"(mpm.json:15:5: error: 'density' is missing in a material [/materials/0]
      {"id": 0, "type": "LinearElastic2D",
      ^
  hint: density [kg/m^3]: initial density
)"},
    {"a text in place of a number",
     {replace("mpm.json", "\"dt\": 0.001", "\"dt\": \"0.001\"")},
     {},
     R"(mpm.json:19:47: error: 'dt' must be a number [s], found text "0.001" [/analysis/dt]
    "analysis": {"type": "MPMExplicit2D", "dt": "0.001", "nsteps": 10},
                                                ^
)"},
    {"a number in place of a text",
     {replace("mpm.json", "\"Broken\"", "7")},
     {},
     R"(mpm.json:2:12: error: 'title' must be a text, found number 7 [/title]
    "title": 7,
             ^
)"},
    {"a fraction of a step",
     {replace("mpm.json", "\"nsteps\": 10", "\"nsteps\": 10.5")},
     {},
     R"(mpm.json:19:64: error: 'nsteps' must be an integer, found number 10.5 [/analysis/nsteps]
    "analysis": {"type": "MPMExplicit2D", "dt": 0.001, "nsteps": 10.5},
                                                                 ^
)"},
    {"null",
     {replace("mpm.json", "\"nsteps\": 10", "\"nsteps\": null")},
     {},
     R"(mpm.json:19:64: error: 'nsteps' must be an integer, found null [/analysis/nsteps]
    "analysis": {"type": "MPMExplicit2D", "dt": 0.001, "nsteps": null},
                                                                 ^
)"},
    {"an object in place of a list",
     {replace("mpm.json", "\"velocity_constraints\": [{\"nset_id\": 0, \"dir\": 1, \"velocity\": 0.0}]", "\"velocity_constraints\": {\"nset_id\": 0}")},
     {},
     R"(mpm.json:8:31: error: 'velocity_constraints' must be a file name or an array of objects, found an object [/mesh/boundary_conditions/velocity_constraints]
        "velocity_constraints": {"nset_id": 0}
                                ^
)"},
    {"a vector of three in two dimensions",
     {replace("mpm.json", "\"gravity\": [0, -9.81]", "\"gravity\": [0, -9.81, 0]")},
     {},
     R"(mpm.json:18:46: error: 'gravity' must be an array of numbers (2) [m/s^2] or an object, found array [0, -9.81, 0] [/external_loading_conditions/gravity]
    "external_loading_conditions": {"gravity": [0, -9.81, 0]},
                                               ^
  hint: the case has two dimensions, y is up: [0, -9.81]
)"},
    {"a vector with a text",
     {replace("mpm.json", "\"gravity\": [0, -9.81]", "\"gravity\": [0, \"down\"]")},
     {},
     R"(mpm.json:18:46: error: 'gravity' must be an array of numbers (2) [m/s^2] or an object, found array [0, "down"] [/external_loading_conditions/gravity]
    "external_loading_conditions": {"gravity": [0, "down"]},
                                               ^
)"},
    {"a negative time step",
     {replace("mpm.json", "\"dt\": 0.001", "\"dt\": -0.001")},
     {},
     R"(mpm.json:19:47: error: 'dt' must be greater than 0 [s], found -0.001 [/analysis/dt]
    "analysis": {"type": "MPMExplicit2D", "dt": -0.001, "nsteps": 10},
                                                ^
)"},
    {"a negative number of steps",
     {replace("mpm.json", "\"nsteps\": 10", "\"nsteps\": -10")},
     {},
     R"(mpm.json:19:64: error: 'nsteps' must be at least 0, found -10 [/analysis/nsteps]
    "analysis": {"type": "MPMExplicit2D", "dt": 0.001, "nsteps": -10},
                                                                 ^
)"},
    {"too many steps",
     {replace("mpm.json", "\"nsteps\": 10", "\"nsteps\": 1e17")},
     {},
     R"(mpm.json:19:64: error: 'nsteps' must be at least 0 and at most 9000000000000000, found 1e+17 [/analysis/nsteps]
    "analysis": {"type": "MPMExplicit2D", "dt": 0.001, "nsteps": 1e17},
                                                                 ^
)"},
    {"Poisson's ratio of one half",
     {replace("mpm.json", "\"poisson_ratio\": 0.3", "\"poisson_ratio\": 0.5")},
     {},
     R"(mpm.json:16:46: error: 'poisson_ratio' must be greater than -1 and less than 0.5, found 0.5 [/materials/0/poisson_ratio]
       "youngs_modulus": 1e6, "poisson_ratio": 0.5}
                                               ^
  hint: no volume changes then, and the bulk modulus is infinite: take 0.49 and "b_bar": true in analysis
)"},
    {"no density to speak of",
     {replace("mpm.json", "\"density\": 1000", "\"density\": 0")},
     {},
     R"(mpm.json:15:53: error: 'density' must be greater than 0 [kg/m^3], found 0 [/materials/0/density]
      {"id": 0, "type": "LinearElastic2D", "density": 0,
                                                      ^
)"},
    {"a misspelt scheme",
     {replace("mpm.json", "\"dt\"", "\"mpm_scheme\": \"ufs\", \"dt\"")},
     {},
     R"(mpm.json:19:55: error: 'mpm_scheme' must be one of "usf", "usl", "musl", "newmark", "projection", found "ufs" [/analysis/mpm_scheme]
    "analysis": {"type": "MPMExplicit2D", "mpm_scheme": "ufs", "dt": 0.001, "nsteps": 10},
                                                        ^
  hint: did you mean "usf"?
)"},
    {"an unknown material",
     {replace("mpm.json", "LinearElastic2D", "LinearPlastic2D")},
     {},
     R"(mpm.json:15:23: error: 'type' must be one of "LinearElastic", "Newtonian", "Bingham", "MohrCoulomb", "ModifiedCamClay", "NorSand", "DruckerPrager", "VonMises", "NeoHookean", found "LinearPlastic2D" [/materials/0/type]
      {"id": 0, "type": "LinearPlastic2D", "density": 1000,
                        ^
  hint: did you mean "LinearElastic"?
)"},
    {"an unknown element",
     {replace("mpm.json", "ED2Q4", "ED2Q5")},
     {},
     R"(mpm.json:6:18: error: 'cell_type' must be one of "ED2T3", "ED2T6", "ED2Q4", "ED2Q8", "ED2Q9", "ED3T4", "ED3H8", "ED3H20", "ED3H27", "ED2Q16G", "ED3H64G", "ED2Q4P2B", "ED3H8P2B", found "ED2Q5" [/mesh/cell_type]
      "cell_type": "ED2Q5",
                   ^
  hint: did you mean "ED2Q4"?
)"},
    {"a parameter of another material",
     {replace("mpm.json", "\"density\": 1000,", "\"density\": 1000, \"cohesion\": 1,")},
     {},
     R"(mpm.json:15:59: error: 'cohesion' does not apply to a material of type "LinearElastic" [/materials/0/cohesion]
      {"id": 0, "type": "LinearElastic2D", "density": 1000, "cohesion": 1,
                                                            ^
  hint: it belongs to "MohrCoulomb", "DruckerPrager"
)"},
    {"a 3D material in a 2D case",
     {replace("mpm.json", "LinearElastic2D", "LinearElastic3D")},
     {},
     R"(mpm.json:15:23: error: "LinearElastic3D" is 3D, but analysis.type "MPMExplicit2D" says that the case is 2D [/materials/0/type]
      {"id": 0, "type": "LinearElastic3D", "density": 1000,
                        ^
)"},
    {"an element of the other dimension",
     {replace("mpm.json", "ED2Q4", "ED3H8")},
     {},
     R"(mpm.json:6:18: error: "ED3H8" is 3D, but analysis.type "MPMExplicit2D" says that the case is 2D [/mesh/cell_type]
      "cell_type": "ED3H8",
                   ^
)"},
    {"a direction out of the plane",
     {replace("mpm.json", "\"dir\": 1", "\"dir\": 2")},
     {},
     R"(mpm.json:8:54: error: 'dir' must be below 2 in two dimensions, found 2 [/mesh/boundary_conditions/velocity_constraints/0/dir]
        "velocity_constraints": [{"nset_id": 0, "dir": 2, "velocity": 0.0}]
                                                       ^
)"},
    {"a direction that is none",
     {replace("mpm.json", "\"dir\": 1", "\"dir\": \"up\"")},
     {},
     R"(mpm.json:8:54: error: 'dir' must be 0, 1, 2, "x", "y" or "z", found text "up" [/mesh/boundary_conditions/velocity_constraints/0/dir]
        "velocity_constraints": [{"nset_id": 0, "dir": "up", "velocity": 0.0}]
                                                       ^
)"},
    {"nothing tells the dimension",
     {write("mpm.json", R"({"title": "x"}
)")},
     {},
     R"(mpm.json:1:1: error: nothing says whether the case is 2D or 3D
  {"title": "x"}
  ^
  hint: mesh.cell_type says it, such as "ED2Q4" or "ED3H8"
)"},
    {"too much damping",
     {replace("mpm.json", "\"dt\"", "\"damping\": {\"type\": \"Cundall\", \"damping_factor\": 1.5}, \"dt\"")},
     {},
     R"(mpm.json:19:90: error: 'damping_factor' must be at least 0 and at most 1, found 1.5 [/analysis/damping/damping_factor]
  is": {"type": "MPMExplicit2D", "damping": {"type": "Cundall", "damping_factor": 1.5}, "dt": 0.001, "nsteps": 10},
                                                                                  ^
  hint: "type": "Cundall" takes this share of the unbalanced force
)"},
    {"a negative rate of damping",
     {replace("mpm.json", "\"dt\"", "\"damping\": {\"type\": \"Viscous\", \"damping_factor\": -3}, \"dt\"")},
     {},
     R"(mpm.json:19:90: error: 'damping_factor' must be at least 0, found -3 [/analysis/damping/damping_factor]
  is": {"type": "MPMExplicit2D", "damping": {"type": "Viscous", "damping_factor": -3}, "dt": 0.001, "nsteps": 10},
                                                                                  ^
)"},
    {"a blending ratio for PIC",
     {replace("mpm.json", "\"dt\"", "\"velocity_update\": true, \"velocity_update_settings\": {\"blending_ratio\": 0.9}, \"dt\"")},
     {},
     R"(mpm.json:19:94: error: 'velocity_update_settings' does not apply to PIC [/analysis/velocity_update_settings]
   {"type": "MPMExplicit2D", "velocity_update": true, "velocity_update_settings": {"blending_ratio": 0.9}, "dt": 0.001, "nsteps": 10},
                                                                                  ^
  hint: set velocity_update to "flip" to blend
)"},
    {"separation without particles that come apart",
     {replace("mpm.json", "\"dt\"", "\"velocity_update\": \"apic\", \"velocity_update_settings\": {\"separation\": 1}, \"dt\"")},
     {},
     R"(mpm.json:19:111: error: 'separation' does not apply to "apic": its particles move with the nodes [/analysis/velocity_update_settings/separation]
  licit2D", "velocity_update": "apic", "velocity_update_settings": {"separation": 1}, "dt": 0.001, "nsteps": 10},
                                                                                  ^
  hint: leave it out, or set velocity_update to "asflip"
)"},
    {"a viscosity of affine velocities",
     {replace("mpm.json", "\"dt\"", "\"velocity_update\": \"asflip\", \"velocity_update_settings\": {\"viscosity\": 1}, \"dt\"")},
     {},
     R"(mpm.json:19:112: error: 'viscosity' does not go together with "asflip": nodes have the gradients of its affine field, and what it takes is not that of a viscosity [/analysis/velocity_update_settings/viscosity]
  icit2D", "velocity_update": "asflip", "velocity_update_settings": {"viscosity": 1}, "dt": 0.001, "nsteps": 10},
                                                                                  ^
  hint: give 'relaxation' or 'relaxation_time'
)"},
    {"a viscosity beside a filter that takes nothing",
     {replace("mpm.json", "\"dt\"", "\"velocity_update\": \"flip\", \"velocity_update_settings\": {\"viscosity\": 1, \"order\": 3}, \"dt\"")},
     {},
     R"(mpm.json:19:110: error: 'viscosity' alone leaves nothing to a filter of order 3 [/analysis/velocity_update_settings/viscosity]
  plicit2D", "velocity_update": "flip", "velocity_update_settings": {"viscosity": 1, "order": 3}, "dt": 0.001, "nsteps": 10},
                                                                                  ^
  hint: give 'relaxation' as well, which is what the filter takes, or order 1
)"},
    {"a viscosity by pressure without a filter",
     {replace("mpm.json", "\"dt\"", "\"velocity_update\": \"flip\", \"velocity_update_settings\": {\"relaxation\": 0.03, \"viscosity_length\": 1}, \"dt\"")},
     {},
     R"(mpm.json:19:137: error: 'viscosity_length' acts beside a filter of order 2 or more [/analysis/velocity_update_settings/viscosity_length]
  ": "flip", "velocity_update_settings": {"relaxation": 0.03, "viscosity_length": 1}, "dt": 0.001, "nsteps": 10},
                                                                                  ^
  hint: give 'relaxation', which the filter takes, and 'order' 3
)"},
    {"two viscosities",
     {replace("mpm.json", "\"dt\"", "\"velocity_update\": \"flip\", \"velocity_update_settings\": {\"relaxation\": 1, \"viscosity\": 1, \"viscosity_length\": 1, \"order\": 3}, \"dt\"")},
     {},
     R"(mpm.json:19:150: error: 'viscosity_length' and 'viscosity' are two viscosities of one transfer [/analysis/velocity_update_settings/viscosity_length]
  elocity_update_settings": {"relaxation": 1, "viscosity": 1, "viscosity_length": 1, "order": 3}, "dt": 0.001, "nsteps": 10},
                                                                                  ^
  hint: leave one of them
)"},
    {"corners that move with nodes where particles do not",
     {replace("mpm.json", "\"dt\"", "\"velocity_update\": \"asflip\", \"shape_functions\": \"cpdi2\", \"dt\"")},
     {},
     R"(mpm.json:19:89: error: "cpdi2" does not go together with "velocity_update": "asflip": corners of domains move with the nodes, and particles would not [/analysis/shape_functions]
  sis": {"type": "MPMExplicit2D", "velocity_update": "asflip", "shape_functions": "cpdi2", "dt": 0.001, "nsteps": 10},
                                                                                  ^
  hint: take "cpdi", or set separation to 0 in velocity_update_settings
)"},
    {"more separation than there is",
     {replace("mpm.json", "\"dt\"", "\"velocity_update\": \"asflip\", \"velocity_update_settings\": {\"separation\": 1.5}, \"dt\"")},
     {},
     R"(mpm.json:19:113: error: 'separation' must be at least 0 and at most 1, found 1.5 [/analysis/velocity_update_settings/separation]
  cit2D", "velocity_update": "asflip", "velocity_update_settings": {"separation": 1.5}, "dt": 0.001, "nsteps": 10},
                                                                                  ^
)"},
    {"a function with times that do not ascend",
     {replace("mpm.json", "\"analysis\"", R"("math_functions": [{"id": 0, "type": "Linear", "xvalues": [0, 1, 1], "fxvalues": [0, 1, 1]}],
  "analysis")")},
     {},
     R"(mpm.json:19:61: error: 'xvalues' must be ascending [/math_functions/0/xvalues]
    "math_functions": [{"id": 0, "type": "Linear", "xvalues": [0, 1, 1], "fxvalues": [0, 1, 1]}],
                                                              ^
)"},
    {"a function with a value too few",
     {replace("mpm.json", "\"analysis\"", R"("math_functions": [{"id": 0, "type": "Linear", "xvalues": [0, 1], "fxvalues": [0]}],
  "analysis")")},
     {},
     R"(mpm.json:19:81: error: 'xvalues' and 'fxvalues' must have the same length of at least 1, found 2 and 1 [/math_functions/0/fxvalues]
    "math_functions": [{"id": 0, "type": "Linear", "xvalues": [0, 1], "fxvalues": [0]}],
                                                                                  ^
)"},
    {"an override of an unknown key",
     {},
     {"analysis.nstep=20"},
     R"(command line: error: unknown key 'nstep' in analysis [/analysis/nstep]
  --set analysis.nstep=20
                 ^
  hint: did you mean 'nsteps'?
)"},
    {"an override that is out of bounds",
     {},
     {"/materials/0/density=-1"},
     R"(command line: error: 'density' must be greater than 0 [kg/m^3], found -1 [/materials/0/density]
  --set /materials/0/density=-1
                             ^
)"},
    {"no checkpoint is kept",
     {},
     {"post_processing.checkpoints_kept=0"},
     R"(command line: error: 'checkpoints_kept' must be at least 1 and at most 1000000, found 0 [/post_processing/checkpoints_kept]
  --set post_processing.checkpoints_kept=0
                                         ^
)"},
    {"checkpoints in the past",
     {},
     {"post_processing.checkpoint_minutes=-5"},
     R"(command line: error: 'checkpoint_minutes' must be at least 0 [min], found -5 [/post_processing/checkpoint_minutes]
  --set post_processing.checkpoint_minutes=-5
                                           ^
)"},
    {"patches that are split after less than no step",
     {},
     {"analysis.split_steps=-1"},
     R"(command line: error: 'split_steps' must be at least 0, found -1 [/analysis/split_steps]
  --set analysis.split_steps=-1
                             ^
)"},
    {"patches that are split after part of a step",
     {},
     {"analysis.split_steps=2.5"},
     R"(command line: error: 'split_steps' must be an integer, found number 2.5 [/analysis/split_steps]
  --set analysis.split_steps=2.5
                             ^
)"},
    {"an override beyond an array",
     {},
     {"materials.1.density=5"},
     R"(command line: error: '1' is not a position in this array of 1 elements
  --set materials.1.density=5
                  ^
)"},
    {"an override of an entry that has no such name",
     {replace("mpm.json", "{\"id\": 0, \"type\"", "{\"name\": \"sand\", \"type\"")},
     {"materials.sant.density=5"},
     R"(command line: error: no entry is named 'sant'
  --set materials.sant.density=5
                  ^
  hint: did you mean 'sand'?
)"},
    {"an override of an entry by its name",
     {replace("mpm.json", "{\"id\": 0, \"type\"", "{\"name\": \"sand\", \"type\"")},
     {"materials.sand.density=-5"},
     R"(command line: error: 'density' must be greater than 0 [kg/m^3], found -5 [/materials/0/density]
  --set materials.sand.density=-5
                               ^
)"},
    {"an override that removes what is not there",
     {},
     {"materials.0.densty=null"},
     R"(command line: error: there is no 'densty' to remove
  --set materials.0.densty=null
                    ^
)"},
    {"an override that would remove an entry",
     {},
     {"materials.0=null"},
     R"(command line: error: null removes a key, not an entry of a list
  --set materials.0=null
                  ^
  hint: give the whole list without it
)"},
    {"an override that removes a key which is needed",
     {},
     {"materials.0.density=null"},
     R"(mpm.json:15:5: error: 'density' is missing in a material [/materials/0]
      {"id": 0, "type": "LinearElastic2D", "density": 1000,
      ^
  hint: density [kg/m^3]: initial density; --set materials.0.density=null changes what is written here
)"},
    {"a line of which overrides have changed parts",
     {},
     {"analysis.nsteps=20", "analysis.dt=null", "post_processing.output_steps=7"},
     R"(mpm.json:19:15: error: 'dt' is missing in analysis [/analysis]
    "analysis": {"type": "MPMExplicit2D", "dt": 0.001, "nsteps": 10},
                ^
  hint: dt [s]: the time step; or "time_step": {"adaptive": true}; --set analysis.nsteps=20 and --set analysis.dt=null change what is written here
)"},
    {"an override without value",
     {},
     {"analysis.nsteps"},
     R"(command line: error: 'analysis.nsteps' is not of the form key=value
  --set analysis.nsteps
        ^
  hint: for example --set analysis.nsteps=10 or --set /materials/0/density=1800
)"},
    {"an override that another value does not agree with",
     {replace("mpm.json", "{\"id\": 0, \"type\"", "{\"id\": 7, \"type\": \"Newtonian\", \"density\": 1, \"bulk_modulus\": 1, \"dynamic_viscosity\": 0},\n    {\"id\": 0, \"type\"")},
     {R"(materials.0={"id": 0, "type": "LinearElastic", "density": 1, "youngs_modulus": 1, "poisson_ratio": 0})"},
     R"(mpm.json:16:12: error: material id '0' occurs twice; first on the command line [/materials/1/id]
      {"id": 0, "type": "LinearElastic2D", "density": 1000,
             ^
)"},
    {"output that comes more often than can be counted",
     {replace("mpm.json", "\"output_steps\": 5", "\"output_dt\": 1e-300, \"history_dt\": 1e-20")},
     {},
     R"(mpm.json:20:36: error: 'output_dt' is 1e-300 s: the run of 0.01 s has 1e+298 multiples of it; at most 9e+15 can be counted [/post_processing/output_dt]
    "post_processing": {"output_dt": 1e-300, "history_dt": 1e-20}
                                     ^
  hint: give a longer interval [s]
mpm.json:20:58: error: 'history_dt' is 1e-20 s: the run of 0.01 s has 1e+18 multiples of it; at most 9e+15 can be counted [/post_processing/history_dt]
    "post_processing": {"output_dt": 1e-300, "history_dt": 1e-20}
                                                           ^
  hint: give a longer interval [s]
)"},
    {"frames and rows by steps and by time",
     {replace("mpm.json", "\"output_steps\": 5", "\"output_steps\": 5, \"output_dt\": 0.1, \"history_steps\": 1, \"history_dt\": 0.2")},
     {},
     R"(mpm.json:20:55: error: 'output_steps' and 'output_dt' both say when frames come [/post_processing/output_dt]
    "post_processing": {"output_steps": 5, "output_dt": 0.1, "history_steps": 1, "history_dt": 0.2}
                                                        ^
  hint: leave one of them out
mpm.json:20:94: error: 'history_steps' and 'history_dt' both say when rows come [/post_processing/history_dt]
  ssing": {"output_steps": 5, "output_dt": 0.1, "history_steps": 1, "history_dt": 0.2}
                                                                                  ^
  hint: leave one of them out
)"},
    {"a watchdog that is to do what it cannot",
     {},
     {"analysis.watchdog.action=bark"},
     R"(command line: error: 'action' must be one of "stop", "warn", "off", found "bark" [/analysis/watchdog/action]
  --set analysis.watchdog.action=bark
                                 ^
)"},
    {"an override inside a number",
     {},
     {"analysis.dt.max=5"},
     R"(command line: error: there is no 'max' in number 0.001
  --set analysis.dt.max=5
                    ^
)"},
  };
  check(table, 61);
}
