#include <doctest/doctest.h>

#include "tests/io/scenario/broken_case.h"

using namespace lahar::broken;

// clang-format off
TEST_CASE("sets, materials and functions that do not exist are refused") {
  const std::vector<Entry> table = {
    {"a node set that does not exist",
     {replace("mpm.json", "\"nset_id\": 0", "\"nset_id\": 4")},
     {},
     R"(mpm.json:8:44: error: there is no node set 4 [/mesh/boundary_conditions/velocity_constraints/0/nset_id]
        "velocity_constraints": [{"nset_id": 4, "dir": 1, "velocity": 0.0}]
                                             ^
  hint: node sets: 0
)"},
    {"a named set that does not exist",
     {replace("mpm.json", "\"nset_id\": 0", "\"nset\": \"floor\""),
      replace("mpm.json", "\"particles\": [", R"("sets": {"nodes": {"flour": {"all": true}}},
  "particles": [)")},
     {},
     R"(mpm.json:8:41: error: there is no node set named 'floor' [/mesh/boundary_conditions/velocity_constraints/0/nset]
        "velocity_constraints": [{"nset": "floor", "dir": 1, "velocity": 0.0}]
                                          ^
  hint: did you mean 'flour'?
)"},
    {"a named set where there are none",
     {replace("mpm.json", "\"nset_id\": 0", "\"nset_id\": \"floor\"")},
     {},
     R"(mpm.json:8:44: error: there is no node set named 'floor' [/mesh/boundary_conditions/velocity_constraints/0/nset_id]
        "velocity_constraints": [{"nset_id": "floor", "dir": 1, "velocity": 0.0}]
                                             ^
  hint: name sets under sets.nodes
)"},
    {"a set by two keys",
     {replace("mpm.json", "\"nset_id\": 0", "\"nset_id\": 0, \"nset\": \"floor\"")},
     {},
     R"(mpm.json:8:55: error: 'nset_id' and 'nset' mean the same; give one of them [/mesh/boundary_conditions/velocity_constraints/0/nset]
        "velocity_constraints": [{"nset_id": 0, "nset": "floor", "dir": 1, "velocity": 0.0}]
                                                        ^
)"},
    {"a constraint without set",
     {replace("mpm.json", "\"nset_id\": 0, ", "")},
     {},
     R"(mpm.json:8:32: error: 'nset' is missing [/mesh/boundary_conditions/velocity_constraints/0]
        "velocity_constraints": [{"dir": 1, "velocity": 0.0}]
                                 ^
  hint: nset: an id (-1 for all) or a name of sets.nodes
)"},
    {"a set id below -1",
     {replace("mpm.json", "\"nset_id\": 0", "\"nset_id\": -2")},
     {},
     R"(mpm.json:8:44: error: 'nset_id' must be at least -1, found -2 [/mesh/boundary_conditions/velocity_constraints/0/nset_id]
        "velocity_constraints": [{"nset_id": -2, "dir": 1, "velocity": 0.0}]
                                             ^
)"},
    {"a particle set that does not exist",
     {replace("mpm.json", "\"gravity\": [0, -9.81]", "\"gravity\": [0, -9.81], \"particle_surface_traction\": [{\"pset_id\": 1, \"dir\": 0, \"traction\": 1}]")},
     {},
     R"(mpm.json:18:100: error: there is no particle set 1 [/external_loading_conditions/particle_surface_traction/0/pset_id]
  _conditions": {"gravity": [0, -9.81], "particle_surface_traction": [{"pset_id": 1, "dir": 0, "traction": 1}]},
                                                                                  ^
  hint: particle sets: 3
)"},
    {"a cell set that does not exist",
     {replace("mpm.json", "{\"type\": \"file\", \"location\": \"particles.txt\", \"material_id\": 0}", "{\"type\": \"gauss\", \"cset_id\": 0, \"nparticles_per_dir\": 2, \"material_id\": 0}")},
     {},
     R"(mpm.json:12:48: error: there is no cell set 0 [/particles/0/generator/cset_id]
      {"generator": {"type": "gauss", "cset_id": 0, "nparticles_per_dir": 2, "material_id": 0}}
                                                 ^
  hint: no cell set has an id; sets come from mesh.entity_sets
)"},
    {"a material that does not exist",
     {replace("mpm.json", "\"material_id\": 0", "\"material_id\": 1")},
     {},
     R"(mpm.json:12:80: error: there is no material with the id 1 [/particles/0/generator/material_id]
      {"generator": {"type": "file", "location": "particles.txt", "material_id": 1}}
                                                                                 ^
  hint: ids: 0
)"},
    {"a material name that does not exist",
     {replace("mpm.json", "\"id\": 0", "\"name\": \"sand\""),
      replace("mpm.json", "\"material_id\": 0", "\"material\": \"send\"")},
     {},
     R"(mpm.json:12:77: error: there is no material named 'send' [/particles/0/generator/material]
      {"generator": {"type": "file", "location": "particles.txt", "material": "send"}}
                                                                              ^
  hint: did you mean 'sand'?
)"},
    {"a function that does not exist",
     {replace("mpm.json", "\"gravity\": [0, -9.81]", "\"gravity\": [0, -9.81], \"concentrated_nodal_forces\": [{\"nset_id\": 0, \"dir\": 0, \"force\": 1, \"math_function_id\": 2}]")},
     {},
     R"(mpm.json:18:145: error: there is no math function with the id 2 [/external_loading_conditions/concentrated_nodal_forces/0/math_function_id]
  trated_nodal_forces": [{"nset_id": 0, "dir": 0, "force": 1, "math_function_id": 2}]},
                                                                                  ^
)"},
    {"two materials with one id",
     {replace("mpm.json", "\"materials\": [", R"("materials": [
    {"id": 0, "type": "Newtonian2D", "density": 1, "bulk_modulus": 1, "dynamic_viscosity": 0},)")},
     {},
     R"(mpm.json:16:12: error: material id '0' occurs twice; first on line 15 [/materials/1/id]
      {"id": 0, "type": "LinearElastic2D", "density": 1000,
             ^
)"},
    {"a file and a set at once",
     {replace("mpm.json", "\"nset_id\": 0", "\"file\": \"v.txt\""),
      write("v.txt", R"(0 1 0
)")},
     {},
     R"(mpm.json:8:57: error: 'dir' does not go together with 'file' [/mesh/boundary_conditions/velocity_constraints/0/dir]
        "velocity_constraints": [{"file": "v.txt", "dir": 1, "velocity": 0.0}]
                                                          ^
  hint: the file has a node, a direction and a value in each row
mpm.json:8:72: error: 'velocity' does not go together with 'file' [/mesh/boundary_conditions/velocity_constraints/0/velocity]
        "velocity_constraints": [{"file": "v.txt", "dir": 1, "velocity": 0.0}]
                                                                         ^
  hint: the file has a node, a direction and a value in each row
)"},
    {"entity sets that are missing",
     {absent("sets.json")},
     {},
     R"(mpm.json:5:20: error: file 'sets.json' does not exist [/mesh/entity_sets]
      "entity_sets": "sets.json",
                     ^
  hint: file names are relative to the scenario's folder
)"},
    {"entity sets that are no JSON",
     {write("sets.json", R"(node_sets: []
)")},
     {},
     R"(sets.json:1:1: error: syntax error while parsing value - invalid literal
  node_sets: []
  ^
)"},
    {"an unknown kind of entity sets",
     {replace("sets.json", "\"particle_sets\"", "\"element_sets\"")},
     {},
     R"(sets.json:3:3: error: unknown key 'element_sets' in the entity sets [/element_sets]
    "element_sets": [{"id": 3, "set": [0, 2]}]
    ^
  hint: known keys: node_sets, cell_sets, particle_sets
)"},
    {"an entity set twice",
     {replace("sets.json", "[{\"id\": 0, \"set\": [0, 1, 2]}]", "[{\"id\": 0, \"set\": [0]}, {\"id\": 0, \"set\": [1]}]")},
     {},
     R"(sets.json:2:47: error: node set 0 occurs twice [/node_sets/1/id]
    "node_sets": [{"id": 0, "set": [0]}, {"id": 0, "set": [1]}],
                                                ^
)"},
    {"an entity set with a node that does not exist",
     {replace("sets.json", "[0, 1, 2]", "[0, 6, -1, 1.5]")},
     {},
     R"(sets.json:2:38: error: there is no node 6; the ids are 0 to 5 [/node_sets/0/set/1]
    "node_sets": [{"id": 0, "set": [0, 6, -1, 1.5]}],
                                       ^
sets.json:2:41: error: a node id must be a non-negative integer, found number -1 [/node_sets/0/set/2]
    "node_sets": [{"id": 0, "set": [0, 6, -1, 1.5]}],
                                          ^
sets.json:2:45: error: a node id must be a non-negative integer, found number 1.5 [/node_sets/0/set/3]
    "node_sets": [{"id": 0, "set": [0, 6, -1, 1.5]}],
                                              ^
)"},
    {"an entity set with a particle that does not exist",
     {replace("sets.json", "[0, 2]", "[0, 3]")},
     {},
     R"(mpm.json:5:20: error: particle set 3 has particle 3, but the ids are 0 to 2 [/mesh/entity_sets]
      "entity_sets": "sets.json",
                     ^
)"},
    {"an entity set without id",
     {replace("sets.json", "\"id\": 0, ", "")},
     {},
     R"(sets.json:2:17: error: a node set must be an object with an integer "id" and an array "set" [/node_sets/0]
    "node_sets": [{"set": [0, 1, 2]}],
                  ^
)"},
    {"a region with two shapes",
     {replace("mpm.json", "\"particles\": [", R"("sets": {"nodes": {"a": {"box": {}, "all": true}}},
  "particles": [)")},
     {},
     R"(mpm.json:11:27: error: a region has exactly one shape [/sets/nodes/a]
    "sets": {"nodes": {"a": {"box": {}, "all": true}}},
                            ^
  hint: for example {"box": {"min": [0, 0], "max": [1, 1]}}; combine several with "union", "intersection" or "difference"
)"},
    {"a region without shape",
     {replace("mpm.json", "\"particles\": [", R"("sets": {"nodes": {"a": {}}},
  "particles": [)")},
     {},
     R"(mpm.json:11:27: error: a region needs a shape [/sets/nodes/a]
    "sets": {"nodes": {"a": {}}},
                            ^
  hint: for example {"box": {"min": [0, 0], "max": [1, 1]}}; combine several with "union", "intersection" or "difference"
)"},
    {"an empty box",
     {replace("mpm.json", "\"particles\": [", R"("sets": {"nodes": {"a": {"box": {"min": [1, 0], "max": [0, 1]}}}},
  "particles": [)")},
     {},
     R"(mpm.json:11:35: error: the box is empty: min 1 is above max 0 along x [/sets/nodes/a/box]
    "sets": {"nodes": {"a": {"box": {"min": [1, 0], "max": [0, 1]}}}},
                                    ^
)"},
    {"a half space without direction",
     {replace("mpm.json", "\"particles\": [", R"("sets": {"nodes": {"a": {"half_space": {"point": [0, 0], "normal": [0, 0]}}}},
  "particles": [)")},
     {},
     R"(mpm.json:11:70: error: the normal must not be zero [/sets/nodes/a/half_space/normal]
    "sets": {"nodes": {"a": {"half_space": {"point": [0, 0], "normal": [0, 0]}}}},
                                                                       ^
)"},
    {"a sphere without size",
     {replace("mpm.json", "\"particles\": [", R"("sets": {"nodes": {"a": {"sphere": {"center": [0, 0], "radius": 0}}}},
  "particles": [)")},
     {},
     R"(mpm.json:11:39: error: unknown key 'center' in a sphere [/sets/nodes/a/sphere/center]
    "sets": {"nodes": {"a": {"sphere": {"center": [0, 0], "radius": 0}}}},
                                        ^
  hint: did you mean 'centre'?
mpm.json:11:67: error: 'radius' must be greater than 0 [m], found 0 [/sets/nodes/a/sphere/radius]
    "sets": {"nodes": {"a": {"sphere": {"center": [0, 0], "radius": 0}}}},
                                                                    ^
)"},
    {"a polygon of two points",
     {replace("mpm.json", "\"particles\": [", R"("sets": {"nodes": {"a": {"polygon": {"points": [[0, 0], [1, 1]]}}}},
  "particles": [)")},
     {},
     R"(mpm.json:11:50: error: a polygon needs at least three points, found 2 [/sets/nodes/a/polygon/points]
    "sets": {"nodes": {"a": {"polygon": {"points": [[0, 0], [1, 1]]}}}},
                                                   ^
)"},
    {"a region that holds no particle",
     {replace("mpm.json", "{\"type\": \"file\", \"location\": \"particles.txt\", \"material_id\": 0}", "{\"type\": \"region\", \"region\": {\"box\": {\"min\": [5, 5], \"max\": [6, 6]}}, \"material_id\": 0}")},
     {},
     R"(mpm.json:12:19: error: the region contains no particle [/particles/0/generator]
      {"generator": {"type": "region", "region": {"box": {"min": [5, 5], "max": [6, 6]}}, "material_id": 0}}
                    ^
  hint: does it lie inside the mesh? per_cell may be too small for it. It extends from (5, 5) to (6, 6), the mesh from (0, 0) to (2, 1)
)"},
  };
  check(table, 27);
}
