// Sheets and bodies of revolution: what scenarios say of them, and what they are refused with.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <string>
#include <variant>

#include "io/scenario/scenario.h"
#include "tests/io/scenario/said.h"

using namespace lahar;
using namespace lahar::test;

namespace {

constexpr const char* elastic =
    R"("type": "LinearElastic", "youngs_modulus": 1e7, "poisson_ratio": 0.2)";
constexpr const char* water =
    R"("type": "Newtonian", "bulk_modulus": 1e8, "dynamic_viscosity": 1e-3)";

struct Parts {
  std::string plane = "axisymmetric";
  std::string analysis = "";  ///< beside plane and step
  std::string law = elastic;
  std::string boundary = "";
  std::string generator = R"("type": "region", "per_cell": 2, "material": 0)";
  double origin = 0;
  double gravity = 0;         ///< along x
  std::string other = water;  ///< law of the second material
  std::string mesh = "";      ///< after cells and boundary
};

Scenario scenario_of(const Parts& parts) {
  return read_scenario_text(
      fmt::format(R"({{
    "mesh": {{"structured": {{"origin": [{}, 0], "cell_size": 0.5, "extent": [1, 2]}},
             "boundary_conditions": {{{}}}{}}},
    "sets": {{"nodes": {{"low": {{"half_space": {{"point": [0, 0], "normal": [0, 1]}}}},
                       "axis": {{"half_space": {{"point": [0, 0], "normal": [1, 0]}}}}}}}},
    "materials": [{{"density": 2650, "porosity": 0.4, "k_x": 1e-3, {}}}, {{"density": 1000, {}}}],
    "particles": [{{"generator": {{{}}}}}],
    "external_loading_conditions": {{"gravity": [{}, -10]}},
    "analysis": {{"plane": "{}", {} "dt": 1e-5, "nsteps": 1}}}})",
                  parts.origin, parts.boundary, parts.mesh, parts.law, parts.other, parts.generator,
                  parts.gravity, parts.plane, parts.analysis),
      "");
}

Model<2> model_of(const Parts& parts) {
  return std::get<Model<2>>(std::move(scenario_of(parts).model));
}

std::string refusal(const Parts& parts) {
  return refusal_of([&] { scenario_of(parts); });
}

}  // namespace

TEST_CASE("volumes of axisymmetric models are those of rings, whatever makes the particles") {
  double sums[2] = {};
  const std::string cells = R"("type": "gauss", "material": 0, "nparticles_per_dir": 2,
                               "cset_id": -1)";
  const std::string generators[] = {R"("type": "region", "per_cell": 2, "material": 0)", cells};
  for (int k = 0; k < 2; ++k)
    for (const double V : model_of({.generator = generators[k]}).particles.volume) sums[k] += V;
  CHECK(sums[0] == doctest::Approx(2 * std::numbers::pi).epsilon(1e-14));
  CHECK(sums[1] == doctest::Approx(2 * std::numbers::pi).epsilon(1e-14));
  for (const std::string plane : {"strain", "stress"})
    for (const double V : model_of({.plane = plane}).particles.volume) CHECK(V == 0.0625);
}

TEST_CASE("nodes on the axis are held along x, whatever else is said of them") {
  const auto held = [](const Parts& parts) {
    int count = 0;
    const Model<2> model = model_of(parts);
    for (const NodeVelocity& v : entries_of<NodeVelocity>(model))
      if (v.dir == 0 && v.velocity == 0 && model.mesh->node(v.node)[0] == 0) ++count;
    return count;
  };
  CHECK(held({}) == 5);
  CHECK(held({.plane = "strain"}) == 0);
  CHECK(held({.plane = "stress"}) == 0);
  CHECK(held({.boundary =
                  R"("velocity_constraints": [{"nset": "axis", "dir": 0, "velocity": 0}])"}) == 5);
  CHECK(held({.origin = 0.5}) == 0);
}

TEST_CASE("areas of absorbing boundaries are those of rings") {
  const Model<2> model =
      model_of({.boundary = R"("absorbing_constraints": [{"nset": "low", "dir": 1, "delta": 1,
                      "h_min": 0.5, "position": "edge"}])"});
  for (const NodeAbsorption& entry : entries_of<NodeAbsorption>(model)) {
    const double r = std::max(model.mesh->node(entry.node)[0], 0.5 / 3);
    CHECK(entry.area == doctest::Approx(2 * std::numbers::pi * r * 0.5));
  }
  CHECK(entries_of<NodeAbsorption>(model).size() == 3);
}

