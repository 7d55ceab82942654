#include <doctest/doctest.h>
#include <fmt/format.h>

#include <string>

#include "io/base/problems.h"
#include "io/scenario/scenario.h"
#include "tests/io/scenario/broken_case.h"

using namespace lahar::broken;

namespace {

const char* const velocity =
    "\"velocity_constraints\": [{\"nset_id\": 0, \"dir\": 1, \"velocity\": 0.0}]";
const char* const file_generator =
    R"({"generator": {"type": "file", "location": "particles.txt", "material_id": 0}})";

Edit conditions(const std::string& text) {
  return replace("mpm.json", velocity, text);
}

Edit material(const std::string& from, const std::string& to) {
  return replace("mpm.json", from, to);
}

Edit regions(const std::string& text) {
  return replace("mpm.json", file_generator, text);
}

}  // namespace

// clang-format off
TEST_CASE("what is valid but surely wrong is warned of, with numbers and what to do") {
  const std::vector<Entry> table = {
    {"a stiffness in kPa",
     {material("youngs_modulus\": 1e6", "youngs_modulus\": 1e4"),
      write("particles.txt", "3\n0.25 0.1\n0.75 0.9\n1.5 0.5\n")}, {}, R"(accepted
mpm.json:16:24: warning: material '0' is soft for its weight: rho g H = 7.85e+03 Pa over a height of 0.8 m is 0.785 times its youngs_modulus, 1e+04 Pa [/materials/0/youngs_modulus]
       "youngs_modulus": 1e4, "poisson_ratio": 0.3}
                         ^
  hint: at most 0.1 is usual, else gravity alone compresses it by percents; is the stiffness in kPa or MPa instead of Pa?
)"},
    {"a friction angle in radians",
     {material("LinearElastic2D\"", "MohrCoulomb2D\", \"friction\": 0.52, \"dilation\": 0, \"cohesion\": 0, \"tension_cutoff\": 0")}, {}, R"(accepted
mpm.json:15:52: warning: 'friction' is 0.52 degrees, which looks like radians [/materials/0/friction]
      {"id": 0, "type": "MohrCoulomb2D", "friction": 0.52, "dilation": 0, "cohesion": 0, "tension_cutoff": 0, "density": 1000,
                                                     ^
  hint: angles are in degrees: 0.52 rad are 29.8 degrees
)"},
    {"an angle as a coefficient",
     {conditions(R"("walls": [{"nset_id": 0, "normal": [0, 1], "friction": 30}])")}, {}, R"(accepted
mpm.json:8:62: warning: friction coefficient 30 is above 2, which looks like an angle [/mesh/boundary_conditions/walls/0/friction]
        "walls": [{"nset_id": 0, "normal": [0, 1], "friction": 30}]
                                                               ^
  hint: a coefficient is the tangent of an angle: of 30 degrees 0.577
)"},
    {"an angle as a coefficient in a file",
     {conditions(R"("friction_constraints": [{"file": "friction.txt"}])"),
      write("friction.txt", "0 1 -1 30\n1 1 -1 0.3\n")}, {}, R"(accepted
mpm.json:8:32: warning: the file has friction coefficients up to 30, above 2, which look like angles [/mesh/boundary_conditions/friction_constraints/0]
        "friction_constraints": [{"file": "friction.txt"}]
                                 ^
  hint: a coefficient is the tangent of an angle: of 30 degrees 0.577
mpm.json:8:32: warning: 2 of the 2 nodes of this two-sided friction wall are not held along its normal, y [/mesh/boundary_conditions/friction_constraints/0]
        "friction_constraints": [{"file": "friction.txt"}]
                                 ^
  hint: friction alone does not stop material: add a velocity constraint with "dir": 1, or set "two_sided": false
mpm.json:8:32: warning: two-sided friction, as in CB-Geo MPM, slows what slides by more than the coefficient says, and stiff material by much more [/mesh/boundary_conditions/friction_constraints/0]
        "friction_constraints": [{"file": "friction.txt"}]
                                 ^
  hint: set "two_sided": false for Coulomb's friction
)"},
    {"a floor whose normal points down",
     {conditions(R"("walls": [{"nset_id": 0, "normal": [0, -1], "friction": 0.3}])")}, {}, R"(accepted
mpm.json:8:17: warning: the wall at y = 0 has its material on the wrong side: it bounds what is below it along y, where the mesh ends [/mesh/boundary_conditions/walls/0]
        "walls": [{"nset_id": 0, "normal": [0, -1], "friction": 0.3}]
                  ^
  hint: 'normal' points from the wall into the material: reverse its sign
)"},
    {"a floor inside of the mesh with the wrong sign",
     {conditions(R"("friction_constraints": [
        {"nset_id": 0, "dir": 1, "sign_n": 1, "friction": 0.3, "two_sided": false}])"),
      write("mesh.txt", "# four squares\n9 4\n0 0\n1 0\n2 0\n0 1\n1 1\n2 1\n0 -1\n1 -1\n2 -1\n"
                        "0 1 4 3\n1 2 5 4\n6 7 1 0\n7 8 2 1\n")}, {}, R"(accepted
mpm.json:9:9: warning: the wall at y = 0 has its material on the wrong side: all 3 particles within a cell of it are above it [/mesh/boundary_conditions/friction_constraints/0]
          {"nset_id": 0, "dir": 1, "sign_n": 1, "friction": 0.3, "two_sided": false}]
          ^
  hint: 'sign_n' is the sign of the direction that points out of the body, -1 for a floor below it: reverse it
)"},
    {"a two-sided wall that is not held",
     {conditions(R"("velocity_constraints": [{"nset_id": 0, "dir": 0, "velocity": 0}],
      "friction_constraints": [{"nset_id": 0, "dir": 1, "sign_n": -1, "friction": 0.3}])")}, {}, R"(accepted
mpm.json:9:32: warning: 3 of the 3 nodes of this two-sided friction wall are not held along its normal, y [/mesh/boundary_conditions/friction_constraints/0]
        "friction_constraints": [{"nset_id": 0, "dir": 1, "sign_n": -1, "friction": 0.3}]
                                 ^
  hint: friction alone does not stop material: add a velocity constraint with "dir": 1, or set "two_sided": false
mpm.json:9:32: warning: two-sided friction, as in CB-Geo MPM, slows what slides by more than the coefficient says, and stiff material by much more [/mesh/boundary_conditions/friction_constraints/0]
        "friction_constraints": [{"nset_id": 0, "dir": 1, "sign_n": -1, "friction": 0.3}]
                                 ^
  hint: set "two_sided": false for Coulomb's friction
)"},
    {"nothing below the material",
     {conditions(R"("velocity_constraints": [{"nset_id": 0, "dir": 0, "velocity": 0}])")}, {}, R"(accepted
mpm.json:18:46: warning: nothing holds the material against gravity, which is largest along y: no velocity constraint, wall or load acts in that direction [/external_loading_conditions/gravity]
    "external_loading_conditions": {"gravity": [0, -9.81]},
                                               ^
  hint: add a wall or a velocity constraint in mesh.boundary_conditions; a body in free fall needs none
)"},
    {"a region half outside of the mesh",
     {regions(R"({"generator": {"type": "region", "per_cell": 4, "material_id": 0,
      "region": {"box": {"min": [1, 0], "max": [3, 1]}}}})")}, {}, R"(accepted
mpm.json:13:17: warning: 50 % of the region lies outside of the mesh and gets no particles: about 16, beside the 16 inside [/particles/0/generator/region]
        "region": {"box": {"min": [1, 0], "max": [3, 1]}}}}
                  ^
  hint: the mesh extends from (0, 0) to (2, 1), the region from (1, 0) to (3, 1): move one of them, or make the mesh larger
)"},
    {"a region that reaches beyond the mesh on both sides is meant",
     {regions(R"({"generator": {"type": "region", "per_cell": 4, "material_id": 0,
      "region": {"box": {"min": [-9, 0], "max": [9, 1]}}}})")}, {}, R"(accepted
)"},
    {"two generators in one place",
     {regions(R"({"generator": {"type": "region", "per_cell": 2, "material_id": 0,
      "region": {"box": {"min": [0, 0], "max": [2, 1]}}}},
    {"generator": {"type": "region", "per_cell": 3, "material_id": 0,
      "region": {"box": {"min": [1, 0], "max": [2, 1]}}}})")}, {}, R"(accepted
mpm.json:14:19: warning: this generator fills the same place as the one on line 12: 1 cells hold particles of both, of up to 2 times the cell's volume [/particles/1/generator]
      {"generator": {"type": "region", "per_cell": 3, "material_id": 0,
                    ^
  hint: material is there twice: take the smaller region out of the larger one with "difference"
)"},
    {"two generators in two halves of a cell",
     {regions(R"({"generator": {"type": "region", "per_cell": 4, "material_id": 0,
      "region": {"box": {"min": [0, 0], "max": [2, 0.5]}}}},
    {"generator": {"type": "region", "per_cell": 2, "material_id": 0,
      "region": {"box": {"min": [0, 0.5], "max": [2, 1]}}}})")}, {}, R"(accepted
)"},
    {"a polygon that crosses itself",
     {regions(R"({"generator": {"type": "region", "per_cell": 4, "material_id": 0,
      "region": {"polygon": {"points": [[0, 0], [2, 1], [2, 0], [0, 1]]}}}})")}, {}, R"(accepted
mpm.json:13:40: warning: the polygon crosses itself: its edges (0, 0) to (2, 1) and (2, 0) to (0, 1) do [/particles/0/generator/region/polygon/points]
        "region": {"polygon": {"points": [[0, 0], [2, 1], [2, 0], [0, 1]]}}}}
                                         ^
  hint: points are those of the outline, in order; what it goes around twice is outside
)"},
    {"a field for ParaView that does not exist",
     {replace("mpm.json", "\"output_steps\": 5", R"("vtk": ["stresses", "displacments"])")}, {}, R"(accepted
mpm.json:20:43: warning: particles have no field 'displacments' [/post_processing/vtk/1]
    "post_processing": {"vtk": ["stresses", "displacments"]}
                                            ^
  hint: did you mean 'displacements'?
)"},
    {"a derived field that does not exist",
     {replace("mpm.json", "\"output_steps\": 5", R"("vtk": ["speed", "von_mises_stres"])")}, {}, R"(accepted
mpm.json:20:40: warning: particles have no field 'von_mises_stres' [/post_processing/vtk/1]
    "post_processing": {"vtk": ["speed", "von_mises_stres"]}
                                         ^
  hint: did you mean 'von_mises_stress'?
)"},
    {"a derived field that frames leave out",
     {replace("mpm.json", "\"output_steps\": 5",
              R"("frame_fields": ["velocity", "mean_stress"], "vtk": ["speed", "mean_stress"])")}, {}, R"(accepted
mpm.json:20:76: warning: frames will not have 'speed': 'frame_fields' leaves only its own [/post_processing/vtk/0]
    "post_processing": {"frame_fields": ["velocity", "mean_stress"], "vtk": ["speed", "mean_stress"]}
                                                                             ^
  hint: add "speed" to frame_fields: no other field is needed for it
)"},
  };
  check(table, 16);
}

