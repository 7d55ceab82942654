// Scenarios of projections: what they mean, and what is refused.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <string>

#include "io/scenario/scenario.h"
#include "tests/io/scenario/said.h"

using namespace lahar;
using namespace lahar::test;

namespace {

struct Parts {
  std::string analysis = R"("mpm_scheme": "projection", "dt": 0.01, "nsteps": 10)";
  std::string generator = R"("type": "region", "per_cell": 2, "material": "water")";
  std::string conditions = "", mesh = "", more = "";
};

constexpr const char* saturated = R"("type": "region", "per_cell": 2,
  "material": ["soil", "water"])";

Scenario scenario_of(const Parts& parts, const ScenarioOptions& options = {}) {
  const std::string text =
      fmt::format(R"({{
    "mesh": {{"structured": {{"cell_size": 0.5, "extent": [1, 2]}}{},
      "boundary_conditions": {{{}}}}},
    "sets": {{"nodes": {{"base": {{"half_space": {{"point": [0, 0], "normal": [0, 1]}}}}}}}},
    "materials": [
      {{"name": "soil", "type": "LinearElastic", "density": 2650, "youngs_modulus": 1e7,
       "poisson_ratio": 0.2, "porosity": 0.4, "k_x": 1e-4}},
      {{"name": "water", "type": "Newtonian", "density": 1000, "bulk_modulus": 2e9,
       "dynamic_viscosity": 1e-3}}],
    "particles": [{{"generator": {{{}}}}}],
    "external_loading_conditions": {{"gravity": [0, -10]}},
    "analysis": {{{}}}{}}})",
                  parts.mesh, parts.conditions, parts.generator, parts.analysis, parts.more);
  return read_scenario_text(text, "", options);
}

Model<2> model_of(const Parts& parts) {
  return std::get<Model<2>>(scenario_of(parts).model);
}

Parts with(const std::string& keys) {
  return {.analysis = R"("mpm_scheme": "projection", "dt": 0.01, "nsteps": 10, )" + keys};
}

std::string refusal(const Parts& parts) {
  return refusal_of([&] { scenario_of(parts); });
}

}  // namespace

TEST_CASE("a projection of a fluid without settings is what the input's tables say") {
  const Model<2> model = model_of({});
  CHECK(model.analysis.scheme == Scheme::projection);
  CHECK(model.analysis.projection.kept == 0.0);
  CHECK(model.analysis.projection.free_surface);
  CHECK(model.analysis.projection.least_fill == 0.25);
  CHECK(model.analysis.linear.method == LinearSolver::Method::automatic);
  CHECK(model.analysis.functions == ShapeFunctions::element);
  CHECK(!model.analysis.step.adaptive);
}

TEST_CASE("a projection of soil and water keeps the pressure") {
  const Model<2> model = model_of({.generator = saturated});
  CHECK(model.analysis.two_phase);
  CHECK(model.analysis.projection.kept == 1.0);
}

TEST_CASE("projections are read as the fork of CB-Geo MPM writes them") {
  const Model<2> model = model_of({.analysis = R"("type": "MPMSemiImplicitNavierStokes2D",
    "dt": 0.01, "nsteps": 10, "scheme_settings": {"beta": 0.5},
    "free_surface_detection": {"type": "none", "volume_tolerance": 0.4},
    "linear_solver": {"assembler_type": "EigenSemiImplicitNavierStokes2D",
      "solver_settings": [{"dof": "pressure", "solver_type": "IterativeEigen",
                           "sub_solver_type": "cg", "max_iter": 70, "tolerance": 1e-5}]})"});
  CHECK(model.analysis.scheme == Scheme::projection);
  CHECK(model.analysis.projection.kept == 0.5);
  CHECK(!model.analysis.projection.free_surface);
  CHECK(model.analysis.projection.least_fill == 0.4);
  CHECK(model.analysis.linear.method == LinearSolver::Method::iterative);
  CHECK(model.analysis.linear.most_iterations == 70);
  CHECK(model.analysis.linear.tolerance == 1e-5);
  const Model<2> soil = model_of({.analysis = R"("type": "MPMSemiImplicitTwoPhase2D",
    "dt": 0.01, "nsteps": 10)",
                                  .generator = saturated});
  CHECK(soil.analysis.scheme == Scheme::projection);
  CHECK(soil.analysis.two_phase);
}

