// What scenarios say of rigid bodies, and what they are refused with.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <numbers>
#include <string>
#include <variant>

#include "io/scenario/scenario.h"
#include "io/scenario/stages.h"
#include "tests/io/scenario/said.h"
#include "tests/within.h"

using namespace lahar;
using namespace lahar::test;

namespace {

struct Parts {
  std::string bodies;
  std::string analysis = R"("mpm_scheme": "musl", "dt": 1e-4)";
  std::string more = "";  ///< keys after these
  std::string geometry = R"("bed": {"points": [[0, 0.5], [4, 0.2]]})";
  std::string materials = "";  ///< beside the first
  std::string boundary = "", sets = "";
};

Scenario scenario_of(const Parts& parts, std::size_t stage = 0) {
  ScenarioOptions options;
  options.stage = stage;
  return read_scenario_text(fmt::format(R"({{
    "mesh": {{"structured": {{"cell_size": 0.5, "extent": [4, 4]}},
             "boundary_conditions": {{{}}}}},
    "sets": {{"nodes": {{{}}}}},
    "geometry": {{{}}},
    "materials": [{{"type": "LinearElastic", "density": 1000, "youngs_modulus": 1e6,
                   "poisson_ratio": 0.2}}{}],
    "rigid_bodies": [{}],
    "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": 0,
                                 "region": {{"box": {{"min": [1, 1], "max": [2, 2]}}}}}}}}],
    "external_loading_conditions": {{"gravity": [0, -10]}},
    "analysis": {{{}, "nsteps": 1}}{}}})",
                                        parts.boundary, parts.sets, parts.geometry, parts.materials,
                                        parts.bodies, parts.analysis, parts.more),
                            "", options);
}

Model<2> model_of(const std::string& bodies) {
  return std::get<Model<2>>(std::move(scenario_of({.bodies = bodies}).model));
}

std::string refusal(const std::string& bodies) {
  return refusal_of([&] { scenario_of({.bodies = bodies}); });
}

const std::string round_body = R"("region": {"sphere": {"centre": [3, 3], "radius": 0.5}})";

}  // namespace

TEST_CASE("rigid bodies of one name are refused, also where one has its number for a name") {
  for (const char* first : {R"("name": "a", )", R"("name": "1", )"}) {
    const std::string other = std::string(first) == R"("name": "1", )" ? "" : first;
    CHECK(refusal("{" + std::string(first) + round_body + "}, {" + other + round_body + "}")
              .find("two rigid bodies are named") != std::string::npos);
  }
}

TEST_CASE("rigid bodies: what moves how, and of what shape") {
  const Model<2> model = model_of(R"(
    {"region": {"below": "bed"}, "friction": 0.4, "cohesion": 100},
    {"name": "paddle", "region": {"box": {"min": [3, 1], "max": [3.5, 2]}}, "velocity": [1, 0],
     "friction": "rough"},
    {"region": {"difference": [{"sphere": {"centre": [3, 3], "radius": 0.5}},
                               {"half_space": {"point": [3, 3], "normal": [0, 1]}}]},
     "density": 1000, "spin": 2, "fixed": ["x"]},
    {"region": {"cylinder": {"from": [1, 3], "to": [1, 2.5], "radius": 0.2, "radius_to": 0}},
     "mass": 7})");
  using Motion = RigidBody<2>::Motion;
  const auto& bodies = model.rigid_bodies;
  REQUIRE(bodies.size() == 4);
  CHECK(model.analysis.free_bodies);
  CHECK(bodies[0].motion == Motion::fixed);
  CHECK(bodies[0].name == "0");
  CHECK(bodies[0].friction == 0.4);
  CHECK(bodies[0].cohesion == 100);
  CHECK(bodies[0].solid->nearest({2, 0.1}).distance < 0);
  CHECK(bodies[0].solid->nearest({2, 0.6}).distance > 0);
  CHECK(bodies[1].motion == Motion::prescribed);
  CHECK(std::isinf(bodies[1].friction));
  // A half disc: its centre is 4 r / (3 pi) above the diameter.
  CHECK(bodies[2].motion == Motion::free);
  CHECK(bodies[2].mass == within(1e-3, 1000 * std::numbers::pi / 8));
  CHECK(bodies[2].centre[0] == within(1e-6, 3));
  CHECK(bodies[2].centre[1] == within(1e-3, 3 + 4 * 0.5 / (3 * std::numbers::pi)));
  CHECK(bodies[2].held == Vec<2>(1, 0));
  CHECK(bodies[2].spin[2] == 2);
  // A triangle, a third of its height from the wide end.
  CHECK(bodies[3].mass == doctest::Approx(7));
  CHECK(bodies[3].centre[1] == within(1e-3, 3 - 0.5 / 3));
}

