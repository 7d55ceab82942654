// The total force of tractions on sets whose particles lie behind each other.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include "tests/io/base/team_folder.h"
#include "tests/io/base/thread_team.h"
#include "tests/io/scenario/said.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// Ground below a line from (0, `left`) to (2, `right`), with a traction on a set of particles.
std::string loaded(const std::string& set, double left, double right,
                   const std::string& dir = "y") {
  return fmt::format(R"({{"mesh": {{"structured": {{"cell_size": 0.1, "counts": [20, 20]}}}},
    "geometry": {{"top": {{"points": [[0, {}], [2, {}]]}},
                  "row": {{"surface": "top", "lower_by": 0.05}}}},
    "sets": {{"particles": {{"loaded": {}}}}},
    "materials": [{{"name": "clay", "type": "LinearElastic", "density": 2000,
                    "youngs_modulus": 1e7, "poisson_ratio": 0.3}}],
    "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": "clay",
                                   "region": {{"below": "top"}}}}}}],
    "external_loading_conditions": {{"particle_surface_traction":
        [{{"pset": "loaded", "dir": "{}", "traction": -1000}}]}},
    "analysis": {{"nsteps": 1}}}})",
                     left, right, set, dir);
}

const std::string row = R"({"between": ["row", "top"]})";

/// The force of all tractions [N per m of depth], of particles that are parts of 0.05 m.
double force_of(const Scenario& scenario) {
  double force = 0;
  for (const auto& t : std::get<Model<2>>(scenario.model).tractions)
    force += t.traction * 0.05 * static_cast<double>(t.particles.size());
  return force;
}
double force_of(const std::string& text) {
  return force_of(read_scenario_text(text, ""));
}
std::string said_of(const std::string& text) {
  return warnings_of(read_scenario_text(text, ""));
}

}  // namespace

TEST_CASE("a traction on a slope is that on its plan, however its particles lie") {
  CHECK(force_of(loaded(row, 1, 1)) == doctest::Approx(-2000));
  CHECK(force_of(loaded(row, 0.93, 0.93)) == doctest::Approx(-2000));
  for (const double right : {1.02, 1.05, 1.2, 1.6, 1.8}) {
    CAPTURE(right);
    const std::string slope = loaded(row, 1, right);
    CHECK(force_of(slope) == doctest::Approx(-2000));
    CHECK(force_of(loaded(row, 1, right, "x")) == doctest::Approx(-2000));
    CHECK_FALSE(says(said_of(slope), "lie behind"));
  }
}

TEST_CASE("the load of a slope is the same on any ranks") {
  const Folder folder;
  folder.write("case.json", loaded(row, 1, 1.6));
  std::vector<double> force(3, 0.0);
  run_team(3, [&](const Team& team) {
    const Scenario s = read_scenario(folder.path / "case.json", {{}, false, &team});
    force[static_cast<std::size_t>(team.index())] = force_of(s);
  });
  CHECK(force[0] + force[1] + force[2] == doctest::Approx(-2000));
}

TEST_CASE("a traction on surfaces that face two ways is that on one of them, and is warned of") {
  const std::string corner = R"({"union": [{"box": {"min": [1.95, 0], "max": [2, 1]}},
                                           {"box": {"min": [0, 0.95], "max": [2, 1]}}]})";
  const std::string text = loaded(corner, 1, 1);
  CHECK(force_of(text) == doctest::Approx(-2000));
  CHECK(says(said_of(text),
             "19 of the 59 particles of this traction lie behind others along y, up to 20 in a "
             "row, and get none: it is -2000 N/m on 2 m, the surface as seen along y"));
}

TEST_CASE("the load on the upper half of a disc's rim is that on its diameter") {
  for (const double thickness : {0.03, 0.05}) {
    CAPTURE(thickness);
    const std::string rim = fmt::format(
        R"({{"intersection": [{{"half_space": {{"point": [0, 1], "normal": [0, -1]}}}},
             {{"difference": [{{"sphere": {{"centre": [1, 1], "radius": 0.5}}}},
                              {{"sphere": {{"centre": [1, 1], "radius": {}}}}}]}}]}})",
        0.5 - thickness);
    std::string text = loaded(rim, 1, 1);
    const std::string below = R"({"below": "top"})";
    text.replace(text.find(below), below.size(),
                 R"({"sphere": {"centre": [1, 1], "radius": 0.5}}, "cut_cells": "exact")");
    CHECK(force_of(text) == doctest::Approx(-1000));
    CHECK(says(said_of(text), "up to 4 in a row, and get none: it is -1000 N/m on 1 m"));
  }
}

