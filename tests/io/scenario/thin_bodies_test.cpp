// Warnings of rigid bodies that are thin between material on both of their sides.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <string>

#include "io/scenario/scenario.h"
#include "tests/io/base/thread_team.h"
#include "tests/io/scenario/said.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// Material left and right of a wall, in cells of 0.1 m.
struct Walled {
  std::string wall = R"({"box": {"min": [1, -1], "max": [1.1, 9]}})";
  std::string particles = R"(
    {"generator": {"type": "region", "per_cell": 2, "material": "left",
                   "region": {"box": {"min": [0, 0], "max": [1, 1]}}}},
    {"generator": {"type": "region", "per_cell": 2, "material": "right", "pset": "right",
                   "region": {"box": {"min": [1.1, 0], "max": [2, 1]}}}})";
  std::string analysis = "";
};

std::string text_of(const Walled& c) {
  const auto soil = [](const char* name) {
    return fmt::format(R"({{"name": "{}", "type": "LinearElastic", "density": 2000,
                            "youngs_modulus": 1e7, "poisson_ratio": 0.3}})",
                       name);
  };
  return fmt::format(R"({{"mesh": {{"structured": {{"cell_size": 0.1, "extent": [3, 2]}}}},
    "geometry": {{"ground": {{"points": [[-1, 0.5], [4, 0.3]]}}}},
    "materials": [{}, {}],
    "rigid_bodies": [{{"name": "wall", "region": {}}}],
    "particles": [{}],
    "analysis": {{{} "nsteps": 1}}}})",
                     soil("left"), soil("right"), c.wall, c.particles, c.analysis);
}

bool warns(const Walled& c, const std::string& thickness = "") {
  const std::string said = warnings_of(read_scenario_text(text_of(c), ""));
  INFO(said);
  return says(said, "the rigid body 'wall' is " + thickness) &&
         says(said, "cells thick where material lies on both of its sides");
}

/// A box in all of the mesh but a body, which is between other places then.
std::string around(const std::string& body) {
  return R"({"generator": {"type": "region", "per_cell": 2, "material": "left", "region":
    {"difference": [{"box": {"min": [0, 0], "max": [3, 2]}}, )" +
         body + "]}}}";
}

}  // namespace

TEST_CASE("a rigid body thinner than functions reach is warned of between material") {
  CHECK(warns({}, "1 cells thick"));
  CHECK(warns({.wall = R"({"box": {"min": [1, -1], "max": [1.04, 9]}})"}, "0.4 cells thick"));
  CHECK_FALSE(warns({.analysis = R"("shape_functions": "gimp",)"}));
  CHECK_FALSE(warns({.analysis = R"("shape_functions": "element",)"}));
  const std::string half = R"({"box": {"min": [1, -1], "max": [1.05, 9]}})";
  CHECK(
      warns({.wall = half, .particles = around(half), .analysis = R"("shape_functions": "gimp",)"},
            "0.5 cells thick"));
  // A plate at an angle.
  const std::string plate = R"({"polygon": {"points":
    [[0.5, 0.5], [2.5, 1.1], [2.5, 1.2], [0.5, 0.6]]}})";
  CHECK(warns({.wall = plate, .particles = around(plate)}, "0.9"));
}

TEST_CASE("each member of a team sees material on both sides of a thin rigid body") {
  run_team(3, [&](const Team& team) {
    ScenarioOptions options;
    options.team = &team;
    CHECK(says(warnings_of(read_scenario_text(text_of({}), "", options)),
               "the rigid body 'wall' is 1 cells thick"));
  });
}

TEST_CASE("a rigid body with material on one side, or thick between both, is not warned of") {
  const std::string left = R"({"generator": {"type": "region", "per_cell": 2, "material": "left",
    "region": {"box": {"min": [0, 0], "max": [1, 1]}}}})";
  CHECK_FALSE(warns({.particles = left}));
  const std::string thick = R"({"box": {"min": [1, 0.5], "max": [1.3, 9]}})";
  CHECK_FALSE(warns({.wall = thick, .particles = around(thick)}));
  const std::string disc = R"({"sphere": {"centre": [1.5, 1], "radius": 0.4}})";
  CHECK_FALSE(warns({.wall = disc, .particles = around(disc)}));
  CHECK_FALSE(
      warns({.wall = R"({"below": "ground"})", .particles = around(R"({"below": "ground"})")}));
  const std::string corner = R"({"difference": [{"box": {"min": [1, 0.5], "max": [2, 1.5]}},
                                                {"box": {"min": [1.5, 1], "max": [3, 3]}}]})";
  CHECK_FALSE(warns({.wall = corner, .particles = around(corner)}));
}

TEST_CASE("bodies in contact have velocities of their own on both sides of a thin rigid body") {
  CHECK_FALSE(warns({.analysis = R"("interface": true, "contact": {"friction": 0},)"}));
  CHECK_FALSE(warns({.analysis = R"("interface": true,
                                    "contact": {"friction": 0, "bodies": [{"pset": "right"}]},)"}));
}
