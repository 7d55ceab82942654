#include <doctest/doctest.h>

#include "tests/io/scenario/broken_case.h"

using namespace lahar::broken;

// clang-format off
TEST_CASE("side files are refused with line and column") {
  const std::vector<Entry> table = {
    {"particles that are missing",
     {absent("particles.txt")},
     {},
     R"(mpm.json:12:48: error: file 'particles.txt' does not exist [/particles/0/generator/location]
      {"generator": {"type": "file", "location": "particles.txt", "material_id": 0}}
                                                 ^
  hint: file names are relative to the scenario's folder
)"},
    {"particles that are a folder",
     {folder("particles.txt")},
     {},
     R"(mpm.json:12:48: error: file 'particles.txt' is a folder, not a file [/particles/0/generator/location]
      {"generator": {"type": "file", "location": "particles.txt", "material_id": 0}}
                                                 ^
)"},
    {"particles that are empty",
     {write("particles.txt", "")},
     {},
     R"(mpm.json:12:48: error: file 'particles.txt' is empty [/particles/0/generator/location]
      {"generator": {"type": "file", "location": "particles.txt", "material_id": 0}}
                                                 ^
)"},
    {"fewer particles than promised",
     {replace("particles.txt", R"(3
)", R"(4
)")},
     {},
     R"(particles.txt: error: the file ends after 3 of 4 particles
)"},
    {"more particles than promised",
     {replace("particles.txt", R"(3
)", R"(2
)")},
     {},
     R"(particles.txt:4:1: error: unexpected row after 2 particles
  1.5 0.5
  ^
  hint: the count in the first row is too small, or there are rows too many
)"},
    {"a count that is no number",
     {replace("particles.txt", R"(3
)", R"(three
)")},
     {},
     R"(particles.txt:1:1: error: the number of particles must be an integer of at least 1, found 'three'
  three
  ^
)"},
    {"a count of millions of millions",
     {replace("particles.txt", R"(3
)", R"(3000000000000
)")},
     {},
     R"(particles.txt: error: the file ends after 3 of 3000000000000 particles
)"},
    {"a particle that is no number",
     {replace("particles.txt", "0.75 0.5", "0,75 0.5")},
     {},
     R"(particles.txt:3:1: error: x must be a finite number, found '0,75'
  0,75 0.5
  ^
)"},
    {"a particle at infinity",
     {replace("particles.txt", "0.75", "inf")},
     {},
     R"(particles.txt:3:1: error: x must be a finite number, found 'inf'
  inf 0.5
  ^
)"},
    {"a particle outside the mesh",
     {replace("particles.txt", "1.5 0.5", "2.5 0.5")},
     {},
     R"(particles.txt:4: error: particle 2 at (2.5, 0.5) lies outside the mesh
  2.5 0.5
  hint: the mesh extends from (0, 0) to (2, 1)
)"},
    {"many particles outside the mesh",
     {write("particles.txt", R"(8
0.5 3
1.5 3
2.5 3
3.5 3
4.5 3
5.5 3
6.5 3
7.5 3
)")},
     {},
     R"(particles.txt:2: error: particle 0 at (0.5, 3) lies outside the mesh
  0.5 3
  hint: the mesh extends from (0, 0) to (2, 1)
particles.txt:3: error: particle 1 at (1.5, 3) lies outside the mesh
  1.5 3
  hint: the mesh extends from (0, 0) to (2, 1)
particles.txt:4: error: particle 2 at (2.5, 3) lies outside the mesh
  2.5 3
  hint: the mesh extends from (0, 0) to (2, 1)
particles.txt:5: error: particle 3 at (3.5, 3) lies outside the mesh
  3.5 3
  hint: the mesh extends from (0, 0) to (2, 1)
particles.txt:6: error: particle 4 at (4.5, 3) lies outside the mesh
  4.5 3
  hint: the mesh extends from (0, 0) to (2, 1)
particles.txt: error: and 3 more particles lie outside the mesh
)"},
    {"a comment behind the data",
     {replace("particles.txt", "0.75 0.5", "0.75 0.5 # middle")},
     {},
     R"(particles.txt:3:10: error: a comment must have a line of its own
  0.75 0.5 # middle
           ^
  hint: the reference skips the whole line
)"},
    {"a particle file of zero bytes in it",
     {replace("particles.txt", "0.75", std::string("0.\0" "75", 5))},
     {},
     R"(particles.txt:3:1: error: x must be a finite number, found '0.\x0075'
  0.\x0075 0.5
  ^
)"},
    {"a negative volume",
     {replace("mpm.json", "\"cell_type\"", "\"particles_volumes\": \"v.txt\", \"cell_type\""),
      write("v.txt", R"(0 0.5
1 -0.5
)")},
     {},
     R"(v.txt:2:3: error: the volume must be greater than 0, found -0.5
  1 -0.5
    ^
)"},
    {"a volume of a particle that does not exist",
     {replace("mpm.json", "\"cell_type\"", "\"particles_volumes\": \"v.txt\", \"cell_type\""),
      write("v.txt", R"(3 0.5
)")},
     {},
     R"(v.txt:1:1: error: a particle id must be an integer from 0 to 2, found '3'
  3 0.5
  ^
)"},
    {"a volume twice",
     {replace("mpm.json", "\"cell_type\"", "\"particles_volumes\": \"v.txt\", \"cell_type\""),
      write("v.txt", R"(0 0.5

0 0.5
)")},
     {},
     R"(v.txt:3:1: error: particle 0 occurs twice; first on line 1
  0 0.5
  ^
)"},
    {"a volume that is missing",
     {replace("mpm.json", "\"cell_type\"", "\"particles_volumes\": \"v.txt\", \"cell_type\""),
      write("v.txt", R"(0
)")},
     {},
     R"(v.txt:1:2: error: the volume is missing
  0
   ^
)"},
    {"a cell of a particle that does not exist",
     {replace("mpm.json", "\"cell_type\"", "\"particle_cells\": \"c.txt\", \"cell_type\""),
      write("c.txt", R"(0 0
1 2
)")},
     {},
     R"(c.txt:2:3: error: a cell id must be an integer from 0 to 1, found '2'
  1 2
    ^
)"},
    {"stresses of too few particles",
     {replace("mpm.json", "\"cell_type\"", "\"particles_stresses\": \"s.txt\", \"cell_type\""),
      write("s.txt", R"(2
0 0 0 0 0 0
0 0 0 0 0 0
)")},
     {},
     R"(s.txt:1:1: error: the file has stresses of 2 particles, but there are 3
  2
  ^
)"},
    {"a stress of five components",
     {replace("mpm.json", "\"cell_type\"", "\"particles_stresses\": \"s.txt\", \"cell_type\""),
      write("s.txt", R"(3
0 0 0 0 0 0
0 0 0 0 0
0 0 0 0 0 0
)")},
     {},
     R"(s.txt:3:10: error: xz is missing
  0 0 0 0 0
           ^
)"},
    {"a velocity constraint of a node that does not exist",
     {replace("mpm.json", "\"velocity_constraints\": [{\"nset_id\": 0, \"dir\": 1, \"velocity\": 0.0}]", "\"velocity_constraints\": [{\"file\": \"v.txt\"}]"),
      write("v.txt", R"(0 1 0
6 1 0
)")},
     {},
     R"(v.txt:2:1: error: a node id must be an integer from 0 to 5, found '6'
  6 1 0
  ^
)"},
    {"a velocity constraint out of the plane",
     {replace("mpm.json", "\"velocity_constraints\": [{\"nset_id\": 0, \"dir\": 1, \"velocity\": 0.0}]", "\"velocity_constraints\": [{\"file\": \"v.txt\"}]"),
      write("v.txt", R"(0 2 0
)")},
     {},
     R"(v.txt:1:3: error: the direction must be an integer from 0 to 1, found '2'
  0 2 0
    ^
)"},
    {"a nodal force that is no number",
     {replace("mpm.json", "\"gravity\": [0, -9.81]", "\"gravity\": [0, -9.81], \"concentrated_nodal_forces\": [{\"file\": \"f.txt\"}]"),
      write("f.txt", R"(0 1 1e400
)")},
     {},
     R"(f.txt:1:5: error: the force must be a finite number, found '1e400'
  0 1 1e400
      ^
)"},
    {"problems in three files at once",
     {replace("mpm.json", "\"dt\": 0.001", "\"dt\": 0"),
      replace("mesh.txt", R"(1 1
)", R"(1 x
)"),
      replace("particles.txt", "0.75", "y")},
     {},
     R"(mpm.json:19:47: error: 'dt' must be greater than 0 [s], found 0 [/analysis/dt]
    "analysis": {"type": "MPMExplicit2D", "dt": 0, "nsteps": 10},
                                                ^
mesh.txt:7:3: error: y must be a finite number, found 'x'
  1 x
    ^
particles.txt:3:1: error: x must be a finite number, found 'y'
  y 0.5
  ^
)"},
  };
  check(table, 24);
}