TEST_CASE("smoothing of pressure is warned of in scenarios written for Lahar alone") {
  const auto warnings = [](const std::string& type) {
    const lahar::Scenario s = lahar::read_scenario_text(
        R"({"mesh": {"structured": {"cell_size": 1, "counts": [2, 2]}},
            "materials": [{"type": "Newtonian", "density": 1000, "bulk_modulus": 1e6,
                           "dynamic_viscosity": 1e-3}],
            "particles": [{"generator": {"type": "region", "per_cell": 1, "material": 0}}],
            "analysis": {)" +
            type + R"("pressure_smoothing": true, "dt": 1e-3, "nsteps": 1}})",
        "");
    return lahar::format_problems(s.warnings, "warning");
  };
  CHECK(warnings("").find("with 'pressure_smoothing' a fluid forgets its volume") !=
        std::string::npos);
  CHECK(warnings(R"("type": "MPMExplicit2D", )").find("forgets") == std::string::npos);
}

TEST_CASE("materials that lock are warned of where a cell has several particles") {
  const auto warnings = [](const char* material, int per_cell, const char* plane = "strain") {
    const lahar::Scenario s = lahar::read_scenario_text(
        R"({"mesh": {"structured": {"cell_size": 1, "counts": [2, 2]}},
            "materials": [{"density": 1000, "youngs_modulus": 1e6, )" +
            std::string(material) +
            R"(}], "particles": [{"generator": {"type": "region", "material": 0, "per_cell": )" +
            std::to_string(per_cell) + R"(}}], "analysis": {"nsteps": 1, "plane": ")" + plane +
            R"("}})",
        "");
    return lahar::format_problems(s.warnings, "warning");
  };
  const auto locks = [&](const char* material, int per_cell, const char* plane = "strain") {
    return warnings(material, per_cell, plane).find("and locks where") != std::string::npos;
  };
  const char* const clay =
      R"("type": "VonMises", "poisson_ratio": 0.3, "yield_stress": 1e4)";
  const char* const rubber = R"("type": "LinearElastic", "poisson_ratio": 0.49)";
  const char* const steel = R"("type": "LinearElastic", "poisson_ratio": 0.3)";
  CHECK(locks(clay, 2));
  CHECK(locks(rubber, 2));
  CHECK_FALSE(locks(clay, 1));
  CHECK_FALSE(locks(steel, 2));
  // Sheets change their thickness.
  CHECK_FALSE(locks(clay, 2, "stress"));
  CHECK(locks(clay, 2, "axisymmetric"));
  for (const char* plane : {"strain", "axisymmetric"})
    CHECK(warnings(clay, 2, plane).find("b_bar") != std::string::npos);
}

