// Warnings of gravity that the supports, the terrain or the strength do not fit to, and of gauges
// outside of the mesh; and silence where all is well.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <string>

#include "io/base/problems.h"
#include "io/scenario/scenario.h"

using namespace lahar;

namespace {

/// The law of a sand with this cohesion [Pa].
std::string sand_with(const std::string& cohesion) {
  return R"("type": "MohrCoulomb", "friction": 30, "dilation": 0, "tension_cutoff": 0, "cohesion": )" +
         cohesion;
}

/// Sand on a floor, in two dimensions.
struct Flat {
  std::string gravity = "[0, -9.81]", strength = sand_with("0"), held = "floor", bodies = "",
              gauges = "", geometry = "", stiffness = "1e7";
};

std::string warnings_of(const Flat& c) {
  const Scenario s = read_scenario_text(
      fmt::format(R"({{"mesh": {{"structured": {{"cell_size": 0.5, "counts": [20, 10]}},
      "boundary_conditions": {{"velocity_constraints":
          [{{"nset": "{}", "dir": "y", "velocity": 0}}]}}}},
    "sets": {{"nodes": {{"floor": {{"half_space": {{"point": [0, 0], "normal": [0, 1]}}}},
                         "sides": {{"half_space": {{"point": [0, 0], "normal": [1, 0]}}}},
                         "middle": {{"box": {{"min": [2, 1], "max": [3, 2]}}}}}}}},
    "geometry": {{{}}},
    "rigid_bodies": [{}],
    "materials": [{{"name": "sand", "density": 2000, "youngs_modulus": {}, "poisson_ratio": 0.3,
                    {}}}],
    "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": "sand",
                     "region": {{"box": {{"min": [0.5, 0], "max": [8, 2]}}}}}}}}],
    "external_loading_conditions": {{"gravity": {}}},
    "post_processing": {{"gauges": [{}]}},
    "analysis": {{"nsteps": 1}}}})",
                  c.held, c.geometry, c.bodies, c.stiffness, c.strength, c.gravity, c.gauges),
      "");
  return format_problems(s.warnings, "warning");
}

/// A block on the floor of a mesh with terrain, in three.
std::string warnings_in_space(const std::string& gravity, const std::string& measured = "") {
  const Scenario s = read_scenario_text(
      fmt::format(R"({{"mesh": {{"structured": {{"cell_size": 1, "counts": [4, 4, 4]}},
      "boundary_conditions": {{"velocity_constraints": [
          {{"nset": "floor", "dir": "x", "velocity": 0}}, {{"nset": "floor", "dir": "y", "velocity": 0}},
          {{"nset": "floor", "dir": "z", "velocity": 0}}]}}}},
    "sets": {{"nodes": {{"floor": {{"half_space": {{"point": [0, 0, 0], "normal": [0, 0, 1]}}}}}}}},
    "geometry": {{"ground": {{"points": [[-1, -1, 2], [5, -1, 2], [5, 5, 2], [-1, 5, 2]]}}}},
    "materials": [{{"type": "LinearElastic", "density": 2000, "youngs_modulus": 1e7,
                    "poisson_ratio": 0.3}}],
    "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": 0,
                     "region": {{"below": "ground"}}}}}}],
    "external_loading_conditions": {{"gravity": {}}},
    "post_processing": {{{}}},
    "analysis": {{"nsteps": 1}}}})",
                  gravity, measured),
      "");
  return format_problems(s.warnings, "warning");
}

