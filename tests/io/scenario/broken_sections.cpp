#include <doctest/doctest.h>

#include "tests/io/scenario/broken_case.h"

using namespace lahar::broken;

// clang-format off
TEST_CASE("sections that are missing or empty are refused, whatever else depends on them") {
  const std::vector<Entry> table = {
    {"contact between the bodies of no materials",
     {write("mpm.json", R"({"mesh": {"structured": {"cell_size": 1, "counts": [2, 2]}},
 "particles": [{"generator": {"type": "region", "material": "a"}}],
 "analysis": {"interface": true, "nsteps": 1}}
)")},
     {},
     R"(mpm.json:1:1: error: 'materials' is missing in the scenario
  {"mesh": {"structured": {"cell_size": 1, "counts": [2, 2]}},
  ^
  hint: materials: constitutive laws and densities
)"},
    {"contact between the bodies of an empty list of materials",
     {write("mpm.json", R"({"mesh": {"structured": {"cell_size": 1, "counts": [2, 2]}},
 "particles": [{"generator": {"type": "region", "material": "a"}}],
 "materials": [],
 "analysis": {"interface": true, "nsteps": 1}}
)")},
     {},
     R"(mpm.json:3:15: error: there are no materials [/materials]
   "materials": [],
                ^
  hint: give at least one material: its type, density and parameters
)"},
    {"a material that is none, and contact",
     {write("mpm.json", R"({"mesh": {"structured": {"cell_size": 1, "counts": [2, 2]}},
 "particles": [{"generator": {"type": "inject", "nparticles_per_dir": 1, "material": "a"}}],
 "materials": [[]],
 "analysis": {"interface": true, "nsteps": 1}}
)")},
     {},
     R"(mpm.json:3:15: error: 'materials' must be an array of objects, found array [[]] [/materials]
   "materials": [[]],
                ^
)"},
    {"no particles, and contact",
     {write("mpm.json", R"({"mesh": {"structured": {"cell_size": 1, "counts": [2, 2]}},
 "particles": [],
 "materials": [{"type": "LinearElastic", "density": 1, "youngs_modulus": 1, "poisson_ratio": 0}],
 "analysis": {"interface": true, "nsteps": 1}}
)")},
     {},
     R"(mpm.json:2:15: error: there are no particles [/particles]
   "particles": [],
                ^
  hint: add a generator
)"},
    {"no mesh, and contact",
     {write("mpm.json", R"({"mesh": {},
 "particles": [{"generator": {"type": "region", "material_id": 0}}],
 "materials": [{"type": "LinearElastic", "density": 1, "youngs_modulus": 1, "poisson_ratio": 0}],
 "analysis": {"type": "MPMExplicit2D", "interface": true, "nsteps": 1, "dt": 1}}
)")},
     {},
     R"(mpm.json:1:10: error: there is no mesh [/mesh]
  {"mesh": {},
           ^
  hint: give a mesh file ("mesh": "mesh.txt") or a grid ("structured": {...})
)"},
  };
  check(table, 5);
}