TEST_CASE("a liquid without a pressure is warned of, but not in projections") {
  const auto warned = [](const char* liquid, const char* analysis) {
    const lahar::Scenario s = lahar::read_scenario_text(
        R"({"mesh": {"structured": {"cell_size": 1, "counts": [2, 2]}},
            "materials": [{"type": "Newtonian", "density": 1000, "bulk_modulus": 1e6,
                           "dynamic_viscosity": 1)" +
            std::string(liquid) +
            R"(}], "particles": [{"generator": {"type": "region", "material": 0, "per_cell": 2}}],
            "analysis": {"nsteps": 1, )" +
            analysis + "}}",
        "");
    return lahar::format_problems(s.warnings, "warning").find("nothing holds its volume") !=
           std::string::npos;
  };
  const char* const incompressible = R"(, "incompressible": true)";
  CHECK(warned(incompressible, R"("mpm_scheme": "musl")"));
  CHECK_FALSE(warned("", R"("mpm_scheme": "musl")"));
  CHECK_FALSE(warned(incompressible, R"("mpm_scheme": "projection", "dt": 1e-3)"));
  CHECK_FALSE(warned(incompressible, R"("preset": "cbgeo", "dt": 1e-3)"));
}

TEST_CASE("a body with prescribed velocities is warned of where other material sticks to it") {
  const auto warnings = [](const char* plate, const char* analysis) {
    const lahar::Scenario s = lahar::read_scenario_text(
        R"({"mesh": {"structured": {"cell_size": 1, "counts": [4, 4]},
                     "boundary_conditions": {"particles_velocity_constraints": [
                       {"pset": "plate", "dir": "y", "velocity": -1}]}},
            "materials": [
              {"name": "soil", "type": "LinearElastic", "density": 1000, "youngs_modulus": 1e6,
               "poisson_ratio": 0.3},
              {"name": "steel", "type": "LinearElastic", "density": 1000, "youngs_modulus": 1e7,
               "poisson_ratio": 0.3}],
            "particles": [
              {"generator": {"type": "region", "material": "soil", "per_cell": 1,
                             "region": {"box": {"max": [4, 2]}}}},
              {"generator": {"type": "region", "material": ")" +
            std::string(plate) + R"(", "per_cell": 1, "pset": "plate",
                             "region": {"box": {"min": [0, 2], "max": [2, 3]}}}}],
            "analysis": {)" +
            analysis + R"("nsteps": 1}})",
        "");
    return lahar::format_problems(s.warnings, "warning");
  };
  CHECK(warnings("steel", "").find("other material sticks to particles with prescribed") !=
        std::string::npos);
  CHECK(warnings("steel", R"("interface": true, )").find("sticks") == std::string::npos);
  CHECK(warnings("steel", R"("interface": false, )").find("sticks") == std::string::npos);
  CHECK(warnings("soil", "").find("sticks") == std::string::npos);  // the end of a bar
}

