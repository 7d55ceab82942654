// Warnings of loads that do not act: those that begin at zero again in a stage, forces on nodes
// without material, and nodes that material leaves. And silence where they do.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <string>

#include "io/scenario/scenario.h"
#include "tests/io/scenario/said.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// Soil in the lower left quarter of a mesh, with loads; `stage` is what its second stage changes.
struct Loaded {
  std::string loads, stage = "", functions = "element", values = "[0, 1]";
};

std::string said_of(const Loaded& c, std::size_t stage = 0) {
  return warnings_of(read_scenario_text(
      fmt::format(R"({{"mesh": {{"structured": {{"cell_size": 0.5, "extent": [4, 4]}},
      "boundary_conditions": {{"velocity_constraints": [
        {{"nset": "floor", "dir": "y", "velocity": 0}}]}}}},
    "sets": {{"nodes": {{"floor": {{"half_space": {{"point": [0, 0], "normal": [0, 1]}}}},
                         "edge": {{"box": {{"min": [2, 0], "max": [2, 4]}}}},
                         "face": {{"box": {{"min": [2, 0], "max": [2, 2]}}}},
                         "far": {{"box": {{"min": [3.5, 0], "max": [3.5, 4]}}}}}},
              "particles": {{"top": {{"box": {{"min": [0, 1.75], "max": [2, 2]}}}}}}}},
    "materials": [{{"name": "soil", "density": 2000, "type": "LinearElastic",
                    "youngs_modulus": 1e7, "poisson_ratio": 0.3}}],
    "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": "soil",
                     "region": {{"box": {{"max": [2, 2]}}}}}}}}],
    "math_functions": [{{"name": "grow", "type": "Linear", "xvalues": [0, 1], "fxvalues": {}}}],
    "external_loading_conditions": {{{}}},
    "analysis": {{"nsteps": 1, "shape_functions": "{}"}},
    "stages": [{{"name": "rest"}}, {{"name": "go"{}}}]}})",
                  c.values, c.loads, c.functions, c.stage),
      "", {.overrides = {}, .stage = stage}));
}

std::string pushing(const std::string& nset) {
  return fmt::format(R"("concentrated_nodal_forces": [{{"nset": "{}", "dir": "x", "force": -10}}])",
                     nset);
}

/// A block in the left half of a mesh of cells of 0.5 m, 2 m high, with the motion of some nodes.
std::string said_of_motion(const std::string& motion, const std::string& analysis) {
  return warnings_of(read_scenario_text(
      fmt::format(R"({{"mesh": {{"structured": {{"cell_size": 0.5, "extent": [4, 4]}},
      "boundary_conditions": {{"{}": [{{{}}}]}}}},
    "sets": {{"nodes": {{"floor": {{"half_space": {{"point": [0, 0], "normal": [0, 1]}}}},
                         "above": {{"half_space": {{"point": [0, 2], "normal": [0, -1]}}}}}}}},
    "materials": [{{"name": "soil", "density": 2000, "type": "LinearElastic",
                    "youngs_modulus": 1e7, "poisson_ratio": 0.3}}],
    "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": "soil",
                     "region": {{"box": {{"max": [2, 2]}}}}}}}}],
    "math_functions": [{{"name": "swing", "type": "Linear",
                         "xvalues": [0, 0.1, 0.3, 0.4], "fxvalues": [0, 1, -1, 0]}}],
    "analysis": {{{}}}}})",
                  motion.find("displacement") == std::string::npos ? "velocity_constraints"
                                                                   : "displacement_constraints",
                  motion, analysis),
      ""));
}

}  // namespace

TEST_CASE("inflow whose velocity nothing holds is warned of where there is weight") {
  const auto read = [](const std::string& gravity, const std::string& held,
                       const std::string& velocity = "[3, 0]") {
    return read_scenario_text(
        fmt::format(R"({{"mesh": {{"structured": {{"cell_size": 0.5, "extent": [4, 4]}},
      "boundary_conditions": {{"velocity_constraints": [{}]}}}},
    "sets": {{"nodes": {{"inlet": {{"box": {{"min": [0, 0], "max": [0.5, 1]}}}}}},
              "cells": {{"inlet": {{"box": {{"min": [0, 0], "max": [0.5, 1]}}}}}}}},
    "materials": [{{"name": "water", "type": "Newtonian", "density": 1000, "bulk_modulus": 1e6,
                    "dynamic_viscosity": 1e-3}}],
    "particles": [{{"generator": {{"type": "inject", "cset": "inlet", "nparticles_per_dir": 2,
                                   "velocity": {}, "material": "water"}}}}],
    "external_loading_conditions": {{"gravity": {}}},
    "analysis": {{"end_time": 1, "locate_particles": false}}}})",
                    held, velocity, gravity),
        "");
  };
  const auto said = [&](auto... given) { return warnings_of(read(given...)); };
  const std::string free = "nothing holds the velocity in the cells of this inflow",
                    held = R"({"nset": "inlet", "dir": "x", "velocity": 3})";
  CHECK(says(said("[0, -10]", ""), free));
  CHECK_FALSE(says(said("[0, -10]", held), free));
  CHECK_FALSE(says(said("[0, 0]", ""), free));
  // Along all axes that the inflow has a velocity along.
  const auto hint = [&](const std::string& which) {
    const Scenario scenario = read("[0, -10]", which, "[3, -1]");
    for (const Problem& one : scenario.warnings)
      if (says(one.message, "in the cells of this inflow")) return one.hint;
    return std::string();
  };
  CHECK(says(hint(""), R"(with "dir": "x", "velocity": 3, and with "dir": "y", "velocity": -1,)"));
  CHECK(says(hint(held), R"(with "dir": "y", "velocity": -1,)"));
  CHECK(says(said("[0, -10]", held, "[3, -1]"),
             "nothing holds the velocity along y in the cells of this inflow"));
  CHECK(hint(held + R"(, {"nset": "inlet", "dir": "y", "velocity": -1})") == "");
}

