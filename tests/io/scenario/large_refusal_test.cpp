// Mistakes in scenarios of large meshes are said at once, not after a search of all cells.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <vector>

#include "io/base/problems.h"
#include "tests/io/scenario/said.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// A column of so many cells, whose title is a number, and a set that does not exist.
std::string column(const std::string& length) {
  return R"({"title": 0.6, "mesh": {"structured": {"cell_size": 1, "extent": [1, )" + length +
         R"(]},
  "boundary_conditions": {"velocity_constraints": [{"nset": "flor", "dir": "y", "velocity": 0}]}},
  "sets": {"nodes": {"floor": {"half_space": {"point": [0, 0], "normal": [0, 1]}}}},
  "particles": [{"generator": {"type": "region", "per_cell": 1, "material": 0,
                               "region": {"box": {"min": [0, 0], "max": [1, 2]}}}}],
  "materials": [{"type": "LinearElastic", "density": 1, "youngs_modulus": 1, "poisson_ratio": 0}],
  "analysis": {"dt": 1e-3, "nsteps": 1}})";
}

struct Said {
  std::string problems;
  std::vector<std::string> phases;
};

Said said_of(const std::string& text) {
  Said said;
  ScenarioOptions options;
  options.phase = [&](const std::string& phase) { said.phases.push_back(phase); };
  said.problems = "accepted";
  try {
    read_scenario_text(text, ".", options);
  } catch (const InputError& error) {
    said.problems = format_problems(error.problems());
  }
  return said;
}

bool searched_sets(const Said& said) {
  return std::find(said.phases.begin(), said.phases.end(), "sets") != said.phases.end();
}

}  // namespace

TEST_CASE("all mistakes of a scenario are found before it is refused") {
  const Said said = said_of(column("1000"));
  CHECK(says(said.problems, "'title' must be a text"));
  CHECK(says(said.problems, "flor"));
  CHECK(searched_sets(said));
}

TEST_CASE("of a scenario with very many cells those that are known are said, before the search") {
  const Said said = said_of(column("1e9"));
  CHECK(says(said.problems, "'title' must be a text"));
  CHECK_FALSE(says(said.problems, "flor"));
  CHECK_FALSE(searched_sets(said));
}
