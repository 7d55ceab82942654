// Warnings of single rows of nodes within the material: supports that do not hold it. And silence
// for those that do what they are meant for.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <string>

#include "io/base/problems.h"
#include "io/scenario/scenario.h"
#include "tests/io/scenario/said.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// Soil in the left half of a mesh of two dimensions, on a floor.
struct Held {
  std::string conditions, analysis = "";
};

std::string said_of(const Held& c) {
  const Scenario s = read_scenario_text(
      fmt::format(R"({{"mesh": {{"structured": {{"cell_size": 0.5, "extent": [4, 4]}},
      "boundary_conditions": {{{}}}}},
    "sets": {{"nodes": {{
      "row": {{"box": {{"min": [2, 0], "max": [2, 4]}}}},
      "two rows": {{"box": {{"min": [2, 0], "max": [2.5, 4]}}}},
      "far": {{"box": {{"min": [3, 0], "max": [3, 4]}}}},
      "end": {{"box": {{"min": [4, 0], "max": [4, 4]}}}},
      "floor": {{"half_space": {{"point": [0, 0], "normal": [0, 1]}}}},
      "behind": {{"half_space": {{"point": [2, 0], "normal": [-1, 0]}}}}}}}},
    "materials": [{{"name": "soil", "density": 2000, "type": "LinearElastic",
                    "youngs_modulus": 1e7, "poisson_ratio": 0.3}}],
    "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": "soil",
                     "region": {{"box": {{"min": [0, 0], "max": [2, 2]}}}}}}}}],
    "external_loading_conditions": {{"gravity": [0, -9.81]}},
    "analysis": {{"nsteps": 1{}}}}})",
                  c.conditions, c.analysis),
      "");
  return format_problems(s.warnings, "warning");
}

std::string holding(const std::string& nset, const std::string& dir) {
  return fmt::format(R"("velocity_constraints": [{{"nset": "floor", "dir": "y", "velocity": 0}},
                          {{"nset": "{}", "dir": "{}", "velocity": 0}}])",
                     nset, dir);
}

}  // namespace

TEST_CASE("a row of nodes inside of the mesh does not hold material with smooth functions") {
  const std::string text =
      "5 nodes, at x = 2, do not hold material along x: they are one row inside of the mesh, and "
      "functions of the free nodes behind it reach the material, too";
  const std::string said = said_of({.conditions = holding("row", "x")});
  CHECK(says(said, text));
  CHECK(says(said, "[/mesh/boundary_conditions/velocity_constraints/1]"));
  CHECK(says(said,
             "hint: hold all nodes behind it as well (a half space or a box in place of a plane), "
             "let the mesh end there, or take \"shape_functions\": \"element\""));
  const std::string wall = said_of({.conditions = R"("walls": [{"nset": "floor", "normal": [0, 1]},
                                          {"nset": "row", "normal": [-1, 0]}])"});
  CHECK(says(wall, text));
  CHECK(says(wall, "[/mesh/boundary_conditions/walls/1]"));
}

TEST_CASE("single rows of nodes are found along each axis in space, tips of terrain are none") {
  const auto said = [](const char* row) {
    const Scenario s = read_scenario_text(
        fmt::format(R"({{"mesh": {{"structured": {{"cell_size": 1, "counts": [12, 3, 6]}},
        "boundary_conditions": {{
          "velocity_constraints": [{{"nset": "row", "dir": "z", "velocity": 0}}]}}}},
      "sets": {{"nodes": {{"row": {}}}}},
      "materials": [{{"density": 2000, "type": "LinearElastic", "youngs_modulus": 1e7,
                      "poisson_ratio": 0.3}}],
      "particles": [{{"generator": {{"type": "region", "per_cell": 1, "material": 0}}}}],
      "external_loading_conditions": {{"gravity": [0, 0, -9.81]}},
      "analysis": {{"nsteps": 1}}}})",
                    row),
        "");
    return format_problems(s.warnings, "warning");
  };
  CHECK(says(said(R"({"box": {"min": [0, 0, 2], "max": [12, 3, 2]}})"),
             "52 nodes, at z = 2, do not hold material along z"));
  // One node of 157 stands alone.
  CHECK_FALSE(says(said(R"({"union": [{"box": {"min": [0, 0, 0], "max": [12, 3, 2]}},
                                      {"box": {"min": [3, 1, 4], "max": [3, 1, 4]}}]})"),
                   "do not hold"));
}

TEST_CASE("supports that hold are not warned of as single rows") {
  const auto warns = [](const Held& c) { return says(said_of(c), "do not hold material"); };
  CHECK_FALSE(warns({.conditions = holding("row", "y")}));  // each holds the next along y
  for (const char* set : {"two rows", "far", "end", "behind"})
    CHECK_FALSE(warns({.conditions = holding(set, "x")}));
  CHECK_FALSE(warns({.conditions = R"("walls": [{"nset": "floor", "normal": [0, 1]},
                                                {"nset": "behind", "normal": [-1, 0]}])"}));
  const std::string elements = R"(, "shape_functions": "element")";
  CHECK_FALSE(warns({.conditions = holding("row", "x"), .analysis = elements}));
  CHECK_FALSE(warns({.conditions = R"("velocity_constraints": [
                       {"nset_id": -1, "dir": "x", "velocity": 0}])"}));
}