TEST_CASE("rigid bodies: the centre is that of the volume, unless the input gives it") {
  const Model<2> model = model_of(R"(
    {"region": {"box": {"min": [3, 1], "max": [3.1, 1.7]}}},
    {"region": {"polygon": {"points": [[3, 2], [3.6, 2], [3, 2.3]]}}, "velocity": [1, 0]},
    {"region": {"sphere": {"centre": [3, 3], "radius": 0.5}}, "centre": [1, 3], "spin": 2},
    {"region": {"sphere": {"centre": [3, 3], "radius": 0.5}}, "centre": [1, 2]},
    {"region": {"half_space": {"point": [0, 0.2], "normal": [0, 1]}}},
    {"region": {"below": "bed"}})");
  const auto centre = [&](std::size_t k) { return model.rigid_bodies[k].centre; };
  CHECK((centre(0) - Vec<2>(3.05, 1.35)).norm() < 1e-12);
  CHECK((centre(1) - Vec<2>(3.2, 2.1)).norm() < 1e-4);
  CHECK(centre(2) == Vec<2>(1, 3));
  CHECK(centre(3) == Vec<2>(1, 2));
  CHECK(centre(4) == Vec<2>(0, 0));  // without an end
  CHECK(centre(5) == Vec<2>(0, 0));
}

namespace {

/// A free ball of 2 kg in space with these keys.
Scenario ball_in_space(const std::string& keys) {
  return read_scenario_text(fmt::format(R"({{
    "mesh": {{"structured": {{"cell_size": 0.5, "extent": [4, 4, 4]}}}},
    "materials": [{{"type": "LinearElastic", "density": 1000, "youngs_modulus": 1e6,
                   "poisson_ratio": 0.2}}],
    "rigid_bodies": [{{"region": {{"sphere": {{"centre": [3, 3, 3], "radius": 0.5}}}}, {}}}],
    "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": 0,
                                 "region": {{"box": {{"max": [1, 1, 1]}}}}}}}}],
    "analysis": {{"dt": 1e-4, "nsteps": 1}}}})",
                                        keys),
                            "");
}

std::string refusal_in_space(const std::string& keys) {
  return refusal_of([&] { ball_in_space(keys); });
}

}  // namespace

TEST_CASE("rigid bodies: moments of inertia are those of the volume, unless the input gives them") {
  const Model<2> model =
      model_of("{" + round_body + R"(, "mass": 8}, {"name": "hollow", "mass": 8, "inertia": 1.5,
        "region": {"sphere": {"centre": [1, 3], "radius": 0.5}}})");
  CHECK(model.rigid_bodies[0].inertia(2, 2) == within(1e-4, 8 * 0.25 / 2));
  CHECK(model.rigid_bodies[1].inertia(2, 2) == 1.5);
  const auto inertia = [](const std::string& keys) {
    return std::get<Model<3>>(ball_in_space(keys).model).rigid_bodies[0].inertia;
  };
  const Eigen::Matrix3d solid = inertia(R"("mass": 2)");
  CHECK((solid - 0.4 * 2 * 0.25 * Eigen::Matrix3d::Identity()).norm() < 1e-3 * solid.norm());
  Eigen::Matrix3d expected = Vec<3>(3, 4, 5).asDiagonal();
  CHECK(inertia(R"("mass": 2, "inertia": [3, 4, 5])") == expected);
  expected << 3, 0.1, 0.3, 0.1, 4, 0.2, 0.3, 0.2, 5;
  CHECK(inertia(R"("density": 2, "inertia": [3, 4, 5, 0.1, 0.2, 0.3])") == expected);
}

