// Scenarios of soil with a liquid in its pores: what they mean, and what is refused.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <vector>

#include "io/scenario/scenario.h"
#include "tests/io/scenario/said.h"

using namespace lahar;
using namespace lahar::test;

namespace {

struct Parts {
  std::string material = R"(["soil", "water"])";
  std::string soil = R"("porosity": 0.4, "k_x": 1e-3)";
  std::string constraints = R"({"nset": "base", "dir": "y", "velocity": 0})";
  std::string conditions = "";  // more of them
  std::string mesh = "", analysis = R"("end_time": 1)", bulk_modulus = "2e9";
};

std::string text_of(const Parts& parts) {
  return fmt::format(R"({{
    "mesh": {{"structured": {{"cell_size": 0.5, "extent": [1, 2]}}{},
      "boundary_conditions": {{"velocity_constraints": [{}]{}}}}},
    "sets": {{"nodes": {{"base": {{"half_space": {{"point": [0, 0], "normal": [0, 1]}}}},
                        "middle": {{"box": {{"min": [0, 1], "max": [1, 1]}}}},
                        "top": {{"box": {{"min": [0, 2], "max": [1, 2]}}}}}}}},
    "materials": [
      {{"name": "soil", "type": "LinearElastic", "density": 2650, "youngs_modulus": 1e7,
       "poisson_ratio": 0.2, {}}},
      {{"name": "water", "type": "Newtonian", "density": 1000, "bulk_modulus": {},
       "dynamic_viscosity": 1e-3}}],
    "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": {}}}}}],
    "external_loading_conditions": {{"gravity": [0, -10]}},
    "analysis": {{{}}}}})",
                     parts.mesh, parts.constraints, parts.conditions, parts.soil,
                     parts.bulk_modulus, parts.material, parts.analysis);
}

Model<2> model_of(const Parts& parts) {
  return std::get<Model<2>>(read_scenario_text(text_of(parts), "").model);
}

std::string refusal(const Parts& parts) {
  return refusal_of([&] { read_scenario_text(text_of(parts), ""); });
}

}  // namespace

TEST_CASE("two materials of a generator are a skeleton and the liquid in its pores") {
  const Model<2> model = model_of({});
  CHECK(model.analysis.two_phase);
  const Material& soil = model.materials[0];
  REQUIRE(soil.liquid.has_value());
  CHECK(soil.density == doctest::Approx(0.6 * 2650));
  CHECK(soil.liquid->grain_density == 2650);
  CHECK(soil.liquid->bulk_modulus == 2e9);
  for (const double resistance : {soil.liquid->resistance[0], soil.liquid->resistance[1]})
    CHECK(resistance == doctest::Approx(9810 / 1e-3));
  const Model<2> other = model_of(
      {.soil = R"("porosity": 0.4, "k_x": 2e-12, "k_y": 1e-12, "intrinsic_permeability": true)"});
  CHECK(other.materials[0].liquid->resistance[0] == doctest::Approx(1e-3 / 2e-12));
  CHECK(other.materials[0].liquid->resistance[1] == doctest::Approx(1e-3 / 1e-12));
}

TEST_CASE("what holds soil holds its water, unless a constraint names a phase") {
  const auto held = [](const std::string& phase) {
    const Model<2> model = model_of(
        {.constraints = fmt::format(R"({{"nset": "base", "dir": "y"{}, "velocity": 0}})", phase)});
    return std::pair(entries_of<NodeVelocity>(model).size(), model.liquid_velocities.size());
  };
  CHECK(held("") == std::pair<std::size_t, std::size_t>(3, 3));
  CHECK(held(R"(, "phase": "skeleton")") == std::pair<std::size_t, std::size_t>(3, 0));
  CHECK(held(R"(, "phase": "liquid")") == std::pair<std::size_t, std::size_t>(0, 3));
}

TEST_CASE("a water table gives the pressures of water at rest below it") {
  const Model<2> model = model_of({.mesh = R"(, "particles_pore_pressures": {
    "type": "water_table", "water_tables": [{"position": 0, "h0": 1}, {"position": 1, "h0": 2}]})"});
  REQUIRE(model.particles.pore_pressure.size() == model.particles.x.size());
  for (std::size_t p = 0; p < model.particles.x.size(); ++p) {
    const Vec<2>& x = model.particles.x[p];
    CHECK(model.particles.pore_pressure[p] ==
          doctest::Approx(std::max(0.0, 1e4 * (1 + x[0] - x[1]))));
  }
}

