// Warnings of values in other units, of bodies that fall out of the mesh, of single particles in
// cells and of one stiff material; and silence where all is well.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <string>

#include "io/base/problems.h"
#include "io/scenario/scenario.h"

using namespace lahar;

namespace {

/// A block of clay on a floor, and a smaller one of steel.
struct Case {
  std::string gravity = "[0, -9.81]", density = "2000", steel_density = "7800",
              clay_modulus = "1e7", steel_modulus = "2e7", per_cell = "2",
              steel_box = R"({"min": [4, 2], "max": [5, 3]})",
              floor = R"({"half_space": {"point": [0, 0], "normal": [0, 1]}})", more = "",
              analysis = "", bodies = "";
};

std::string warnings_of(const Case& c) {
  const Scenario s = read_scenario_text(
      fmt::format(R"({{"mesh": {{"structured": {{"cell_size": 0.5, "counts": [20, 10]}},
      "boundary_conditions": {{"walls": [{{"nset": "floor", "normal": [0, 1], "friction": 0.5}}]{}}}}},
    "sets": {{"nodes": {{"floor": {}}}}},
    "rigid_bodies": [{}],
    "materials": [{{"name": "clay", "type": "LinearElastic", "density": {},
                    "youngs_modulus": {}, "poisson_ratio": 0.3}},
                  {{"name": "steel", "type": "LinearElastic", "density": {},
                    "youngs_modulus": {}, "poisson_ratio": 0.3}}],
    "particles": [{{"generator": {{"type": "region", "per_cell": {}, "material": "clay",
                     "region": {{"box": {{"min": [0, 0], "max": [8, 2]}}}}}}}},
                  {{"generator": {{"type": "region", "per_cell": 2, "material": "steel",
                     "region": {{"box": {}}}}}}}],
    "external_loading_conditions": {{"gravity": {}}},
    "analysis": {{"nsteps": 1, "interface": false{}}}}})",
                  c.more, c.floor, c.bodies, c.density, c.clay_modulus, c.steel_density,
                  c.steel_modulus, c.per_cell, c.steel_box, c.gravity, c.analysis),
      "");
  return format_problems(s.warnings, "warning");
}

void check_warns(const Case& c, const std::string& text) {
  const std::string said = warnings_of(c);
  CAPTURE(said);
  CHECK(said.find(text) != std::string::npos);
}

}  // namespace

TEST_CASE("a model in SI units whose bodies lie on a floor is not warned of") {
  CHECK(warnings_of({}) == "");
}

TEST_CASE("two velocities for one node and direction are warned of, equal ones are not") {
  const auto both = [](const char* second) {
    return Case{.more = fmt::format(R"(, "velocity_constraints": [
        {{"nset": "floor", "dir": "x", "velocity": 0}},
        {{"nset_id": -1, "dir": "x", "velocity": {}}}])",
                                    second)};
  };
  check_warns(both("0.5"),
              "at 21 of its nodes an entry before prescribes another velocity in this direction, "
              "which counts");
  CHECK(warnings_of(both("0")) == "");
  // The axis of an axisymmetric model is no entry: it only wins.
  Case around = both("0");
  around.more = R"(, "velocity_constraints": [{"nset_id": -1, "dir": "x", "velocity": 0.5}])";
  around.analysis = R"(, "plane": "axisymmetric")";
  CHECK(warnings_of(around).find("an entry before") == std::string::npos);
}

TEST_CASE("densities, moduli and gravity in other units are warned of") {
  check_warns({.density = "2"},
              "material 'clay' has 'density' 2, which no material has in SI units");
  check_warns({.steel_modulus = "2.1e14"},
              "material 'steel' has 'youngs_modulus' 2.1e+14, which no material has in SI units");
  check_warns({.gravity = "[0, -9810]", .clay_modulus = "1e10", .steel_modulus = "2e10"},
              "gravity is 9810, which looks like mm/s^2");
  // Without the gravity of the earth nobody can tell: centrifuges, and models without dimensions.
  CHECK(warnings_of({.gravity = "[0, -981]", .clay_modulus = "1e10", .steel_modulus = "2e10"}) ==
        "");
  CHECK(warnings_of({.gravity = "[0, -1]", .density = "1", .steel_density = "2"}) == "");
}

