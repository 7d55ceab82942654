#include <doctest/doctest.h>

#include "broken_case.h"

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
     R"()"},
    {"friction without its keys",
     {conditions(R"("friction_constraints": [{"nset_id": 0}, {"file": "friction.txt", "dir": 1}])"),
      write("friction.txt", "0 1 -1 0.3\n")},
     {},
     R"()"},
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
     R"()"},
    {"a bad file of angles",
     {conditions(R"("nodal_euler_angles": "angles.txt")"),
      write("angles.txt", R"(0 0.5 0
9 0.5 0
1 0.5
2 0.5 0 1
0 0.1 0
)")},
     {},
     R"()"},
    {"no file of angles",
     {conditions(R"("nodal_euler_angles": "angles.txt")")},
     {},
     R"()"},
  };
  check(table, 5);
}