TEST_CASE("bodies that are apart are warned of where nothing is said of contact") {
  const auto warnings = [](const char* material, double bottom, const char* analysis,
                           const char* more = "") {
    const lahar::Scenario s = lahar::read_scenario_text(
        R"({"mesh": {"structured": {"cell_size": 1, "counts": [4, 6]}},
            "materials": [
              {"name": "soil", "type": "LinearElastic", "density": 1000, "youngs_modulus": 1e6,
               "poisson_ratio": 0.3},
              {"name": "steel", "type": "LinearElastic", "density": 1000, "youngs_modulus": 1e7,
               "poisson_ratio": 0.3},
              {"name": "water", "type": "Newtonian", "density": 1000, "bulk_modulus": 1e6,
               "dynamic_viscosity": 1e-3}],
            "particles": [
              {"generator": {"type": "region", "material": "soil", "per_cell": 2,
                             "region": {"box": {"max": [4, 2]}}}},
              {"generator": {"type": "region", "material": ")" +
            std::string(material) + R"(", "per_cell": 2,
                             "region": {"box": {"min": [0, )" +
            std::to_string(bottom) + R"(], "max": [2, 5]}}}})" + more + R"(],
            "analysis": {)" +
            analysis + R"("nsteps": 1}})",
        "");
    return lahar::format_problems(s.warnings, "warning");
  };
  CHECK(warnings("steel", 3, "").find("a body apart from those on line ") != std::string::npos);
  CHECK(warnings("steel", 2, "").find("apart") == std::string::npos);  // on the soil
  CHECK(warnings("soil", 3, "").find("apart") == std::string::npos);
  CHECK(warnings("water", 3, "").find("apart") == std::string::npos);
  CHECK(warnings("steel", 3, R"("interface": true, )").find("apart") == std::string::npos);
  CHECK(warnings("steel", 3, R"("interface": false, )").find("apart") == std::string::npos);
  CHECK(warnings("steel", 3, R"("type": "MPMExplicit2D", "dt": 1e-3, )").find("apart") == std::string::npos);
  const char* const layer = R"(, {"generator": {"type": "region", "material": "soil",
    "per_cell": 2, "region": {"box": {"min": [0, 2], "max": [2, 3]}}}})";
  CHECK(warnings("steel", 3, "", layer).find("apart") == std::string::npos);
}

TEST_CASE("a scenario in which nothing can move is warned of") {
  const auto warnings = [](const char* conditions, const char* normal) {
    const lahar::Scenario s = lahar::read_scenario_text(
        R"({"mesh": {"structured": {"cell_size": 1, "counts": [4, 4]},
                     "boundary_conditions": {)" +
            std::string(conditions) + R"(}},
            "sets": {"nodes": {"floor": {"half_space": {"point": [0, 0], "normal": [0, )" +
            normal + R"(]}}}},
            "materials": [{"type": "LinearElastic", "density": 1000, "youngs_modulus": 1e6,
                           "poisson_ratio": 0.3}],
            "particles": [{"generator": {"type": "region", "material": 0, "per_cell": 1,
                                         "region": {"box": {"max": [4, 2]}}}}],
            "analysis": {"nsteps": 1}})",
        "");
    return lahar::format_problems(s.warnings, "warning");
  };
  const char* const walls = R"("walls": [{"nset": "floor", "normal": [0, 1], "friction": 0.5}])";
  const char* const held = R"("velocity_constraints": [
    {"nset": "floor", "dir": "x", "velocity": 0}, {"nset": "floor", "dir": "y", "velocity": 0}])";
  const char* const column = R"("velocity_constraints": [
    {"nset": "floor", "dir": "x", "velocity": 0}])";
  CHECK(warnings(walls, "-1").find("all nodes of the mesh are nodes of this wall") !=
        std::string::npos);
  CHECK(warnings(held, "-1").find("all nodes of the mesh are held in all directions") !=
        std::string::npos);
  for (const char* const fine : {walls, held})
    CHECK(warnings(fine, "1").find("all nodes") == std::string::npos);
  CHECK(warnings(column, "-1").find("all nodes") == std::string::npos);
}