TEST_CASE("a body with nothing below it is warned of") {
  const std::string beside = R"({"min": [9, 3], "max": [10, 4]})";
  const std::string text = "this body falls out of the mesh: below it, along y, there is neither";
  CHECK(warnings_of({.steel_box = beside}) == "");  // the floor is below it
  Case c{.steel_box = beside};
  c.floor = R"({"box": {"min": [0, 0], "max": [8, 0]}})";
  const std::string said = warnings_of(c);
  CHECK(said.find(text) != std::string::npos);
  CHECK(said.find("/particles/1/generator") != std::string::npos);
  CHECK(said.find("/particles/0/generator") == std::string::npos);
  Case over = c;  // above the clay, which holds it
  over.steel_box = R"({"min": [4, 3], "max": [5, 4]})";
  CHECK(warnings_of(over).find(text) == std::string::npos);
  Case leaving = c;
  leaving.analysis = R"(, "locate_particles": false)";
  CHECK(warnings_of(leaving).find(text) == std::string::npos);
  CHECK(warnings_of({.gravity = "[0, 0]", .steel_box = beside}).find(text) == std::string::npos);
  Case obstacle = c;  // a rigid body elsewhere does not hold it, one below it does
  obstacle.bodies = R"({"region": {"box": {"min": [1, 4], "max": [2, 5]}}})";
  CHECK(warnings_of(obstacle).find(text) != std::string::npos);
  obstacle.bodies = R"({"region": {"box": {"min": [8.5, 1], "max": [10, 2]}}})";
  CHECK(warnings_of(obstacle).find(text) == std::string::npos);
}

TEST_CASE("a rigid body outside of the mesh, which touches nothing, is warned of") {
  const std::string text = "the rigid body 'pier' lies outside of the mesh";
  const auto with = [](const char* box, const char* motion) {
    return warnings_of(
        {.bodies = fmt::format(R"({{"name": "pier", "region": {{"box": {}}}{}}})", box, motion)});
  };
  CHECK(with(R"({"min": [11, 0], "max": [12, 3]})", "").find(text) != std::string::npos);
  CHECK(with(R"({"min": [9, 0], "max": [12, 3]})", "").find(text) == std::string::npos);
  // It may come in.
  CHECK(with(R"({"min": [11, 0], "max": [12, 3]})", R"(, "velocity": [-1, 0])").find(text) ==
        std::string::npos);
}

TEST_CASE("a model on which nothing acts is warned of") {
  const std::string text = "nothing acts on the material";
  CHECK(warnings_of({.gravity = "[0, 0]"}).find(text) != std::string::npos);
  CHECK(warnings_of({}).find(text) == std::string::npos);
  CHECK(warnings_of(
            {.gravity = "[0, 0]", .bodies = R"({"region": {"box": {"min": [9, 0], "max": [10, 1]}},
                                   "velocity": [-1, 0]})"})
            .find(text) == std::string::npos);
}

TEST_CASE("one particle in a cell is warned of") {
  check_warns({.per_cell = "1"}, "cells have one particle per direction");
  CHECK(warnings_of({.per_cell = "3"}) == "");
}

TEST_CASE("a small body that makes all steps short is warned of") {
  check_warns({.steel_modulus = "2.1e11"},
              "material 'steel' makes time steps 73.4 times shorter than all other materials need");
  CHECK(warnings_of({.steel_modulus = "5e8"}) == "");
  // If most of the model is stiff, steps are as short as they must be.
  CHECK(warnings_of({.clay_modulus = "1e11", .steel_modulus = "2e7"}).find("makes time steps") ==
        std::string::npos);
  CHECK(warnings_of({.steel_modulus = "2.1e11",
                     .analysis = R"(, "mpm_scheme": "newmark", "dt": 0.1)"}) == "");
}