/// A layer on a body of terrain, in three, with other bodies.
std::string warnings_on_terrain(const std::string& gravity, const std::string& more) {
  const Scenario s = read_scenario_text(
      fmt::format(R"({{"mesh": {{"structured": {{"cell_size": 1, "counts": [4, 4, 4]}}}},
    "geometry": {{"ground": {{"points": [[-1, -1, 2], [5, -1, 1], [5, 5, 1], [-1, 5, 2]]}},
                  "top": {{"surface": "ground", "raise_by": 1}}}},
    "materials": [{{"type": "LinearElastic", "density": 2000, "youngs_modulus": 1e7,
                    "poisson_ratio": 0.3}}],
    "rigid_bodies": [{{"region": {{"below": "ground"}}}}{}],
    "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": 0,
                     "region": {{"intersection": [{{"between": ["ground", "top"]}},
                       {{"box": {{"min": [1, 1, 0], "max": [3, 3, 4]}}}}]}}}}}}],
    "external_loading_conditions": {{"gravity": {}}},
    "analysis": {{"nsteps": 1}}}})",
                  more, gravity),
      "");
  return format_problems(s.warnings, "warning");
}

bool warns(const std::string& said, const std::string& text) {
  INFO(said);
  return said.find(text) != std::string::npos;
}

}  // namespace

TEST_CASE("gravity that points up, away from all that holds the material, is warned of") {
  const std::string up = "gravity points up, along +y, and all that holds the material is below it";
  CHECK(warnings_of({}) == "");
  const std::string said = warnings_of({.gravity = "[0, 9.81]"});
  CHECK(warns(said, up));
  CHECK(warns(said, "hint: is [0, -9.81] meant?"));
  CHECK_FALSE(warns(warnings_of({.gravity = "[0, 9.81]", .held = "sides"}), up));
  const std::string body = R"({"region": {"box": {"min": [0, 3], "max": [8, 4]}}})";
  CHECK_FALSE(warns(warnings_of({.gravity = "[0, 9.81]", .bodies = body}), up));
  const std::string low = R"({"region": {"box": {"min": [8.5, 0], "max": [9, 1]}}})";  // holds not
  CHECK(warns(warnings_of({.gravity = "[0, 9.81]", .bodies = low}), up));
  CHECK_FALSE(warns(warnings_of({.gravity = "[9.81, 0]"}), up));  // a wall, a hanging bar
  const std::string beside = R"({"region": {"box": {"min": [8.5, 0], "max": [9, 4]}}})";
  CHECK(warns(warnings_of({.gravity = "[0, 9.81]", .bodies = beside}), up));
  const auto half = [](const char* normal) {  // solid against the normal
    return fmt::format(R"({{"region": {{"half_space": {{"point": [0, 2.5], "normal": {}}}}}}})",
                       normal);
  };
  CHECK_FALSE(warns(warnings_of({.gravity = "[0, 9.81]", .bodies = half("[0.1, -1]")}), up));
}

TEST_CASE("so it is where terrain is all that holds the material") {
  const std::string up = "gravity points up, along +z, and all that holds the material is below it";
  const auto said = [](const char* gravity, const std::string& more) {
    return warnings_on_terrain(gravity, more);
  };
  CHECK(warns(said("[0, 0, 9.81]", ""), up));
  CHECK_FALSE(warns(said("[0, 0, -9.81]", ""), up));
  const std::string gate = R"(, {"region": {"box": {"min": [3.5, 0, 0], "max": [4, 4, 4]}}})";
  CHECK(warns(said("[0, 0, 9.81]", gate), up));  // beside it
  const std::string roof = R"(, {"region": {"box": {"min": [0, 0, 3.2], "max": [4, 4, 4]}}})";
  CHECK_FALSE(warns(said("[0, 0, 9.81]", roof), up));
}

TEST_CASE("soil on a bed that gravity is turned for is soft by its depth, not by its length") {
  const std::string turned = "[3.36, -9.22]";  // 2 m deep, 7.5 m long
  CHECK(warnings_of({.gravity = turned, .stiffness = "5e5"}).find("soft") == std::string::npos);
  CHECK(warnings_of({.gravity = turned, .stiffness = "3e5"}).find("soft") != std::string::npos);
}