TEST_CASE("residual strengths of soil that does not soften are warned of") {
  const auto warnings = [](const char* keys, const char* analysis) {
    const lahar::Scenario s = lahar::read_scenario_text(
        R"({"mesh": {"structured": {"cell_size": 1, "counts": [2, 2]}},
            "materials": [{"name": "sand", "type": "MohrCoulomb", "density": 1000,
                           "youngs_modulus": 1e6, "poisson_ratio": 0.3, "friction": 30,
                           "dilation": 0, "cohesion": 0, "tension_cutoff": 0)" +
            std::string(keys) + R"(}],
            "particles": [{"generator": {"type": "region", "material": 0, "per_cell": 1}}],
            "analysis": {)" +
            analysis + R"("nsteps": 1}})",
        "");
    return lahar::format_problems(s.warnings, "warning");
  };
  const char* const residual = R"(, "residual_friction": 20)";
  CHECK(warnings(residual, "").find("'residual_friction' has no effect: material 'sand'") !=
        std::string::npos);
  CHECK(warnings("", "").find("has no effect") == std::string::npos);
  CHECK(warnings(residual, R"("type": "MPMExplicit2D", "dt": 1e-3, )").find("residual") == std::string::npos);
}

namespace {

/// Warnings of sand in a mesh of 8 x 4 m, on a floor that is held.
std::string about_sand(const std::string& box, const std::string& held, const std::string& law,
                       const std::string& more = "") {
  const lahar::Scenario s = lahar::read_scenario_text(
      R"({"mesh": {"structured": {"cell_size": 1, "counts": [8, 4]},
            "boundary_conditions": {"velocity_constraints": [
              {"nset": "floor", "dir": "y", "velocity": 0})" + held + R"(]}},
          "sets": {"nodes": {"floor": {"half_space": {"point": [0, 0], "normal": [0, 1]}},
                             "left": {"half_space": {"point": [0, 0], "normal": [1, 0]}}}},
          "materials": [{"name": "sand", "density": 1000, "youngs_modulus": 1e6,
                         "poisson_ratio": 0.3, "type": )" + law + R"(}],
          "particles": [{"generator": {"type": "region", "material": 0, "per_cell": 2,
            "region": {"box": )" + box + R"(}}}],
          "external_loading_conditions": {"gravity": [0, -10]},
          "analysis": {"nsteps": 1})" + more + "}",
      "");
  return lahar::format_problems(s.warnings, "warning");
}
const char* const loose =
    R"("MohrCoulomb", "friction": 30, "dilation": 0, "cohesion": 0, "tension_cutoff": 0)";

}  // namespace

