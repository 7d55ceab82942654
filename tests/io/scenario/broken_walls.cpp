#include <doctest/doctest.h>

#include "tests/io/scenario/broken_case.h"

using namespace lahar::broken;

namespace {

/// More boundary conditions beside the velocity constraints.
Edit conditions(const std::string& text) {
  const std::string velocity =
      "\"velocity_constraints\": [{\"nset_id\": 0, \"dir\": 1, \"velocity\": 0.0}]";
  return replace("mpm.json", velocity, velocity + ",\n      " + text);
}

}  // namespace

// clang-format off
TEST_CASE("friction and rotated nodes are refused with what is allowed") {
  const std::vector<Entry> table = {
    {"friction with impossible values",
     {conditions(R"("friction_constraints": [
        {"nset_id": 0, "dir": 2, "sign_n": 1, "friction": 0.3},
        {"nset_id": 0, "dir": 1, "sign_n": 0, "friction": 0.3},
        {"nset_id": 7, "dir": 1, "sign_n": -1, "friction": -0.3}])")},
     {},
     R"(mpm.json:10:31: error: 'dir' must be below 2 in two dimensions, found 2 [/mesh/boundary_conditions/friction_constraints/0/dir]
          {"nset_id": 0, "dir": 2, "sign_n": 1, "friction": 0.3},
                                ^
mpm.json:11:44: error: 'sign_n' must be 1 or -1, found 0 [/mesh/boundary_conditions/friction_constraints/1/sign_n]
          {"nset_id": 0, "dir": 1, "sign_n": 0, "friction": 0.3},
                                             ^
  hint: the sign of the direction that points out of the body: -1 for a floor below it
mpm.json:12:21: error: there is no node set 7 [/mesh/boundary_conditions/friction_constraints/2/nset_id]
          {"nset_id": 7, "dir": 1, "sign_n": -1, "friction": -0.3}]
                      ^
  hint: node sets: 0
mpm.json:12:60: error: 'friction' must be at least 0, found -0.3 [/mesh/boundary_conditions/friction_constraints/2/friction]
          {"nset_id": 7, "dir": 1, "sign_n": -1, "friction": -0.3}]
                                                             ^
)"},
    {"springs with impossible values",
     {conditions(R"("spring_constraints": [
        {"nset_id": 0, "dir": 1, "damping": -1},
        {"nset_id": 0, "dir": 2, "stiffness": 5}])")},
     {},
     R"(mpm.json:10:9: error: 'stiffness' is missing in a spring constraint [/mesh/boundary_conditions/spring_constraints/0]
          {"nset_id": 0, "dir": 1, "damping": -1},
          ^
  hint: stiffness [N/m]: stiffness of the spring at each node
mpm.json:10:45: error: 'damping' must be at least 0 [N s/m], found -1 [/mesh/boundary_conditions/spring_constraints/0/damping]
          {"nset_id": 0, "dir": 1, "damping": -1},
                                              ^
mpm.json:11:31: error: 'dir' must be below 2 in two dimensions, found 2 [/mesh/boundary_conditions/spring_constraints/1/dir]
          {"nset_id": 0, "dir": 2, "stiffness": 5}]
                                ^
)"},
    {"absorbing boundaries with impossible values",
     {conditions(R"("absorbing_constraints": [
        {"nset_id": 0, "dir": 0.5, "delta": 0.1, "h_min": 0, "position": "side"},
        {"nset_id": 7, "dir": 1, "delta": 0.1, "h_min": 1, "a": 2, "position": "face"}])")},
     {},
     R"(mpm.json:10:31: error: 'dir' must be 0, 1, 2, "x", "y" or "z", found number 0.5 [/mesh/boundary_conditions/absorbing_constraints/0/dir]
          {"nset_id": 0, "dir": 0.5, "delta": 0.1, "h_min": 0, "position": "side"},
                                ^
mpm.json:10:59: error: 'h_min' must be greater than 0 [m], found 0 [/mesh/boundary_conditions/absorbing_constraints/0/h_min]
          {"nset_id": 0, "dir": 0.5, "delta": 0.1, "h_min": 0, "position": "side"},
                                                            ^
mpm.json:10:74: error: 'position' must be one of "corner", "edge", "face", found "side" [/mesh/boundary_conditions/absorbing_constraints/0/position]
          {"nset_id": 0, "dir": 0.5, "delta": 0.1, "h_min": 0, "position": "side"},
                                                                           ^
mpm.json:11:21: error: there is no node set 7 [/mesh/boundary_conditions/absorbing_constraints/1/nset_id]
          {"nset_id": 7, "dir": 1, "delta": 0.1, "h_min": 1, "a": 2, "position": "face"}]
                      ^
  hint: node sets: 0
mpm.json:11:43: error: 'delta' must be at least h_min / (2 a) and h_min / (2 b), 0.5 m here, found 0.1 [/mesh/boundary_conditions/absorbing_constraints/1/delta]
          {"nset_id": 7, "dir": 1, "delta": 0.1, "h_min": 1, "a": 2, "position": "face"}]
                                            ^
  hint: springs are stiffer than the material in a thinner layer