TEST_CASE("rigid bodies: moments of inertia that no body has are refused") {
  const auto in_plane = [](const std::string& keys) {
    return refusal("{" + round_body + ", " + keys + "}");
  };
  CHECK(says(in_plane(R"("inertia": 1)"), "'inertia' is of free bodies"));
  CHECK(says(in_plane(R"("velocity": [1, 0], "inertia": 1)"), "'inertia' is of free bodies"));
  CHECK(says(in_plane(R"("mass": 1, "inertia": [1, 1, 1])"), "a number in two dimensions"));
  CHECK(says(in_plane(R"("mass": 1, "inertia": 0)"), "'inertia' must be above 0, found 0"));
  CHECK(says(refusal_of([] {
               scenario_of({.bodies = "{" + round_body + R"(, "mass": 1, "inertia": 1})",
                            .analysis = R"("plane": "axisymmetric", "dt": 1e-4)"});
             }),
             "a body of revolution does not turn"));
  CHECK(says(refusal_in_space(R"("mass": 2, "inertia": 3)"),
             "3 or 6 numbers in three dimensions, found 1"));
  CHECK(says(refusal_in_space(R"("mass": 2, "inertia": [3, 4, 5, 0])"), "found 4"));
  CHECK(says(refusal_in_space(R"("mass": 2, "inertia": [3, 4, 0])"), "must be above 0"));
  // Its principal moments are -1, 5 and 7.
  CHECK(says(refusal_in_space(R"("mass": 2, "inertia": [3, 3, 5, 4, 0, 0])"),
             "the principal moments of 'inertia', -1, 5 and 7, must be above 0"));
  CHECK(says(refusal_in_space(R"("mass": 2, "inertia": [3, 4, 7.1])"),
             "no body has the principal moments 3, 4 and 7.1 of 'inertia'"));
  CHECK(refusal_in_space(R"("mass": 2, "inertia": [3, 4, 7])") == "");  // a plate
}

TEST_CASE("rigid bodies: mistakes in what is said of them") {
  CHECK(says(refusal(R"({"region": {"all": true}})"), "needs a region that has a surface"));
  CHECK(says(refusal(R"({"region": {"below": "bad"}})"), "no geometry named 'bad'"));
  CHECK(says(refusal(R"({"friction": 1})"), "'region' is missing"));
  CHECK(
      says(refusal("{" + round_body + R"(, "friction": "smooth"})"), "a coefficient or \"rough\""));
  CHECK(says(refusal("{" + round_body + R"(, "friction": -1})"), "at least 0"));
  CHECK(says(refusal("{" + round_body + R"(, "spin": [0, 1]})"), "a number in two dimensions"));
  CHECK(says(refusal("{" + round_body + R"(, "spin": 1})"), "needs 'centre'"));
  CHECK(says(refusal("{" + round_body + R"(, "mass": 1, "density": 1})"), "does not go together"));
  CHECK(says(refusal("{" + round_body + R"(, "fixed": ["x"]})"), "of free bodies"));
  CHECK(says(refusal("{" + round_body + R"(, "mass": 1, "fixed": ["up"]})"), "axes and \"spin\""));
  CHECK(says(refusal("{" + round_body + R"(, "restitution": 1.5})"), "at most 1"));
  CHECK(says(refusal("{" + round_body + R"(, "math_function_id": 0})"), "of prescribed motion"));
  CHECK(
      says(refusal(R"({"region": {"half_space": {"point": [0, 0], "normal": [0, 1]}}, "mass": 1})"),
           "a body without an end"));
  CHECK(says(refusal(R"({"region": {"box": {"min": [0, 0], "max": [0, 1]}}})"), "surface"));
}

TEST_CASE("rigid bodies: sides all of whose nodes are held along the normal hold free ones") {
  const auto sides_of = [](const std::string& motion, const std::string& boundary) {
    const Parts parts{.bodies = "{" + round_body + motion + "}",
                      .boundary = boundary,
                      .sets = R"("floor": {"half_space": {"point": [0, 0], "normal": [0, 1]}},
                   "part": {"box": {"min": [0, 0], "max": [3, 0.1]}},
                   "right": {"half_space": {"point": [4, 0], "normal": [-1, 0]}})"};
    return std::get<Model<2>>(std::move(scenario_of(parts).model)).sides;
  };
  const std::string free = R"(, "density": 100)";
  const std::string floor = R"("walls": [{"nset": "floor", "normal": [0, 1], "friction": 0.3}])";
  const auto both = sides_of(
      free, floor + R"(, "velocity_constraints": [{"nset": "right", "dir": "x", "velocity": 0}])");
  REQUIRE(both.size() == 2);
  CHECK(both[0].name == "x = 4");
  CHECK(both[0].friction == 0);
  CHECK(both[0].solid->nearest({4.5, 1}).distance == -0.5);
  CHECK(both[1].name == "y = 0");
  CHECK(both[1].friction == 0.3);
  CHECK(both[1].solid->nearest({1, 0.5}).distance == 0.5);
  CHECK(sides_of("", floor).empty());  // no free body
  CHECK(sides_of(free, R"("walls": [{"nset": "part", "normal": [0, 1]}])").empty());
  CHECK(sides_of(free, R"("velocity_constraints": [{"nset": "floor", "dir": "x", "velocity": 0},
                          {"nset": "right", "dir": "x", "velocity": 1}])")
            .empty());
  // Walls of CB-Geo MPM rub only, constraints hold.
  CHECK(sides_of(free, R"("friction_constraints": [{"nset": "floor", "dir": "y", "sign_n": -1,
                          "friction": 0.3, "two_sided": true}])")
            .empty());
}