namespace {

/// A block of cells of 0.2 m by 0.1 m from (0.4, 0) to (1.4, `top`), with a traction on a set.
std::string strip(const std::string& box, const std::string& dir, double top = 0.6) {
  return fmt::format(R"({{"mesh": {{"structured": {{"cell_size": [0.2, 0.1], "counts": [10, 10]}}}},
    "sets": {{"particles": {{"loaded": {{"box": {{{}}}}}}}}},
    "materials": [{{"name": "clay", "type": "LinearElastic", "density": 2000,
                    "youngs_modulus": 1e7, "poisson_ratio": 0.3}}],
    "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": "clay",
                                   "region": {{"box": {{"min": [0.4, 0], "max": [1.4, {}]}}}}}}}}],
    "external_loading_conditions": {{"particle_surface_traction":
        [{{"pset": "loaded", "dir": "{}", "traction": 1000}}]}},
    "analysis": {{"nsteps": 1}}}})",
                     box, top, dir);
}
std::string load_of(const std::string& text) {
  return read_scenario_text(text, "").loads.at(0);
}

}  // namespace

TEST_CASE("a strip of one particle is loaded on the side at which the body ends") {
  const std::string top = R"("min": [0.8, 0.55], "max": [0.9, 0.6])",
                    right = R"("min": [1.3, 0.25], "max": [1.4, 0.3])",
                    corner = R"("min": [1.3, 0.55], "max": [1.4, 0.6])";
  const std::string wide = "loaded: 100 N/m along x (1000 Pa on 0.1 m)",
                    high = "loaded: 50 N/m along x (1000 Pa on 0.05 m)";
  CHECK(load_of(strip(top, "x")) == wide);
  CHECK(load_of(strip(right, "x")) == high);
  CHECK(load_of(strip(top, "y")) == "loaded: 100 N/m along y (1000 Pa on 0.1 m)");
  CHECK(load_of(strip(right, "y")) == "loaded: 50 N/m along y (1000 Pa on 0.05 m)");
  for (const std::string& set : {top, right})
    for (const char* dir : {"x", "y"}) CHECK(said_of(strip(set, dir)) == "");
  CHECK(load_of(strip(corner, "x")) == high);
  CHECK(says(said_of(strip(corner, "x")),
             "the particles of this traction are one layer along x and along y: it acts on 0.05 "
             "m across x; the surface across y would have 0.1 m"));
}

TEST_CASE("what tractions and forces at nodes are in all is said") {
  std::string text = loaded(row, 1, 1);
  CHECK(load_of(text) == "loaded: -2000 N/m along y (-1000 Pa on 2 m)");
  const std::string list = R"("particle_surface_traction":)";
  text.insert(text.find(list),
              R"("concentrated_nodal_forces": [{"nset": "side", "dir": "x", "force": -3}], )");
  text.insert(text.find(R"("particles": {"loaded")"),
              R"("nodes": {"side": {"box": {"min": [0, 0], "max": [0, 0.5]}}}, )");
  const auto loads = read_scenario_text(text, "").loads;
  REQUIRE(loads.size() == 2);
  CHECK(loads[1] == "side: -18 N/m along x (-3 N/m at each of 6 nodes)");
  text.insert(text.find(R"("analysis")"),
              R"("math_functions": [{"name": "ramp", "type": "Linear", "xvalues": [0, 1],
                                     "fxvalues": [0, 1]}], )");
  const std::string traction = R"("traction": -1000)";
  text.insert(text.find(traction), R"("math_function_id": "ramp", )");
  CHECK(load_of(text) == "loaded: -2000 N/m along y (-1000 Pa on 2 m), times a function of time");
}