mpm.json:11:80: error: 'position': "face" is for three dimensions [/mesh/boundary_conditions/absorbing_constraints/1/position]
          {"nset_id": 7, "dir": 1, "delta": 0.1, "h_min": 1, "a": 2, "position": "face"}]
                                                                                 ^
  hint: in two dimensions nodes are at an edge, and the first and last at a corner
)"},
    {"accelerations beside velocities, and with impossible keys",
     {conditions(R"("acceleration_constraints": [
        {"nset_id": 0, "dir": 1, "acceleration": 1},
        {"nset_id": 0, "dir": 0},
        {"file": "a.txt", "math_function_id": 0}])"),
      write("a.txt", "0 0 1\n9 0 1\n")},
     {},
     R"(mpm.json:10:9: error: node 0 has a prescribed velocity in direction 1 as well [/mesh/boundary_conditions/acceleration_constraints/0]
          {"nset_id": 0, "dir": 1, "acceleration": 1},
          ^
  hint: prescribe one of them
mpm.json:11:9: error: 'acceleration' is missing [/mesh/boundary_conditions/acceleration_constraints/1]
          {"nset_id": 0, "dir": 0},
          ^
mpm.json:12:47: error: 'math_function_id' does not go together with 'file' [/mesh/boundary_conditions/acceleration_constraints/2/math_function_id]
          {"file": "a.txt", "math_function_id": 0}]
                                                ^
  hint: accelerations of a file are constant
a.txt:2:1: error: a node id must be an integer from 0 to 5, found '9'
  9 0 1
  ^
)"},
    {"friction without its keys",
     {conditions(R"("friction_constraints": [{"nset_id": 0}, {"file": "friction.txt", "dir": 1}])"),
      write("friction.txt", "0 1 -1 0.3\n")},
     {},
     R"(mpm.json:9:32: error: 'dir' is missing [/mesh/boundary_conditions/friction_constraints/0]
        "friction_constraints": [{"nset_id": 0}, {"file": "friction.txt", "dir": 1}]
                                 ^
mpm.json:9:32: error: 'sign_n' is missing [/mesh/boundary_conditions/friction_constraints/0]
        "friction_constraints": [{"nset_id": 0}, {"file": "friction.txt", "dir": 1}]
                                 ^
mpm.json:9:32: error: 'friction' is missing [/mesh/boundary_conditions/friction_constraints/0]
        "friction_constraints": [{"nset_id": 0}, {"file": "friction.txt", "dir": 1}]
                                 ^
mpm.json:9:80: error: 'dir' does not go together with 'file' [/mesh/boundary_conditions/friction_constraints/1/dir]
        "friction_constraints": [{"nset_id": 0}, {"file": "friction.txt", "dir": 1}]
                                                                                 ^
  hint: the file has a node, a direction and a value in each row
)"},
    {"a bad file of frictions",
     {conditions(R"("friction_constraints": [{"file": "friction.txt"}])"),
      write("friction.txt", R"(0 1 -1 0.3
1 1 0 0.3
6 1 -1 0.3
2 2 -1 0.3
3 1 -1 -0.3
4 1 -1
5 1 -1 0.3 4
)")},
     {},
     R"(friction.txt:2:5: error: sign_n must be 1 or -1, found 0
  1 1 0 0.3
      ^
  hint: the sign of the direction that points out of the body: -1 for a floor below it
friction.txt:3:1: error: a node id must be an integer from 0 to 5, found '6'
  6 1 -1 0.3
  ^
friction.txt:4:3: error: the direction must be an integer from 0 to 1, found '2'
  2 2 -1 0.3
    ^
friction.txt:5:8: error: the friction coefficient must be at least 0, found -0.3
  3 1 -1 -0.3
         ^
friction.txt:6:7: error: the friction coefficient is missing
  4 1 -1
        ^
friction.txt:7:12: error: unexpected '4' at the end of the row
  5 1 -1 0.3 4
             ^
)"},
    {"a bad file of angles",
     {conditions(R"("nodal_euler_angles": "angles.txt")"),
      write("angles.txt", R"(0 0.5 0
9 0.5 0
1 0.5
2 0.5 0 1 7
0 0.1 0
)")},
     {},
     R"(angles.txt:2:1: error: a node id must be an integer from 0 to 5, found '9'
  9 0.5 0
  ^
angles.txt:3:6: error: beta is missing
  1 0.5
       ^
angles.txt:4:11: error: unexpected '7' at the end of the row
  2 0.5 0 1 7
            ^
angles.txt:5:1: error: node 0 occurs more than once
  0 0.1 0
  ^
)"},
    {"no file of angles",
     {conditions(R"("nodal_euler_angles": "angles.txt")")},
     {},
     R"(mpm.json:9:29: error: file 'angles.txt' does not exist [/mesh/boundary_conditions/nodal_euler_angles]
        "nodal_euler_angles": "angles.txt"
                              ^
  hint: file names are relative to the scenario's folder
)"},
  };
  check(table, 8);
}