TEST_CASE("two phases: values that look like those of other units are doubted") {
  const auto doubts = [](const Parts& parts) {
    std::vector<std::string> messages;
    for (const Problem& problem : read_scenario_text(text_of(parts), "").warnings)
      messages.push_back(problem.message);
    return messages;
  };
  const std::vector<std::string> none = doubts({});
  const auto adds = [&](const Parts& parts, const std::string& message) {
    std::vector<std::string> more = doubts(parts);
    REQUIRE(more.size() == none.size() + 1);
    CHECK(std::count(more.begin(), more.end(), message) == 1);
  };
  adds({.soil = R"("porosity": 0.4, "k_x": 86.4)"},
       "'k_x' is 86.4 m/s: even coarse gravel has less");
  adds({.soil = R"("porosity": 0.4, "k_x": 1e-12)"}, "'k_x' is 1e-12 m/s: even clay has more");
  CHECK(doubts({.soil = R"("porosity": 0.4, "k_x": 1e-12, "intrinsic_permeability": true)"}) ==
        none);
  CHECK(doubts({.soil = R"("porosity": 0.4, "k_x": 1e-11)"}) == none);
  adds({.bulk_modulus = "2.2"},
       "the liquid is softer than the skeleton 'soil': bulk_modulus / porosity = 5.5 Pa against "
       "1.11e+07 Pa");
  CHECK(doubts({.soil = R"("porosity": 0.4, "k_x": 0.1)", .bulk_modulus = "1e8"}) == none);
}

TEST_CASE(
    "a water table above the ground without its load, and a surcharge without one, are warned of") {
  const auto said = [](const char* h0, const std::string& more = "") {
    return warnings_of(read_scenario_text(
        text_of({.mesh = fmt::format(R"(, "particles_pore_pressures": {{"type": "water_table",
            "dir_v": 1, "dir_h": 0, "water_tables": [{{"position": 0, "h0": {}}}]}}{})",
                                     h0, more)}),
        ""));
  };
  CHECK(says(said("4"),
             "the water table is above the ground, where nothing loads it: all pore "
             "pressures are 2.12e+04 Pa or more"));
  CHECK_FALSE(says(said("2"), "water table"));
  CHECK(says(said(R"(1}, {"position": 0.5, "h0": 1}, {"position": 1, "h0": 9)"),
             "the water table is above 50 % of the ground, where nothing loads it: pore pressures "
             "are up to "));
  CHECK_FALSE(says(said("2"), "gravity does not act"));
  const Parts sideways{.mesh = R"(, "particles_pore_pressures": {"type": "water_table",
      "dir_v": "x", "dir_h": "y", "water_tables": [{"position": 0, "h0": 1}]})"};
  CHECK(says(warnings_of(read_scenario_text(text_of(sideways), "")),
             "gravity does not act along -x: water has no pressure"));
  CHECK(says(said("2", R"(, "particles_stresses": {"type": "k0", "k0": 0.5, "surcharge": 1e3})"),
             "nothing loads the ground: a surcharge is a stress alone"));
}

TEST_CASE("two phases: an end at rest is warned of, which does not see consolidation") {
  const auto warns = [](const std::string& analysis) {
    return says(warnings_of(read_scenario_text(text_of({.analysis = analysis}), "")),
                "the test of equilibrium does not see that pore pressures still change: drag "
                "balances forces, so the run may end in the middle of consolidation");
  };
  CHECK(warns(R"("end_time": 1, "until": {"imbalance": 1e-3})"));
  CHECK_FALSE(warns(R"("end_time": 1)"));
}

TEST_CASE("water that is held where its pressure is prescribed is warned of") {
  const auto warns = [](const std::string& dir, const std::string& more, double pressure,
                        const std::string& scheme = "projection") {
    const Parts parts{
        .constraints =
            fmt::format(R"({{"nset": "base", "dir": "{}", "velocity": 0{}}})", dir, more),
        .conditions = fmt::format(
            R"(, "pressure_constraints": [{{"nset": "base", "phase_id": 1, "pressure": {}}}])",
            pressure),
        .analysis = fmt::format(R"("mpm_scheme": "{}", "shape_functions": "element", "dt": 1e-4,
                                    "end_time": 1)",
                                scheme)};
    return says(warnings_of(read_scenario_text(text_of(parts), "")),
                "water is held along y at the nodes where its pressure is prescribed");
  };
  CHECK(warns("y", "", 1e3));
  CHECK_FALSE(warns("y", R"(, "phase": "skeleton")", 1e3));
  CHECK_FALSE(warns("x", "", 1e3));
  CHECK_FALSE(warns("y", "", 0));
  CHECK(warns("y", "", 1e3, "musl"));
}