TEST_CASE("nodes that push material out of their reach are warned of, with how far") {
  const std::string push = "push material by",
                    down = R"("nset": "above", "dir": "y", "velocity": -0.1)",
                    long_run = R"("end_time": 10)";
  CHECK(says(said_of_motion(down, long_run), "5 nodes at y = 2 push material by 1 m, 2 cells"));
  CHECK(says(said_of_motion(down, R"("dt": 1e-4, "nsteps": 100000)"), push));
  CHECK(says(said_of_motion(R"("nset": "above", "dir": "y", "displacement": -0.1)",
                            R"("mpm_scheme": "newmark", "dt": 1, "nsteps": 10)"),
             "5 nodes at y = 2 push material by 1 m, 2 cells"));
  CHECK_FALSE(says(said_of_motion(down, R"("end_time": 2)"), push));  // by less than half a cell
  CHECK_FALSE(says(said_of_motion(down + R"(, "math_function_id": "swing")", long_run), push));
  for (const char* other : {R"("nset": "above", "dir": "y", "velocity": 0.1)",  // it pulls
                            R"("nset": "floor", "dir": "x", "velocity": 0.1)",
                            R"("nset_id": -1, "dir": "y", "velocity": -0.1)"})
    CHECK_FALSE(says(said_of_motion(other, long_run), push));
}

TEST_CASE("how far nodes push is guessed by the first step where steps are adaptive") {
  // Waves have 82 m/s: half of what takes them through a cell of 0.5 m is 3.05 ms.
  const auto said = [](const std::string& end) {
    return said_of_motion(R"("nset": "above", "dir": "y", "velocity": -0.1)",
                          R"("time_step": {"adaptive": true, "safety": 0.5}, )" + end);
  };
  CHECK(says(said(R"("nsteps": 4000)"),
             "push material by 1.22 m, 2.44 cells in 4000 steps as long as the first, 0.00305 s"));
  CHECK_FALSE(says(said(R"("nsteps": 500)"), "push material by"));
  CHECK(says(said(R"("nsteps": 4000, "dt": 1e-3)"),
             "push material by 0.4 m, 0.8 cells in 4000 steps as long as the first, 0.001 s"));
  CHECK(says(said(R"("nsteps": 4000, "end_time": 10)"), "push material by 1 m, 2 cells: nodes"));
}

TEST_CASE("forces on nodes without material are warned of, with how many") {
  const std::string nothing = "with a force have no material around them at the beginning";
  CHECK_FALSE(says(said_of({.loads = pushing("face")}), nothing));
  CHECK(says(said_of({.loads = pushing("edge")}), "4 of the 9 nodes " + nothing));
  CHECK(says(said_of({.loads = pushing("far")}), "9 of the 9 nodes " + nothing));
  // Smooth functions reach into the next cells.
  CHECK(says(said_of({.loads = pushing("edge"), .functions = "quadratic_spline"}),
             "3 of the 9 nodes " + nothing));
  CHECK_FALSE(says(said_of({.loads = pushing("far")}, 1), nothing));  // it may have moved there
}

TEST_CASE("gravity that grows again in a stage is warned of, with the stage") {
  const std::string again = "gravity begins at zero again and grows until 0.5 s",
                    ramp = R"("gravity": {"gravity": [0, -10], "ramping_time": 0.5})";
  CHECK(says(said_of({.loads = ramp}, 1), "stage go: " + again));
  CHECK_FALSE(says(said_of({.loads = ramp}), again));
  CHECK_FALSE(says(said_of({.loads = R"("gravity": [0, -10])"}, 1), again));
  for (const char* own : {R"({"ramping_time": null})", "[0, -10]"})
    CHECK_FALSE(says(said_of({.loads = ramp,
                              .stage = fmt::format(
                                  R"(, "external_loading_conditions": {{"gravity": {}}})", own)},
                             1),
                     again));
  const std::string other =
      fmt::format(R"(, "external_loading_conditions": {{{}}})", pushing("face"));
  CHECK(says(said_of({.loads = ramp, .stage = other}, 1), again));
}

TEST_CASE("so are loads that grow again, but not pulses") {
  const std::string loads = R"("gravity": [0, -10], "particle_surface_traction": [
    {"pset": "top", "dir": "y", "traction": -5000, "math_function_id": "grow"},
    {"pset": "top", "dir": "x", "traction": 500}])";
  const std::string again = "grow with time again";
  CHECK(says(said_of({.loads = loads}, 1),
             "stage go: 1 of the 2 entries of 'particle_surface_traction' " + again));
  CHECK_FALSE(says(said_of({.loads = loads}), again));
  CHECK_FALSE(says(said_of({.loads = loads, .values = "[1, 0]"}, 1), again));
  CHECK_FALSE(says(said_of({.loads = loads, .values = "[0.8, 1]"}, 1), again));
  CHECK_FALSE(says(said_of({.loads = loads, .stage = R"(, "external_loading_conditions": {
                              "particle_surface_traction": [{"pset": "top", "dir": "y",
                                "traction": -5000, "math_function_id": "grow"}]})"},
                           1),
                   again));
}