TEST_CASE("models that deform across their plane are refused where they are not right yet") {
  CHECK(says(refusal({.origin = -0.5}),
             "an axisymmetric mesh begins at x = 0, the axis; this one at x = -0.5 m"));
  CHECK(says(refusal({.gravity = 1}), "gravity of an axisymmetric model acts along the axis, y"));
  CHECK(says(refusal({.plane = "stress", .law = water}), "is a fluid; plane stress is for solids"));
  constexpr const char* sand = R"("type": "MohrCoulomb", "youngs_modulus": 1e7,
    "poisson_ratio": 0.2, "friction": 30, "dilation": 0, "cohesion": 0, "tension_cutoff": 0)";
  CHECK(says(refusal({.plane = "stress", .law = sand}), "has no cohesion"));
  CHECK(says(refusal({.plane = "stress", .analysis = R"("b_bar": true, )"}),
             "B-bar is not supported yet in plane stress"));
  CHECK(says(
      refusal({.plane = "stress", .boundary = R"("absorbing_constraints": [{"nset": "low", "dir": 1,
                                     "delta": 1, "h_min": 0.5, "position": "edge"}])"}),
      "'absorbing_constraints' is not supported yet in plane stress"));
  for (const std::string plane : {"stress", "axisymmetric"}) {
    CAPTURE(plane);
    CHECK(says(refusal({.plane = plane,
                        .generator = R"("type": "region", "per_cell": 2, "material": [0, 1])"}),
               "a liquid in pores is not supported yet"));
    CHECK(says(refusal({.plane = plane,
                        .analysis = R"("mpm_scheme": "musl", "interface": true, )",
                        .generator = R"("type": "region", "per_cell": 2, "material": 0, "region":
                          {"box": {"max": [1, 1]}}}}, {"generator": {"type": "region",
                          "per_cell": 2, "material": 1, "region": {"box": {"min": [0, 1]}})",
                        .other = elastic}),
               "contact of bodies is not supported yet"));
    CHECK(says(refusal({.plane = plane, .analysis = R"("pressure_smoothing": true, )"}),
               "'pressure_smoothing' is not supported yet"));
    CHECK(says(refusal({.plane = plane, .analysis = R"("type": "MPMExplicit2D", )"}),
               "does not go together with the preset cbgeo: CB-Geo MPM has plane strain"));
  }
  CHECK(says(refusal({.analysis = R"("mpm_scheme": "projection", )", .law = water}),
             "a projection is not supported yet in axisymmetric models"));
  CHECK(refusal({}) == "");
  CHECK(refusal({.plane = "stress"}) == "");
  CHECK(refusal({.analysis = R"("b_bar": true, )"}) == "");
  CHECK(refusal({.analysis = R"("mpm_scheme": "newmark", "shape_functions": "element", )"}) == "");
}

TEST_CASE("a plane is for two dimensions") {
  CHECK(says(refusal_of([] {
               read_scenario_text(R"({
    "mesh": {"structured": {"cell_size": 0.5, "extent": [1, 1, 1]}},
    "materials": [{"type": "LinearElastic", "density": 1, "youngs_modulus": 1,
                   "poisson_ratio": 0.2}],
    "particles": [{"generator": {"type": "region", "per_cell": 1, "material": 0}}],
    "analysis": {"plane": "stress", "dt": 1e-3, "nsteps": 1}})",
                                  "");
             }),
             "'plane' is for two dimensions"));
}

TEST_CASE("sheets have no stress across them at the start, whatever is given") {
  const std::string region = R"("type": "region", "per_cell": 2, "material": 0)";
  struct Given {
    Parts parts;
    double most;  ///< stress across that is told
  };
  const Given all[] = {
      {{.plane = "stress", .generator = region + R"(, "stress": -1e5)"}, 1e5},
      {{.plane = "stress", .generator = region + R"(, "stress": [-1e5, -1e5, 7, 3, 0, 0])"}, 7},
      {{.plane = "stress", .generator = region + R"(, "stress": [-1e5, -1e5, 0, 3, 0, 0])"}, 0},
      {{.plane = "stress",
        .mesh = R"(, "particles_stresses": {"type": "isotropic", "values": -1e5})"},
       1e5}};
  for (const Given& given : all) {
    const Scenario scenario = scenario_of(given.parts);
    const std::string said = warnings_of(scenario);
    const std::string expected =
        fmt::format("the stress zz at the start, up to {:g} Pa, is taken as 0", given.most);
    CAPTURE(said);
    CHECK(says(said, expected) == (given.most > 0));
    CHECK(says(said, "the stress zz at the start") == (given.most > 0));
    const auto& stress = std::get<Model<2>>(scenario.model).particles.stress;
    REQUIRE(!stress.empty());
    for (const Voigt& one : stress) {
      CHECK(one[0] == -1e5);
      CHECK(one[1] == -1e5);
      CHECK(one[2] == 0);
    }
    Parts strain = given.parts;
    strain.plane = "strain";
    const Scenario other = scenario_of(strain);
    CHECK(!says(warnings_of(other), "the stress zz at the start"));
    CHECK(std::abs(std::get<Model<2>>(other.model).particles.stress.front()[2]) == given.most);
  }
}

TEST_CASE("K0 is for the stress in the plane of a sheet, and for that across other bodies") {
  for (const std::string plane : {"strain", "stress"}) {
    const Scenario scenario = scenario_of(
        {.plane = plane, .mesh = R"(, "particles_stresses": {"type": "k0", "k0": 0.5})"});
    CHECK(!says(warnings_of(scenario), "the stress zz at the start"));
    for (const Voigt& one : std::get<Model<2>>(scenario.model).particles.stress) {
      CHECK(one[1] < 0);
      CHECK(std::abs(one[0] / one[1] - 0.5) < 1e-12);
      CHECK(one[2] == (plane == "stress" ? 0 : one[0]));
    }
  }
}