TEST_CASE("prescribed pressures are of water outside or of nodes inside of saturated soil") {
  const auto inside = [](const std::string& set, const std::string& analysis,
                         const std::string& phase = "") {
    const Model<2> model =
        model_of({.constraints = fmt::format(R"({{"nset": "base", "dir": "y"{}, "velocity": 0}},
                    {{"nset": -1, "dir": "x", "velocity": 0}})",
                                             phase),
                  .conditions = fmt::format(R"(, "pressure_constraints": [
                    {{"nset": "{}", "phase_id": 1, "pressure": 1e3}}])",
                                            set),
                  .analysis = analysis});
    std::vector<bool> found;
    for (const NodePressure& given : entries_of<NodePressure>(model)) found.push_back(given.inside);
    return found;
  };
  for (const std::string analysis : {R"("end_time": 1, "shape_functions": "element")",
                                     R"("mpm_scheme": "projection", "dt": 1e-4, "end_time": 1)"}) {
    CAPTURE(analysis);
    CHECK(inside("top", analysis) == std::vector<bool>{false, false, false});
    CHECK(inside("middle", analysis) == std::vector<bool>{true, true, true});
    CHECK(inside("base", analysis) == std::vector<bool>{true, true, true});  // water is held there
    CHECK(inside("base", analysis, R"(, "phase": "skeleton")") ==
          std::vector<bool>{false, false, false});
  }
}

TEST_CASE("with splines a pressure other than 0 is refused in explicit steps") {
  const auto said = [](double pressure, const std::string& functions) {
    return refusal(
        {.conditions = fmt::format(
             R"(, "pressure_constraints": [{{"nset": "base", "pressure": {}}}])", pressure),
         .analysis = fmt::format(R"("end_time": 1, "shape_functions": "{}")", functions)});
  };
  const std::string text = "a pressure other than 0 is not supported yet with splines";
  CHECK(says(said(1e3, "quadratic_spline"), text));
  CHECK(said(0, "quadratic_spline") == "");
  for (const char* functions : {"element", "gimp", "cpdi"}) CHECK(said(1e3, functions) == "");
}

TEST_CASE("with --as-cbgeo prescribed pressures do not press on the ground, which is said") {
  const auto said = [](double pressure) {
    ScenarioOptions options;
    options.as_cbgeo = true;
    return warnings_of(read_scenario_text(
        text_of({.conditions = fmt::format(
                     R"(, "pressure_constraints": [{{"nset": "base", "pressure": {}}}])", pressure),
                 .analysis = R"("dt": 1e-5, "nsteps": 1)"}),
        "", options));
  };
  CHECK(says(said(1e3), "but does not press on the ground with it"));
  CHECK_FALSE(says(said(0), "press on the ground"));
}

TEST_CASE("layers of different porosity are warned of where they would not be at rest") {
  const auto warns = [](const std::string& scheme, double porosity) {
    const std::string text = fmt::format(R"({{
      "mesh": {{"structured": {{"cell_size": 0.5, "extent": [1, 2]}}}},
      "materials": [
        {{"name": "a", "type": "LinearElastic", "density": 2650, "youngs_modulus": 1e7,
         "poisson_ratio": 0.2, "porosity": 0.3, "k_x": 1e-3}},
        {{"name": "b", "type": "LinearElastic", "density": 2650, "youngs_modulus": 1e7,
         "poisson_ratio": 0.2, "porosity": {}, "k_x": 1e-3}},
        {{"name": "water", "type": "Newtonian", "density": 1000, "bulk_modulus": 2e9,
         "dynamic_viscosity": 1e-3}}],
      "particles": [
        {{"generator": {{"type": "region", "per_cell": 2, "material": ["a", "water"],
                        "region": {{"box": {{"max": [1, 1]}}}}}}}},
        {{"generator": {{"type": "region", "per_cell": 2, "material": ["b", "water"],
                        "region": {{"box": {{"min": [0, 1]}}}}}}}}],
      "analysis": {{"mpm_scheme": "{}", "dt": 1e-4, "end_time": 1}}}})",
                                         porosity, scheme);
    return says(warnings_of(read_scenario_text(text, "")),
                "layers of the porosities 0.3 and 0.5 are not at rest with this 'mpm_scheme'");
  };
  CHECK(warns("usf", 0.5));
  CHECK_FALSE(warns("usf", 0.31));
  CHECK_FALSE(warns("musl", 0.5));
  CHECK_FALSE(warns("usl", 0.5));
  CHECK_FALSE(warns("projection", 0.5));
}