TEST_CASE("what may flow is warned of at a side of the mesh that nothing holds") {
  const auto open = [](const std::string& box, const std::string& held, const std::string& law) {
    return about_sand(box, held, law).find("touches the side x = 0 of the mesh") !=
           std::string::npos;
  };
  const char* const at_side = R"({"min": [0, 0], "max": [3, 4]})";
  const std::string wall = R"(, {"nset": "left", "dir": "x", "velocity": 0})",
                    along = R"(, {"nset": "left", "dir": "y", "velocity": 0})";
  CHECK(open(at_side, "", loose));
  CHECK(open(at_side, along, loose));
  CHECK_FALSE(open(at_side, wall, loose));
  CHECK_FALSE(open(R"({"min": [1, 0], "max": [3, 3]})", "", loose));
  CHECK_FALSE(open(at_side, "", R"("LinearElastic")"));
  // Not of the floor, which is held, and not of the top, which gravity leaves.
  CHECK(about_sand(at_side, wall, loose).find("touches the side") == std::string::npos);
}

TEST_CASE("a gauge at a plane that does not meet the mesh is warned of") {
  const auto apart = [](const std::string& x) {
    return about_sand(R"({"min": [1, 0], "max": [3, 3]})", "", loose,
                      R"(, "post_processing": {"gauge_steps": 1, "gauges": [{"name": "gate",
                        "type": "plane", "at": [)" + x + R"(, 0], "normal": [1, 0]}]})")
               .find("the plane of the gauge 'gate' does not meet the mesh") != std::string::npos;
  };
  CHECK(apart("9"));
  CHECK(apart("-1"));
  CHECK_FALSE(apart("5"));
}