TEST_CASE("gravity across the heights of terrain is warned of") {
  CHECK(warns(warnings_in_space("[0, -9.81, 0]"),
              "gravity is along y, but the heights of the surface 'ground' are along z"));
  CHECK_FALSE(warns(warnings_in_space("[0, 0, -9.81]"), "heights"));
  CHECK_FALSE(warns(warnings_in_space("[0, -5, -8]"), "heights"));  // a slope in its own axes
}

TEST_CASE("a cohesion of some Pa is asked for, that of 1 Pa and of some kPa is not") {
  const auto asks = [](const char* cohesion) {
    return warns(warnings_of({.strength = sand_with(cohesion)}),
                 "is the cohesion of 'sand' meant in kPa?");
  };
  CHECK(asks("5"));
  CHECK(asks("100"));
  for (const char* meant : {"0", "1", "101", "5e3"}) CHECK_FALSE(asks(meant));
}

TEST_CASE("so is a yield stress of some Pa") {
  const auto said = [](const std::string& stress) {
    return warnings_of({.strength = R"("type": "VonMises", "yield_stress": )" + stress});
  };
  CHECK(warns(said("30"), "is the yield stress of 'sand' meant in kPa? 30 Pa bear nothing"));
  CHECK(said("30").find("grains") == std::string::npos);
  CHECK_FALSE(warns(said("3e4"), "kPa"));
}

TEST_CASE("gauges outside of the mesh are warned of, with how many places and where the mesh is") {
  const auto said = [](const char* gauge) { return warnings_of({.gauges = gauge}); };
  const std::string point =
      said(R"({"name": "p", "type": "point", "at": [11, 1], "fields": ["velocity"]})");
  CHECK(warns(point, "the place of the gauge 'p' lies outside of the mesh"));
  CHECK(warns(point, "the mesh has x from 0 to 10, y from 0 to 5"));
  const std::string section =
      said(R"({"name": "s", "type": "section", "from": [6], "to": [14], "places": 9})");
  CHECK(warns(section, "4 of the 9 places of the gauge 's' lie outside of the mesh"));
  CHECK(warns(section, "[/post_processing/gauges/0/to]"));
  CHECK(warns(section, "the mesh has x from 0 to 10\n"));
  CHECK(said(R"({"name": "s", "type": "section", "from": [0], "to": [10], "places": 9})") == "");
}

TEST_CASE("a gauge whose radius is below the distance of particles is warned of") {
  const auto said = [](const char* radius) {
    return warnings_of({.gauges = fmt::format(R"({{"name": "p", "type": "point", "at": [4, 1],
                                                  "fields": ["velocity"]{}}})",
                                              radius)});
  };
  CHECK(warns(said(R"(, "radius": 0.1)"),
              "the radius of the gauge 'p', 0.1 m, is below the distance of particles, 0.25 m"));
  CHECK(said(R"(, "radius": 0.25)") == "");
  CHECK(said("") == "");
}

TEST_CASE("a gauge of a variable that some materials lack is warned of, but for one material not") {
  const auto said = [](const char* gauge) {
    std::string all;
    for (const auto& warning : read_scenario_text(fmt::format(R"({{
      "mesh": {{"structured": {{"cell_size": 1, "extent": [4, 4]}}}},
      "materials": [
        {{"name": "water", "type": "Newtonian", "density": 1000, "bulk_modulus": 1e6,
          "dynamic_viscosity": 1e-3}},
        {{"name": "rock", "type": "LinearElastic", "density": 2000, "youngs_modulus": 1e7,
          "poisson_ratio": 0.2}}],
      "particles": [
        {{"generator": {{"type": "region", "material": "water",
                         "region": {{"box": {{"min": [0, 2], "max": [4, 3]}}}}}}}},
        {{"generator": {{"type": "region", "material": "rock",
                         "region": {{"box": {{"min": [0, 0], "max": [4, 2]}}}}}}}}],
      "analysis": {{"end_time": 1}},
      "post_processing": {{"gauges": [{{"name": "p", "type": "point", "at": [2, 2], {}}}]}}}})",
                                                              gauge),
                                                  "")
                                   .warnings)
      all += warning.message + '\n';
    return all;
  };
  CHECK(
      warns(said(R"("fields": ["pressure"])"),
            "\"pressure\" is 0 in particles of rock, which the mean of this gauge takes in, too"));
  CHECK(!warns(said(R"("fields": ["pressure"], "material": "water")"), "is 0 in particles"));
  CHECK(!warns(said(R"("fields": ["mean_stress", "velocity"])"), "is 0 in particles"));
}