TEST_CASE("what does not go together with a projection is refused") {
  CHECK(says(refusal({.generator = R"("type": "region", "per_cell": 2, "material": "soil")"}),
             "'soil', which is a solid, does not go together with a projection"));
  CHECK(says(refusal(with(R"("shape_functions": "gimp")")),
             "'shape_functions' does not go together with a projection"));
  CHECK(says(refusal(with(R"("pressure_smoothing": true)")),
             "'pressure_smoothing' does not go together with a projection"));
  CHECK(says(refusal(with(R"("type": "MPMExplicit2D")")),
             "'mpm_scheme': \"projection\" does not go together with 'type' \"MPMExplicit2D\""));
  CHECK(says(refusal(with(R"("opening": true)")), "'opening' does not go together with"));
  CHECK(says(refusal({.analysis = R"("mpm_scheme": "projection", "nsteps": 10)"}),
             "'dt' is missing in analysis"));
  CHECK(says(refusal({.analysis = R"("type": "MPMSemiImplicitTwoPhase2D", "dt": 1, "nsteps": 1)"}),
             "no particles have a liquid in their pores"));
}

TEST_CASE("a material that is only named needs no liquid beside it in a projection") {
  CHECK(
      refusal({.generator = saturated, .mesh = R"(, "particles_stresses": {"type": "k0", "k0": 0.4,
                   "materials": [{"material": "soil", "k0": 0.5}]})"}) == "");
  CHECK(refusal({.generator = saturated, .more = R"(, "post_processing": {"gauges": [
                   {"name": "all", "type": "particles", "material": "soil"}]})"}) == "");
}

TEST_CASE("beta of soil and water below 1 is warned of") {
  Parts parts = with(R"("scheme_settings": {"beta": 0})");
  parts.generator = saturated;
  CHECK(says(warnings_of(scenario_of(parts)), "soil gives way to a sudden load"));
}

TEST_CASE("a pressure that is kept does not go together with one that is prescribed") {
  Parts parts = with(R"("scheme_settings": {"beta": 0.5})");
  parts.conditions =
      R"("pressure_constraints": [{"phase_id": 0, "nset": "base", "pressure": 5e3}])";
  CHECK(says(refusal(parts), "a pressure other than 0 does not go together with a 'beta' of 0.5"));
  parts.analysis = Parts().analysis;
  CHECK(refusal(parts) == "");
}

TEST_CASE("a pressure in pores that is kept goes together with one that is prescribed") {
  Parts parts;
  parts.generator = saturated;
  parts.conditions =
      R"("pressure_constraints": [{"phase_id": 1, "nset": "base", "pressure": 5e3}])";
  CHECK(model_of(parts).analysis.projection.kept == 1.0);
}

TEST_CASE("fluids keep no pressure, but with --as-cbgeo") {
  const std::string tank = R"("type": "MPMSemiImplicitNavierStokes2D", "dt": 0.01, "nsteps": 10)";
  CHECK(model_of({.analysis = tank}).analysis.projection.kept == 0.0);
  ScenarioOptions options;
  options.as_cbgeo = true;
  const Scenario reference = scenario_of({.analysis = tank}, options);
  CHECK(std::get<Model<2>>(reference.model).analysis.projection.kept == 1.0);
}

TEST_CASE("relaxation in a projection without gravity has no effect, which is said") {
  const auto said = [](const std::string& settings, const char* gravity) {
    ScenarioOptions options;
    options.overrides = {fmt::format("external_loading_conditions.gravity={}", gravity)};
    return warnings_of(
        scenario_of(with(R"("velocity_update_settings": {)" + settings + "}"), options));
  };
  const std::string text =
      "this has no effect: relaxation goes with the speed of waves, and in a projection without "
      "gravity there are none";
  CHECK(says(said(R"("relaxation": 0.05)", "[0,0]"), text));
  CHECK(says(said(R"("blending_ratio": 0.9)", "[0,0]"), text));
  CHECK_FALSE(says(said(R"("relaxation": 0.05)", "[0,-10]"), text));
  CHECK_FALSE(says(said(R"("relaxation": 0)", "[0,0]"), text));
  CHECK_FALSE(says(said(R"("relaxation_time": 0.1)", "[0,0]"), text));
}

TEST_CASE("a pressure that is prescribed at nodes loads the ground") {
  const auto said = [](const std::string& pressure) {
    Parts parts = with(R"("scheme_settings": {"beta": 0})");
    parts.generator = saturated;
    parts.conditions = fmt::format(
        R"("pressure_constraints": [{{"phase_id": 1, "nset": "base", "pressure": {}}}])", pressure);
    parts.mesh = R"(, "particles_stresses": {"type": "k0", "k0": 0.5, "surcharge": 2e4},
      "particles_pore_pressures": {"type": "water_table",
        "water_tables": [{"position": 0, "h0": 4}]})";
    return warnings_of(scenario_of(parts));
  };
  CHECK_FALSE(says(said("2e4"), "nothing loads"));
  CHECK(says(said("0"), "nothing loads the ground: a surcharge is a stress alone"));
  CHECK(says(said("0"), "the water table is above the ground, where nothing loads it"));
}