TEST_CASE("a layer that yields and is hardly thicker than cells is warned of") {
  const auto thin = [](const char* law, double thickness, const char* cells) {
    const lahar::Scenario s = lahar::read_scenario_text(
        R"({"mesh": {"structured": {"cell_size": 1, "counts": )" + std::string(cells) + R"(}},
            "materials": [{"name": "weak", "density": 1000, "youngs_modulus": 1e6,
                           "poisson_ratio": 0.3, "type": )" +
            law + R"(}],
            "particles": [{"generator": {"type": "region", "material": 0, "per_cell": 1,
              "region": {"box": {"min": [0, 4], "max": [9, )" +
            std::to_string(4 + thickness) + R"(]}}}}], "analysis": {"nsteps": 1}})",
        "");
    return lahar::format_problems(s.warnings, "warning").find("at most two cells thick") !=
           std::string::npos;
  };
  const char* const sand =
      R"("MohrCoulomb", "friction": 30, "dilation": 0, "cohesion": 0, "tension_cutoff": 0)";
  CHECK(thin(sand, 2, "[9, 9]"));
  CHECK_FALSE(thin(sand, 3, "[9, 9]"));
  CHECK_FALSE(thin(sand, 3, "[1, 9]"));  // a column
  CHECK(thin(sand, 2, "[1, 9]"));
  CHECK_FALSE(thin(R"("LinearElastic")", 2, "[9, 9]"));
}

TEST_CASE("a layer between other materials is warned of until it is five cells thick") {
  const auto thin = [](double thickness) {
    const auto soil = [](const char* name, double low, double high) {
      return R"({"generator": {"type": "region", "per_cell": 2, "material": ")" +
             std::string(name) + R"(", "region": {"box": {"min": [0, )" + std::to_string(low) +
             R"(], "max": [20, )" + std::to_string(high) + R"(]}}}})";
    };
    const std::string law = R"("density": 2000, "youngs_modulus": 1e7, "poisson_ratio": 0.3,
      "type": "MohrCoulomb", "dilation": 0, "cohesion": 1e4, "tension_cutoff": 0, "friction": )";
    const lahar::Scenario s = lahar::read_scenario_text(
        R"({"mesh": {"structured": {"cell_size": 1, "counts": [20, 20]}},
            "materials": [{"name": "strong", )" +
            law + R"(35}, {"name": "weak", )" + law + R"(15}],
            "particles": [)" +
            soil("strong", 0, 6) + "," + soil("weak", 6, 6 + thickness) + "," +
            soil("strong", 6 + thickness, 18) + R"(], "analysis": {"nsteps": 1}})",
        "");
    const std::string said = lahar::format_problems(s.warnings, "warning");
    CHECK(said.find("material 'strong' is at most") == std::string::npos);
    return said.find("material 'weak' is at most four cells thick") != std::string::npos;
  };
  CHECK(thin(2));
  CHECK(thin(4));
  CHECK_FALSE(thin(5));
}

TEST_CASE("a material beside a much stiffer one is warned of where functions are smooth") {
  const auto said = [](double stiff, double thickness, const char* functions = "quadratic_spline") {
    const auto soil = [](const char* name, double low, double high) {
      return fmt::format(R"({{"generator": {{"type": "region", "per_cell": 2, "material": "{}",
          "region": {{"box": {{"min": [0, {}], "max": [4, {}]}}}}}}}})",
                         name, low, high);
    };
    const auto law = [](const char* name, double modulus) {
      return fmt::format(R"({{"name": "{}", "type": "LinearElastic", "density": 2000,
                              "youngs_modulus": {}, "poisson_ratio": 0.3}})",
                         name, modulus);
    };
    const lahar::Scenario s = lahar::read_scenario_text(
        fmt::format(R"({{"mesh": {{"structured": {{"cell_size": 1, "counts": [4, 40]}}}},
            "materials": [{}, {}], "particles": [{}, {}],
            "analysis": {{"nsteps": 1, "shape_functions": "{}"}}}})",
                    law("rock", stiff), law("clay", 1e7), soil("rock", 0, 6),
                    soil("clay", 6, 6 + thickness), functions),
        "");
    return lahar::format_problems(s.warnings, "warning");
  };
  const std::string meets = "material 'clay' meets 'rock', which is 100 times as stiff";
  CHECK(said(1e9, 4).find(meets) != std::string::npos);
  CHECK(said(1e9, 4).find("about 11 % too little") != std::string::npos);
  CHECK(said(1e9, 8).find("about 6 % too little") != std::string::npos);
  for (const std::string& other : {said(1e9, 24), said(3e7, 4), said(1e9, 4, "gimp")})
    CHECK(other.find("times as stiff: smooth") == std::string::npos);
  CHECK(said(1e9, 4).find("material 'rock' meets") == std::string::npos);
}