TEST_CASE("two phases: a value out of bounds is not missing") {
  try {
    read_scenario_text(text_of({.soil = R"("porosity": 40, "k_x": 1e-3)"}), "");
    FAIL("the porosity was accepted");
  } catch (const InputError& error) {
    REQUIRE(error.problems().size() == 1);
    CHECK(error.problems()[0].message ==
          "'porosity' must be greater than 0 and less than 1, found 40");
  }
}

TEST_CASE("two phases: what is missing or does not go together is said") {
  CHECK(refusal({.soil = R"("k_x": 1e-3)"}) ==
        "'porosity' is missing: 'soil' has a liquid in its pores");
  CHECK(refusal({.soil = R"("porosity": 0.4)"}) ==
        "'k_x' is missing: 'soil' has a liquid in its pores");
  CHECK(refusal({.material = R"(["water", "soil"])"}) == "'soil' cannot be in pores");
  CHECK(refusal({.material = R"(["water", "water"])"}) == "'water' is a fluid, which has no pores");
  CHECK(refusal({.material = R"(["soil", "water", "soil"])"}) ==
        "'material_id' must have one or two materials, found 3");
  CHECK(refusal({.material = R"("soil")",
                 .constraints = R"({"nset": "base", "dir": "y", "phase": "liquid",
                                    "velocity": 0})"}) == "no material has a liquid in its pores");
  CHECK(refusal({.analysis = R"("dt": 1e-6, "nsteps": 1, "type": "MPMExplicit2D")"}) ==
        "particles have a liquid in their pores, but 'type' is of one phase");
  CHECK(refusal({.material = R"("soil")",
                 .analysis = R"("dt": 1e-6, "nsteps": 1, "type": "MPMExplicitTwoPhase2D")"}) ==
        "no particles have a liquid in their pores, but 'type' is of two phases");
  CHECK(refusal({.analysis = R"("end_time": 1, "opening": true)"}) ==
        "'opening' does not go together with a liquid in pores");
}

TEST_CASE("materials of sets and of stages may have the liquid in their pores") {
  const auto scenario = [](const std::string& sets, const std::string& material) {
    return fmt::format(R"({{"mesh": {{"structured": {{"cell_size": 1, "extent": [4, 4]}}}},
      "materials": [
        {{"name": "sand", "type": "LinearElastic", "density": 2600, "youngs_modulus": 1e7,
          "poisson_ratio": 0.2, "porosity": 0.4, "k_x": 1e-3}},
        {{"name": "silt", "type": "LinearElastic", "density": 2600, "youngs_modulus": 1e7,
          "poisson_ratio": 0.2, "porosity": 0.5, "k_x": 1e-5}},
        {{"name": "water", "type": "Newtonian", "density": 1000, "bulk_modulus": 1e8,
          "dynamic_viscosity": 1e-3}}],
      "sets": {{"particles": {{"low": {{"box": {{"min": [0, 0], "max": [4, 1]}}}}}}}},
      "particles": [{{"generator": {{"type": "region", "per_cell": 1, "region": {{"all": true}},
                                     "material": ["sand", "water"]}}}}],
      "external_loading_conditions": {{"gravity": [0, -9.81]}}, "analysis": {{"nsteps": 1}}{},
      "stages": [{{"name": "first"}},
                 {{"name": "second", "change_material": [{{"pset": "low", "material": {}}}]}}]}})",
                       sets, material);
  };
  ScenarioOptions second;
  second.stage = 1;
  const Scenario changed = read_scenario_text(scenario("", R"(["silt", "water"])"), "", second);
  const auto& model = std::get<Model<2>>(changed.model);
  REQUIRE(model.changes.materials.size() == 1);
  CHECK(model.changes.materials[0].material == 1);
  CHECK(model.materials[1].liquid->porosity == 0.5);
  CHECK_THROWS_WITH_AS(read_scenario_text(scenario("", "\"silt\""), "", second),
                       doctest::Contains("this material has no liquid in its pores"), InputError);

  // The first stage knows that a later one uses it.
  CHECK(warnings_of(read_scenario_text(scenario("", R"(["silt", "water"])"), ""))
            .find("has no effect") == std::string::npos);

  const std::string sets = R"(, "material_sets": [{"pset": "low", "material": ["silt", "water"]}])";
  const Scenario layered = read_scenario_text(scenario(sets, R"(["sand", "water"])"), "");
  const auto& particles = std::get<Model<2>>(layered.model).particles;
  CHECK(std::count(particles.material.begin(), particles.material.end(), 1) == 4);
}