TEST_CASE("rigid bodies: sides that move, or that a body begins behind, are warned of") {
  const auto warnings = [](const std::string& boundary, double y) {
    const Parts parts{.bodies = fmt::format(R"({{"name": "b", "density": 100,
                    "region": {{"sphere": {{"centre": [3, {}], "radius": 0.5}}}}}})",
                                            y),
                      .boundary = boundary,
                      .sets = R"("floor": {"half_space": {"point": [0, 0], "normal": [0, 1]}})"};
    const Scenario scenario = scenario_of(parts);
    std::string all;
    for (const auto& warning : scenario.warnings) all += warning.message + "\n";
    return std::pair(std::get<Model<2>>(scenario.model).sides.size(), all);
  };
  const std::string floor = R"("walls": [{"nset": "floor", "normal": [0, 1], "friction": 0.3}])";
  const auto shaken = warnings(
      floor + R"(, "velocity_constraints": [{"nset": "floor", "dir": "x", "velocity": 1}])", 1);
  CHECK(shaken.first == 0);
  CHECK(shaken.second.find("the side y = 0 moves as its nodes do") != std::string::npos);
  const auto behind = warnings(floor, 0.4);
  CHECK(behind.first == 1);
  CHECK(behind.second.find("'b' begins 0.1 m behind the side y = 0") != std::string::npos);
  CHECK(warnings(floor, 0.49).second.find("behind the side") == std::string::npos);
}

TEST_CASE("rigid bodies: particles that begin inside of one are named, the deepest first") {
  const std::string said = refusal(R"({"name": "hill", "region": {"half_space": {"point": [0, 1.3],
                                                                   "normal": [0, 1]}}})");
  CHECK(says(said, "4 particles begin inside of the rigid body 'hill'"));
  CHECK(says(said, "0.175 m deep at (1.125, 1.125)"));
}

TEST_CASE("rigid bodies: a free one may touch others where it begins, and no more") {
  const auto beside = [](double x, const char* motion) {
    return fmt::format(R"({{{}, "density": 500}}, {{"name": "post", {}
                         "region": {{"box": {{"min": [{}, 2], "max": [4, 4]}}}}}})",
                       round_body, motion, x);
  };
  CHECK(refusal(beside(3.2, "")).find("begin inside of each other, 0.3 m deep") !=
        std::string::npos);
  CHECK(refusal(beside(3.2, R"("density": 500,)")).find("'post' begin inside of each other") !=
        std::string::npos);
  CHECK_NOTHROW(model_of(beside(3.5, "")));
  CHECK_NOTHROW(model_of(beside(3.48, "")));
}

TEST_CASE("rigid bodies: what does not go together with them is refused") {
  const auto with = [](const std::string& analysis,
                       const std::string& motion = R"("velocity": [1, 0])") {
    return refusal_of([&] {
      scenario_of({.bodies = "{" + round_body + ", " + motion + "}", .analysis = analysis});
    });
  };
  const std::string implicit = R"("mpm_scheme": "newmark", "dt": 0.1)";
  CHECK(!says(with(implicit), "implicit steps"));
  CHECK(says(with(implicit, R"("density": 1000)"), "implicit steps where forces move them"));
  CHECK(says(with(R"("plane": "stress", "dt": 1e-4)"), "plane stress"));
  CHECK(says(with(R"("mpm_scheme": "usl", "dt": 1e-4)"), "usl"));
}

