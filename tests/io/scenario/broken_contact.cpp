#include <doctest/doctest.h>

#include "tests/io/scenario/broken_case.h"

using namespace lahar::broken;

namespace {

Edit analysis(const std::string& text) {
  return replace("mpm.json", "\"dt\"", text + ", \"dt\"");
}

}  // namespace

// clang-format off
TEST_CASE("impossible bodies are refused with what is allowed") {
  const std::vector<Entry> table = {
    {"contact without an interface",
     {analysis(R"("contact": {"friction": 0.3})")},
     {},
     R"(mpm.json:19:52: error: 'contact' needs "interface": true [/analysis/contact]
    "analysis": {"type": "MPMExplicit2D", "contact": {"friction": 0.3}, "dt": 0.001, "nsteps": 10},
                                                     ^
  hint: or leave it out
)"},
    {"bodies of nothing",
     {analysis(R"("interface": true, "contact": {"friction": -1, "bodies": [{}, {"material": 0, "pset_id": 3}, {"pset_id": 4}, {"material": "x"}]})")},
     {},
     R"(mpm.json:19:84: error: 'friction' must be at least 0, found -1 [/analysis/contact/friction]
  analysis": {"type": "MPMExplicit2D", "interface": true, "contact": {"friction": -1, "bodies": [{}, {"material": 0, "pset_id": 3}, {"pset_id": 4}, {"material": "
                                                                                  ^
mpm.json:19:99: error: a body needs either 'material' or 'pset' [/analysis/contact/bodies/0]
  pe": "MPMExplicit2D", "interface": true, "contact": {"friction": -1, "bodies": [{}, {"material": 0, "pset_id": 3}, {"pset_id": 4}, {"material": "x"}]}, "dt": 0.
                                                                                  ^
  hint: material: all particles of that material; pset: the particles of a set
mpm.json:19:103: error: a body needs either 'material' or 'pset' [/analysis/contact/bodies/1]
   "MPMExplicit2D", "interface": true, "contact": {"friction": -1, "bodies": [{}, {"material": 0, "pset_id": 3}, {"pset_id": 4}, {"material": "x"}]}, "dt": 0.001,
                                                                                  ^
  hint: material: all particles of that material; pset: the particles of a set
mpm.json:19:146: error: there is no particle set 4 [/analysis/contact/bodies/2/pset_id]
  ct": {"friction": -1, "bodies": [{}, {"material": 0, "pset_id": 3}, {"pset_id": 4}, {"material": "x"}]}, "dt": 0.001, "nsteps": 10},
                                                                                  ^
  hint: particle sets: 3
mpm.json:19:163: error: there is no material named 'x' [/analysis/contact/bodies/3/material]
   -1, "bodies": [{}, {"material": 0, "pset_id": 3}, {"pset_id": 4}, {"material": "x"}]}, "dt": 0.001, "nsteps": 10},
                                                                                  ^
  hint: names: 0
)"},
  };
  check(table, 2);
}
