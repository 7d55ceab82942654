#include <doctest/doctest.h>

#include "tests/io/scenario/broken_case.h"

using namespace lahar::broken;

// clang-format off
TEST_CASE("meshes that cannot be used are refused") {
  const std::vector<Entry> table = {
    {"two meshes",
     {replace("mpm.json", "\"mesh\": \"mesh.txt\",", "\"mesh\": \"mesh.txt\", \"structured\": {\"cell_size\": 1, \"counts\": [2, 1]},")},
     {},
     R"(mpm.json:4:39: error: 'structured' and 'mesh' are two meshes; give one of them [/mesh/structured]
      "mesh": "mesh.txt", "structured": {"cell_size": 1, "counts": [2, 1]},
                                        ^
)"},
    {"a structured mesh of unknown size",
     {replace("mpm.json", "\"mesh\": \"mesh.txt\",", "\"structured\": {\"counts\": [2, 1]},")},
     {},
     R"(mpm.json:4:19: error: a structured mesh needs two of 'cell_size', 'extent' and 'counts', found 1 [/mesh/structured]
      "structured": {"counts": [2, 1]},
                    ^
)"},
    {"a structured mesh of no cells",
     {replace("mpm.json", "\"mesh\": \"mesh.txt\",", "\"structured\": {\"cell_size\": 1, \"counts\": [2, 0]},")},
     {},
     R"(mpm.json:4:50: error: 'counts' must be at least 1, found 0 [/mesh/structured/counts/1]
      "structured": {"cell_size": 1, "counts": [2, 0]},
                                                   ^
)"},
    {"an extent that is no whole number of cells",
     {replace("mpm.json", "\"mesh\": \"mesh.txt\",", "\"structured\": {\"cell_size\": 0.3, \"extent\": [2, 1]},")},
     {},
     R"(mpm.json:4:48: error: the extent 2 is not a whole number of cells of size 0.3 [/mesh/structured/extent]
      "structured": {"cell_size": 0.3, "extent": [2, 1]},
                                                 ^
  hint: along x the extent may be 1.8 or 2.1, or the cell size 0.333333 or 0.285714
)"},
    {"an extent of more cells than can be counted",
     {replace("mpm.json", "\"mesh\": \"mesh.txt\",", "\"structured\": {\"cell_size\": 0.1, \"extent\": [2, 6e99]},")},
     {},
     R"(mpm.json:4:48: error: the extent 6e+99 is 6e+100 cells of size 0.1 along y; at most 2e+09 are possible [/mesh/structured/extent]
      "structured": {"cell_size": 0.1, "extent": [2, 6e99]},
                                                 ^
  hint: take larger cells or a smaller extent; both are in metres
)"},
    {"an extent of more cells than an axis may have",
     {replace("mpm.json", "\"mesh\": \"mesh.txt\",", "\"structured\": {\"cell_size\": [1e-300, 1], \"extent\": [2, 1]},")},
     {},
     R"(mpm.json:4:56: error: the extent 2 is 2e+300 cells of size 1e-300 along x; at most 2e+09 are possible [/mesh/structured/extent]
      "structured": {"cell_size": [1e-300, 1], "extent": [2, 1]},
                                                         ^
  hint: take larger cells or a smaller extent; both are in metres
)"},
    {"a mesh that fits no machine",
     {replace("mpm.json", "\"mesh\": \"mesh.txt\",", "\"structured\": {\"cell_size\": 1, \"counts\": [2000000000, 2000000000]},")},
     {},
     R"(mpm.json:4:19: error: a mesh of 4e+18 nodes is too large; at most 1e+10 are possible [/mesh/structured]
      "structured": {"cell_size": 1, "counts": [2000000000, 2000000000]},
                    ^
)"},
    {"a mesh file that is missing",
     {absent("mesh.txt")},
     {},
     R"(mpm.json:4:13: error: file 'mesh.txt' does not exist [/mesh/mesh]
      "mesh": "mesh.txt",
              ^
  hint: file names are relative to the scenario's folder
)"},
    {"a mesh file that is a folder",
     {folder("mesh.txt")},
     {},
     R"(mpm.json:4:13: error: file 'mesh.txt' is a folder, not a file [/mesh/mesh]
      "mesh": "mesh.txt",
              ^
)"},
    {"a mesh file that is empty",
     {write("mesh.txt", "")},
     {},
     R"(mpm.json:4:13: error: file 'mesh.txt' is empty [/mesh/mesh]
      "mesh": "mesh.txt",
              ^
)"},
    {"a mesh file of comments only",
     {write("mesh.txt", R"(# nothing

)")},
     {},
     R"(mesh.txt: error: the file holds no data
  hint: the first row is: nnodes ncells
)"},
    {"a mesh file without the number of cells",
     {replace("mesh.txt", "6 2", "6")},
     {},
     R"(mesh.txt:2:2: error: the number of cells is missing
  6
   ^
)"},
    {"a mesh file with fewer nodes than promised",
     {replace("mesh.txt", "6 2", "7 2")},
     {},
     R"(mesh.txt:9:7: error: unexpected '3' at the end of the row
  0 1 4 3
        ^
mesh.txt: error: the file ends after 1 of 2 cells
)"},
    {"a mesh file with more cells than promised",
     {replace("mesh.txt", "6 2", "6 1")},
     {},
     R"(mesh.txt:10:1: error: unexpected row after 1 cells
  1 2 5 4
  ^
  hint: the count in the first row is too small, or there are rows too many
)"},
    {"a mesh file that ends early",
     {replace("mesh.txt", R"(1 2 5 4
)", "")},
     {},
     R"(mesh.txt: error: the file ends after 1 of 2 cells
)"},
    {"a node that is NaN",
     {replace("mesh.txt", R"(1 1
)", R"(1 nan
)")},
     {},
     R"(mesh.txt:7:3: error: y must be a finite number, found 'nan'
  1 nan
    ^
)"},
    {"a node with one coordinate",
     {replace("mesh.txt", R"(1 1
)", R"(1
)")},
     {},
     R"(mesh.txt:7:2: error: y is missing
  1
   ^
)"},
    {"a node with four coordinates",
     {replace("mesh.txt", R"(1 1
)", R"(1 1 0 0
)")},
     {},
     R"(mesh.txt:7:7: error: unexpected '0' at the end of the row
  1 1 0 0
        ^
)"},
    {"a cell with a node that does not exist",
     {replace("mesh.txt", "1 2 5 4", "1 2 6 4")},
     {},
     R"(mesh.txt:10:5: error: a node id must be an integer from 0 to 5, found '6'
  1 2 6 4
      ^
)"},
    {"a cell with five nodes",
     {replace("mesh.txt", "1 2 5 4", "1 2 5 4 3")},
     {},
     R"(mesh.txt:10:9: error: unexpected '3' at the end of the row
  1 2 5 4 3
          ^
)"},
    {"a cell with a node twice",
     {replace("mesh.txt", "1 2 5 4", "1 2 2 4")},
     {},
     R"(mesh.txt:10: error: cell 1 has node 2 twice; a quadrilateral has 4 different nodes
  1 2 2 4
)"},
    {"an inverted cell",
     {replace("mesh.txt", "1 2 5 4", "1 4 5 2")},
     {},
     R"(mesh.txt:10: error: cell 1 is inverted at its corner at node 1: nodes 1 (1, 0), 4 (1, 1), 5 (2, 1), 2 (2, 0)
  1 4 5 2
  hint: list the corners counter-clockwise
)"},
    {"a cell that is no box",
     {replace("mesh.txt", R"(2 1
)", R"(2 1.5
)"),
      replace("mpm.json", "\"cell_type\"", "\"isoparametric\": false, \"cell_type\"")},
     {},
     R"(mesh.txt:10: error: cell 1 is not a box along the axes: nodes 1 (1, 0), 2 (2, 0), 5 (2, 1.5), 4 (1, 1)
  1 2 5 4
  hint: set isoparametric to true for cells of any shape
)"},
    {"a flat cell",
     {replace("mesh.txt", R"(1 1
2 1
)", R"(1 0
2 0
)")},
     {},
     R"(mesh.txt:9: error: cell 0 is flat at its corner at node 1: nodes 0 (0, 0), 1 (1, 0), 4 (1, 0), 3 (0, 1)
  0 1 4 3
  hint: list the corners counter-clockwise
mesh.txt:10: error: cell 1 is flat at its corner at node 1: nodes 1 (1, 0), 2 (2, 0), 5 (2, 0), 4 (1, 0)
  1 2 5 4
  hint: list the corners counter-clockwise
)"},
    {"an inverted triangle",
     {replace("mpm.json", "ED2Q4", "ED2T3"), write("mesh.txt", R"(4 2
0 0
2 0
0 1
2 1
0 1 2
1 2 3
)")},
     {},
     R"(mesh.txt:7: error: cell 1 is inverted at its corner at node 1: nodes 1 (2, 0), 2 (0, 1), 3 (2, 1)
  1 2 3
  hint: list the corners counter-clockwise
)"},
    {"quadrilaterals said to be triangles",
     {replace("mpm.json", "ED2Q4", "ED2T3")},
     {},
     R"(mesh.txt:9:7: error: unexpected '3' at the end of the row
  0 1 4 3
        ^
mesh.txt:10:7: error: unexpected '4' at the end of the row
  1 2 5 4
        ^
)"},
    {"the middle of a side too near to a corner",
     {replace("mpm.json", "ED2Q4", "ED2Q8"), write("mesh.txt", R"(8 1
0 0
2 0
2 1
0 1
0.5 0
2 0.5
1 1
0 0.5
0 1 2 3 4 5 6 7
)")},
     {},
     R"(mesh.txt:10: error: cell 0 is flat at its corner at node 0: nodes 0 (0, 0), 1 (2, 0), 2 (2, 1), 3 (0, 1), 4 (0.5, 0), 5 (2, 0.5), 6 (1, 1), 7 (0, 0.5)
  0 1 2 3 4 5 6 7
  hint: list the corners counter-clockwise, then the middles of the sides in this order
)"},
    {"more points than triangles have",
     {replace("mpm.json", "\"mesh\": \"mesh.txt\",", "\"structured\": {\"cell_size\": 1, \"counts\": [2, 1]},"),
      replace("mpm.json", "ED2Q4", "ED2T3"),
      replace("mpm.json", "{\"type\": \"file\", \"location\": \"particles.txt\", \"material_id\": 0}", "{\"type\": \"gauss\", \"cset_id\": -1, \"nparticles_per_dir\": 3, \"material_id\": 0}")},
     {},
     R"(mpm.json:12:74: error: 'nparticles_per_dir' must be at most 2 in a triangle, found 3 [/particles/0/generator/nparticles_per_dir]
      {"generator": {"type": "gauss", "cset_id": -1, "nparticles_per_dir": 3, "material_id": 0}}
                                                                           ^
)"},
    {"an element with nodes of negative mass",
     {replace("mpm.json", "\"mesh\": \"mesh.txt\",", "\"structured\": {\"cell_size\": 1, \"counts\": [2, 1]},"),
      replace("mpm.json", "ED2Q4", "ED2Q8")},
     {},
     R"(accepted
mpm.json:6:18: warning: corner nodes of ED2Q8 have masses of zero or below, with which waves in a solid grow instead of passing [/mesh/cell_type]
      "cell_type": "ED2Q8",
                   ^
  hint: ED2Q9 with "preset": "lahar" in analysis has no such nodes
)"},
    {"functions that reach beyond cells which are no boxes",
     {replace("mpm.json", "\"dt\"", "\"shape_functions\": \"gimp\", \"dt\""),
      replace("mesh.txt", "1 1\n2 1", "1 1.25\n2 1")},
     {},
     R"(mpm.json:19:60: error: "gimp" needs a mesh of equal boxes along the axes that fill a box [/analysis/shape_functions]
    "analysis": {"type": "MPMExplicit2D", "shape_functions": "gimp", "dt": 0.001, "nsteps": 10},
                                                             ^
  hint: give the mesh as "structured", or a file of such cells with "isoparametric": false
)"},
    {"domains with corners on cells which are no boxes",
     {replace("mpm.json", "\"dt\"", "\"shape_functions\": \"cpdi2\", \"dt\""),
      replace("mesh.txt", "1 1\n2 1", "1 1.25\n2 1")},
     {},
     R"(mpm.json:19:60: error: "cpdi2" needs a mesh of equal boxes along the axes that fill a box [/analysis/shape_functions]
    "analysis": {"type": "MPMExplicit2D", "shape_functions": "cpdi2", "dt": 0.001, "nsteps": 10},
                                                             ^
  hint: give the mesh as "structured", or a file of such cells with "isoparametric": false
)"},
    {"moments of functions that have none",
     {replace("mpm.json", "\"mesh\": \"mesh.txt\",", "\"structured\": {\"cell_size\": 1, \"counts\": [2, 1]},"),
      replace("mpm.json", "ED2Q4", "ED2Q9"),
      replace("mpm.json", "\"dt\"", "\"velocity_update\": \"apic\", \"dt\"")},
     {},
     R"(mpm.json:19:60: error: 'velocity_update': "apic" does not go together with ED2Q9 cells: their functions reproduce second moments, so that particles have none [/analysis/velocity_update]
    "analysis": {"type": "MPMExplicit2D", "velocity_update": "apic", "dt": 0.001, "nsteps": 10},
                                                             ^
  hint: take "tpic", which gives nodes the velocity gradient, or linear elements
)"},
    {"functions that reach beyond cells of several sizes",
     {replace("mpm.json", "\"ED2Q4\"", "\"ED2Q4P2B\""),
      replace("mesh.txt", "2 0\n0 1\n1 1\n2 1", "3 0\n0 1\n1 1\n3 1")},
     {},
     R"(mpm.json:6:18: error: "ED2Q4P2B" needs a mesh of equal boxes along the axes that fill a box [/mesh/cell_type]
      "cell_type": "ED2Q4P2B",
                   ^
  hint: give the mesh as "structured", or a file of such cells with "isoparametric": false
)"},
    {"functions that are named twice",
     {replace("mpm.json", "\"ED2Q4\"", "\"ED2Q4P2B\""),
      replace("mpm.json", "\"dt\"", "\"shape_functions\": \"gimp\", \"dt\"")},
     {},
     R"(mpm.json:19:60: error: 'shape_functions' and the cell_type ED2Q4P2B say both what the functions are [/analysis/shape_functions]
    "analysis": {"type": "MPMExplicit2D", "shape_functions": "gimp", "dt": 0.001, "nsteps": 10},
                                                             ^
  hint: leave one of them out
)"},
    {"GIMP cells without the nodes around them",
     {replace("mpm.json", "\"ED2Q4\"", "\"ED2Q16G\"")},
     {},
     R"(mesh.txt:9:8: error: a node id is missing
  0 1 4 3
         ^
mesh.txt:10:8: error: a node id is missing
  1 2 5 4
         ^
)"},
    {"GIMP cells whose nodes are not around them",
     {replace("mpm.json", "\"ED2Q4\"", "\"ED2Q16G\""),
      replace("mesh.txt", "0 1 4 3\n1 2 5 4", "0 1 4 3 0 0 0 0 0 0 0 0 0 0 0 0\n1 2 5 4 0 0 0 0 0 0 0 0 0 0 0 0")},
     {},
     R"(mpm.json:6:18: error: cell 0 and the nodes around it are no grid of 16 nodes [/mesh/cell_type]
      "cell_type": "ED2Q16G",
                   ^
  hint: the nodes of a GIMP cell are its corners and all around it, one cell away
)"},
  };
  check(table, 36);
}