TEST_CASE("rigid bodies hold a liquid in pores, but where forces move them, and not with usf") {
  const auto with = [](const std::string& motion, const std::string& scheme) {
    return refusal_of([&] {
      read_scenario_text(R"({
        "mesh": {"structured": {"cell_size": 0.5, "extent": [4, 4]}},
        "materials": [
          {"name": "soil", "type": "LinearElastic", "density": 2600, "youngs_modulus": 1e6,
           "poisson_ratio": 0.2, "porosity": 0.4, "k_x": 1e-3},
          {"name": "water", "type": "Newtonian", "density": 1000, "bulk_modulus": 1e7,
           "dynamic_viscosity": 1e-3}],
        "rigid_bodies": [{)" +
                             round_body + motion + R"(}],
        "particles": [{"generator": {"type": "region", "per_cell": 2, "material": ["soil", "water"],
                                     "region": {"box": {"min": [1, 1], "max": [2, 2]}}}}],
        "external_loading_conditions": {"gravity": [0, -10]},
        "analysis": {"mpm_scheme": ")" +
                             scheme + R"(", "dt": 1e-4, "nsteps": 1}})",
                         "");
    });
  };
  CHECK(with("", "musl") == "");
  CHECK(with(R"(, "velocity": [1, 0])", "musl") == "");
  CHECK(says(with(R"(, "density": 2000)", "musl"), "a liquid in pores where forces move them"));
  CHECK(says(with("", "usf"), "a liquid in pores but with musl"));
}

TEST_CASE("rigid bodies that are fixed in a direction do not begin with a motion there") {
  const auto with = [](const char* motion) {
    return refusal("{" + round_body + R"(, "mass": 1, )" + motion + "}");
  };
  CHECK(says(with(R"("velocity": [1, 0], "fixed": ["x"])"),
             "'velocity' along x is 1, but 'fixed' holds the body there"));
  CHECK(says(with(R"("spin": 2, "fixed": ["spin"])"), "'spin' is not 0, but 'fixed' holds it"));
  CHECK(with(R"("velocity": [0, 1], "spin": 2, "fixed": ["x"])") == "");
  CHECK(with(R"("velocity": [1, 0], "spin": 0, "fixed": ["y", "spin"])") == "");
}

TEST_CASE("rigid bodies around an axis lie on it: the axis is no side that they are behind") {
  const Scenario scenario = scenario_of(
      {.bodies = R"({"density": 100, "region": {"sphere": {"centre": [0, 3], "radius": 0.5}}})",
       .analysis = R"("plane": "axisymmetric")",
       .boundary = R"("walls": [{"nset": "floor", "normal": [0, 1], "friction": 0.3}])",
       .sets = R"("floor": {"half_space": {"point": [0, 0], "normal": [0, 1]}})"});
  for (const auto& warning : scenario.warnings)
    CHECK(warning.message.find("behind the side") == std::string::npos);
  const auto& sides = std::get<Model<2>>(scenario.model).sides;
  REQUIRE(sides.size() == 1);
  CHECK(sides[0].name == "y = 0");
}

TEST_CASE("springs that begin in a later stage know what moved before: a warning, but with reset") {
  const auto warned = [](const std::string& stage_keys) {
    const auto stage = [&](std::size_t k) {
      return scenario_of({.bodies = "",
                          .more = R"(, "stages": [{"name": "a"}, {"name": "b")" + stage_keys + "}]",
                          .sets = R"("low": {"half_space": {"point": [0, 0], "normal": [0, 1]}})"},
                         k);
    };
    const auto found = changes_of_method(body_of(stage(0)), stage(1));
    return found.empty() ? "" : found.front().message;
  };
  const std::string springs = R"(, "mesh": {"boundary_conditions": {"spring_constraints": [
      {"nset": "low", "dir": "y", "stiffness": 1e6}]}})";
  CHECK(warned(springs) ==
        "stage b: 'spring_constraints' begin here, and their springs are stretched by all that "
        "moved in the stages before");
  CHECK(warned(springs + R"(, "reset": ["displacement"])") == "");
  CHECK(warned("") == "");
}

