#include <doctest/doctest.h>

#include "broken_case.h"

using namespace lahar::broken;

// clang-format off
TEST_CASE("what a later version will do is refused, never ignored") {
  const std::vector<Entry> table = {
    {"another element",
     {replace("mpm.json", "ED2Q4", "ED2T3")},
     {},
     R"(mpm.json:6:18: error: 'cell_type': "ED2T3" is not supported yet [/mesh/cell_type]
      "cell_type": "ED2T3",
                   ^
  hint: supported: ED2Q4, ED3H8, ED2Q16G, ED3H64G, ED2Q4P2B, ED3H8P2B
)"},
    {"another material",
     {replace("mpm.json", R"("LinearElastic2D", "density": 1000,
     "youngs_modulus": 1e6, "poisson_ratio": 0.3)", R"("Bingham2D", "density": 1000,
     "youngs_modulus": 1e6, "poisson_ratio": 0.3, "tau0": -1, "mu": 1)")},
     {},
     R"(mpm.json:15:5: error: 'critical_shear_rate' is missing in a material [/materials/0]
      {"id": 0, "type": "Bingham2D", "density": 1000,
      ^
  hint: critical_shear_rate [1/s]: shear rate below which it is rigid
mpm.json:15:23: error: 'type': "Bingham2D" is not supported yet [/materials/0/type]
      {"id": 0, "type": "Bingham2D", "density": 1000,
                        ^
  hint: supported: LinearElastic, Newtonian
mpm.json:16:59: error: 'tau0' must be at least 0 [Pa], found -1 [/materials/0/tau0]
       "youngs_modulus": 1e6, "poisson_ratio": 0.3, "tau0": -1, "mu": 1}
                                                            ^
)"},
    {"an implicit analysis",
     {replace("mpm.json", "MPMExplicit2D", "MPMImplicit2D")},
     {},
     R"(mpm.json:19:24: error: 'type': "MPMImplicit2D" is not supported yet [/analysis/type]
    "analysis": {"type": "MPMImplicit2D", "dt": 0.001, "nsteps": 10},
                         ^
  hint: supported: MPMExplicit2D, MPMExplicit3D
)"},
    {"another velocity update",
     {replace("mpm.json", "\"dt\"", "\"velocity_update\": \"asflip\", \"dt\"")},
     {},
     R"(mpm.json:19:60: error: 'velocity_update': "asflip" is not supported yet [/analysis/velocity_update]
    "analysis": {"type": "MPMExplicit2D", "velocity_update": "asflip", "dt": 0.001, "nsteps": 10},
                                                             ^
  hint: supported: flip, pic, apic, tpic
)"},
    {"injection",
     {replace("mpm.json", "{\"type\": \"file\", \"location\": \"particles.txt\", \"material_id\": 0}", "{\"type\": \"inject\", \"cset_id\": -1, \"nparticles_per_dir\": 2, \"velocity\": [0, 1], \"material_id\": 0}")},
     {},
     R"(mpm.json:12:28: error: 'type': "inject" is not supported yet [/particles/0/generator/type]
      {"generator": {"type": "inject", "cset_id": -1, "nparticles_per_dir": 2, "velocity": [0, 1], "material_id": 0}}
                             ^
  hint: supported: file, gauss, region
)"},
    {"friction",
     {replace("mpm.json", "\"velocity_constraints\": [{\"nset_id\": 0, \"dir\": 1, \"velocity\": 0.0}]", R"("velocity_constraints": [{"nset_id": 0, "dir": 1, "velocity": 0.0}],
      "friction_constraints": [{"nset_id": 0, "dir": 1, "sign_n": -1, "friction": 0.3}])")},
     {},
     R"(mpm.json:9:7: error: 'friction_constraints' is not supported yet [/mesh/boundary_conditions/friction_constraints]
        "friction_constraints": [{"nset_id": 0, "dir": 1, "sign_n": -1, "friction": 0.3}]
        ^
)"},
    {"rotated nodes with a bad file",
     {replace("mpm.json", "\"velocity_constraints\": [{\"nset_id\": 0, \"dir\": 1, \"velocity\": 0.0}]", R"("velocity_constraints": [{"nset_id": 0, "dir": 1, "velocity": 0.0}],
      "nodal_euler_angles": "angles.txt")"),
      write("angles.txt", R"(0 0.5 0
9 0.5 0
)")},
     {},
     R"(mpm.json:9:7: error: 'nodal_euler_angles' is not supported yet [/mesh/boundary_conditions/nodal_euler_angles]
        "nodal_euler_angles": "angles.txt"
        ^
angles.txt:2:1: error: a node id must be an integer from 0 to 5, found '9'
  9 0.5 0
  ^
)"},
    {"contact",
     {replace("mpm.json", "\"dt\"", "\"interface\": true, \"dt\"")},
     {},
     R"(mpm.json:19:54: error: 'interface': true is not supported yet [/analysis/interface]
    "analysis": {"type": "MPMExplicit2D", "interface": true, "dt": 0.001, "nsteps": 10},
                                                       ^
)"},
    {"resuming",
     {replace("mpm.json", "\"dt\"", "\"resume\": {\"resume\": true, \"uuid\": \"x\", \"step\": 5}, \"dt\"")},
     {},
     R"(mpm.json:19:62: error: 'resume': true is not supported yet [/analysis/resume/resume]
    "analysis": {"type": "MPMExplicit2D", "resume": {"resume": true, "uuid": "x", "step": 5}, "dt": 0.001, "nsteps": 10},
                                                               ^
)"},
    {"growing gravity",
     {replace("mpm.json", "\"gravity\": [0, -9.81]", "\"gravity\": {\"gravity\": [0, -9.81], \"ramping_time\": 1}")},
     {},
     R"(mpm.json:18:46: error: 'gravity' as an object is not supported yet [/external_loading_conditions/gravity]
    "external_loading_conditions": {"gravity": {"gravity": [0, -9.81], "ramping_time": 1}},
                                               ^
)"},
    {"isotropic initial stresses",
     {replace("mpm.json", "\"cell_type\"", R"("particles_stresses": {"type": "isotropic", "values": [1]},
    "cell_type")")},
     {},
     R"(mpm.json:6:27: error: 'particles_stresses' as an object is not supported yet [/mesh/particles_stresses]
      "particles_stresses": {"type": "isotropic", "values": [1]},
                            ^
)"},
    {"two phases",
     {replace("mpm.json", "\"material_id\": 0", "\"material_id\": [0, 0]")},
     {},
     R"(mpm.json:12:80: error: 'material_id' with 2 phases is not supported yet [/particles/0/generator/material_id]
      {"generator": {"type": "file", "location": "particles.txt", "material_id": [0, 0]}}
                                                                                 ^
  hint: give one material
)"},
    {"two-phase nodes",
     {replace("mpm.json", "\"cell_type\"", "\"node_type\": \"N2D2P\", \"cell_type\"")},
     {},
     R"(mpm.json:6:18: error: 'node_type': "N2D2P" is not supported yet [/mesh/node_type]
      "node_type": "N2D2P", "cell_type": "ED2Q4",
                   ^
  hint: supported: N2D, N3D
)"},
  };
  check(table, 13);
}