TEST_CASE("maps whose cells are small for the distance of particles are warned of") {
  const auto said = [](const char* size) {
    return warnings_in_space("[0, 0, -9.81]", fmt::format(R"("maps": {{"cell_size": {}}})", size));
  };
  CHECK(
      warns(said("0.5"), "cells of the maps, 0.5 m, are small for particles that are 0.5 m apart"));
  CHECK(warns(said("0.5"), "[/post_processing/maps/cell_size]"));
  CHECK_FALSE(warns(said("1"), "cells of the maps"));
}

TEST_CASE("terrain that ends inside of the mesh is warned of, with where") {
  const auto said = [](const char* end) {
    return warnings_of(
        {.bodies = R"({"name": "bed", "region": {"below": "ground"}})",
         .geometry = fmt::format(R"("ground": {{"points": [[-1, 0], [{}, 0]]}})", end)});
  };
  CHECK(warns(said("9"),
              "the rigid body 'bed' ends inside of the mesh, at x = 9: what moves beyond"));
  CHECK_FALSE(warns(said("10"), "ends inside"));
}

TEST_CASE("rigid bodies outside of the mesh are warned of where nothing brings them in") {
  const auto said = [](const std::string& place, const std::string& motion) {
    return warns(
        warnings_of({.bodies = fmt::format(R"({{"name": "stone", "region": {{"box": {}}}{}}})",
                                           place, motion)}),
        "the rigid body 'stone' lies outside of the mesh, where it touches nothing");
  };
  const std::string beside = R"({"min": [12, 1], "max": [13, 2]})",
                    above = R"({"min": [4, 6], "max": [5, 7]})";
  CHECK(said(beside, ""));
  CHECK(said(beside, R"(, "density": 2000)"));
  CHECK(said(beside, R"(, "density": 2000, "velocity": [1, 0])"));
  CHECK_FALSE(said(beside, R"(, "density": 2000, "velocity": [-1, 0])"));
  CHECK(said(beside, R"(, "velocity": [0, -1])"));
  CHECK_FALSE(said(beside, R"(, "velocity": [-1, 0])"));
  CHECK_FALSE(said(above, R"(, "density": 2000)"));  // it falls
  CHECK(said(above, R"(, "density": 2000, "fixed": ["y"])"));
  CHECK_FALSE(said(R"({"min": [8.5, 1], "max": [9, 2]})", R"(, "density": 2000)"));
}

TEST_CASE("a rigid body that moves by more than half a cell in a step is warned of") {
  const auto said = [](const char* velocity) {
    return warnings_of({.bodies = fmt::format(
                            R"({{"name": "hammer", "velocity": [0, {}],
                                "region": {{"box": {{"min": [2, 2.2], "max": [4, 3]}}}}}})",
                            velocity)});
  };
  CHECK(warns(said("-500"), "the rigid body 'hammer' moves at up to 500 m/s, by 1."));
  CHECK(warns(said("-500"), "[/rigid_bodies/0/velocity]"));
  CHECK_FALSE(warns(said("-100"), "moves at up to"));
}

TEST_CASE("a gauge of the force on nodes that nothing holds is warned of") {
  const auto said = [](const char* set) {
    return warns(warnings_of({.gauges = fmt::format(
                                  R"({{"name": "f", "type": "force", "nset": "{}"}})", set)}),
                 "nothing holds a node of the gauge 'f': its force stays zero");
  };
  CHECK(said("middle"));
  CHECK_FALSE(said("floor"));
  CHECK_FALSE(said("sides"));  // its lowest node is held
}