TEST_CASE("walls whose nodes constraints move along them are warned of") {
  const auto warns = [](const std::string& velocity) {
    const Scenario scenario =
        scenario_of({.bodies = "",
                     .boundary = R"("walls": [{"nset": "low", "normal": [0, 1], "friction": 0.3}],
            "velocity_constraints": [{"nset": "low", "dir": "x", "velocity": )" +
                                 velocity + "}]",
                     .sets = R"("low": {"half_space": {"point": [0, 0], "normal": [0, 1]}})"});
    return std::ranges::any_of(scenario.warnings, [](const auto& warning) {
      return warning.message.find("constraints move nodes of a wall along it") != std::string::npos;
    });
  };
  CHECK(warns("0.5"));
  CHECK(!warns("0"));
}

TEST_CASE("rigid bodies that go on as they moved are warned of where a stage says otherwise") {
  const auto warned = [](const std::string& body) {
    const auto stage = [&](std::size_t k) {
      return scenario_of(
          {.bodies = "{" + round_body + R"(, "mass": 10, "velocity": [0, 1]})",
           .more = R"(, "stages": [{"name": "a"}, {"name": "b", "rigid_bodies": [{)" + round_body +
                   body + "}]}]"},
          k);
    };
    const auto found = changes_of_method(body_of(stage(0)), stage(1));
    return found.empty() ? "" : found.front().message;
  };
  const std::string text =
      "stage b: 'velocity' and 'spin' of the rigid body '0' have no effect: it is free, and goes "
      "on as it moved in the stage before";
  CHECK(warned(R"(, "mass": 10, "velocity": [0, 2])") == text);
  CHECK(warned(R"(, "mass": 10, "velocity": [0, 1], "spin": 3)") == text);
  CHECK(warned(R"(, "mass": 10, "velocity": [0, 1], "friction": 1)") == "");
  CHECK(warned(R"(, "mass": 10)") == "");
  CHECK(warned(R"(, "velocity": [0, 2])") == "");                             // prescribed
  CHECK(warned(R"(, "name": "new", "mass": 10, "velocity": [0, 2])") == "");  // a new body
}

TEST_CASE("stages with another number of bodies in contact are refused where contact is") {
  const auto stage = [](std::size_t k) {
    const Parts parts{
        .bodies = "",
        .analysis = R"("mpm_scheme": "musl", "dt": 1e-4, "interface": true)",
        .more = R"(, "stages": [{"name": "a"}, {"name": "b", "place": [{"generator":
          {"type": "region", "per_cell": 2, "material": 1,
           "region": {"box": {"min": [3, 3], "max": [3.5, 3.5]}}}}]}])",
        .materials = R"(, {"type": "LinearElastic", "density": 1500, "youngs_modulus": 1e6,
                           "poisson_ratio": 0.2})"};
    return scenario_of(parts, k);
  };
  try {
    check_body(body_of(stage(0)), stage(1));
    FAIL("it is accepted");
  } catch (const InputError& error) {
    const Problem& problem = error.problems().front();
    CHECK(problem.where == "/analysis/interface");
    CHECK(
        problem.message ==
        "stage b: the number of bodies in contact, here 2 and before 1, is the same in all stages");
  }
}

TEST_CASE("rigid bodies around an axis move along it: spins and free motion along x are refused") {
  const auto with = [](const std::string& more) {
    return refusal_of([&] {
      scenario_of({.bodies = "{" + round_body + more + "}",
                   .analysis = R"("plane": "axisymmetric", "dt": 1e-4)"});
    });
  };
  CHECK(says(with(R"(, "spin": 1, "centre": [0, 0])"), "does not turn out of its axis"));
  CHECK(says(with(R"(, "mass": 1, "velocity": [1, 0])"), "moves along the axis"));
}

TEST_CASE("rigid bodies of stages may move, and one that is there again is the same body") {
  const auto stage = [](const std::string& stages, std::size_t k) {
    return scenario_of({.bodies = "{" + round_body + R"(, "mass": 10})",
                        .more = R"(, "stages": [{"name": "a"}, {"name": "b")" + stages + "}]"},
                       k);
  };
  CHECK(refusal_of([&] { check_body(body_of(stage("", 0)), stage("", 1)); }) == "");
  const std::string held = R"(, "rigid_bodies": [{)" + round_body + "}]";
  CHECK(refusal_of([&] { check_body(body_of(stage(held, 0)), stage(held, 1)); }) == "");
  const std::string other = R"(, "rigid_bodies": [{"region": {"box": {"min": [3, 3],
                                                                     "max": [4, 4]}}}])";
  CHECK(says(refusal_of([&] { check_body(body_of(stage(other, 0)), stage(other, 1)); }),
             "the rigid body '0', by 'region' and 'centre', is the same in all stages"));
}