TEST_CASE("displacements that begin anew on springs or absorbing boundaries are warned of") {
  const auto said = [](const std::string& conditions, const std::string& reset) {
    const std::string text =
        R"({"mesh": {"structured": {"cell_size": 1, "counts": [4, 4]},
                     "boundary_conditions": {)" +
        conditions + R"(}},
            "sets": {"nodes": {"floor": {"half_space": {"point": [0, 0], "normal": [0, 1]}}}},
            "materials": [{"name": "clay", "type": "LinearElastic", "density": 1000,
                           "youngs_modulus": 1e7, "poisson_ratio": 0.3}],
            "particles": [{"generator": {"type": "region", "material": "clay", "per_cell": 2,
                                         "region": {"box": {"max": [4, 2]}}}}],
            "external_loading_conditions": {"gravity": [0, -10]},
            "analysis": {"nsteps": 1},
            "stages": [{"name": "ground"}, {"name": "shaken", "reset": [)" +
        reset + "]}]}";
    std::string all;
    for (const Problem& warning :
         read_scenario_text(text, "", {.overrides = {}, .stage = 1}).warnings)
      all += warning.message + "\n";
    return all;
  };
  const std::string springs =
      R"("spring_constraints": [{"nset": "floor", "dir": "y", "stiffness": 1e6}])";
  const std::string absorbing = R"("absorbing_constraints": [{"nset": "floor", "dir": "y",
      "delta": 4, "h_min": 1, "position": "edge"}])";
  const std::string lost = " lose their force where displacements begin at zero again";
  CHECK(said(springs, R"("displacement")").find("springs" + lost) != std::string::npos);
  CHECK(said(absorbing, R"("displacement")").find("absorbing boundaries" + lost) !=
        std::string::npos);
  CHECK(said(springs + ", " + absorbing, R"("strain")").find(lost) == std::string::npos);
}

TEST_CASE(
    "absorbing nodes whose areas are not those of the mesh, or in many planes, are warned of") {
  const auto absorbing = [](const char* set, const char* dir, const char* edge, const char* place) {
    return fmt::format(
        R"({{"nset": "{}", "dir": "{}", "delta": 50, "h_min": {}, "position": "{}"}})", set, dir,
        edge, place);
  };
  const auto with = [](const std::string& entries) {
    return Case{.more = fmt::format(R"(, "absorbing_constraints": [{}])", entries)};
  };
  // 21 nodes on 10 m.
  CHECK(warnings_of(with(absorbing("floor", "y", "0.5", "edge"))) == "");
  check_warns(with(absorbing("floor", "y", "1", "edge")),
              "the nodes of the absorbing boundary at y = 0 have areas of 21 m together by 'h_min' "
              "and 'position', and 10 by the mesh");
  check_warns(with(absorbing("floor", "y", "0.5", "corner")), "have areas of 5.25 m together");
  check_warns(with(absorbing("floor", "x", "0.5", "edge")),
              "lie one behind the other along its normal, x, in 21 places");
}

TEST_CASE("affine velocities with domains of particles are warned of, and are no default there") {
  const auto with = [](const std::string& functions, const std::string& update) {
    return Case{.analysis = fmt::format(R"(, "shape_functions": "{}"{})", functions, update)};
  };
  for (const char* functions : {"gimp", "uniform_gimp", "cpdi", "cpdi2"}) {
    CAPTURE(functions);
    check_warns(with(functions, R"(, "velocity_update": "apic")"), "affine velocities with");
    CHECK(warnings_of(with(functions, "")) == "");
  }
  CHECK(warnings_of(with("quadratic_spline", R"(, "velocity_update": "apic")")) == "");
}
