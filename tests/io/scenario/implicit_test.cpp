// Scenarios of implicit analyses: what they mean, and what is refused.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <filesystem>
#include <string>

#include "io/scenario/scenario.h"
#include "tests/io/scenario/said.h"

using namespace lahar;
using namespace lahar::test;

namespace {

struct Parts {
  std::string analysis = R"("mpm_scheme": "newmark", "dt": 0.01, "nsteps": 10)";
  std::string conditions = R"("displacement_constraints": [
    {"nset": "base", "dir": "y", "displacement": 0}])";
  std::string generator = R"("type": "region", "per_cell": 2, "material": "soil")";
  std::string material = "";
};

std::string text_of(const Parts& parts) {
  return fmt::format(R"({{
    "mesh": {{"structured": {{"cell_size": 0.5, "extent": [1, 2]}},
      "boundary_conditions": {{{}}}}},
    "sets": {{"nodes": {{"base": {{"half_space": {{"point": [0, 0], "normal": [0, 1]}}}},
                        "corner": {{"box": {{"min": [0, 0], "max": [0, 0]}}}}}}}},
    "materials": [
      {{"name": "soil", "type": "LinearElastic", "density": 2650, "youngs_modulus": 1e7,
       "poisson_ratio": 0.2{}}},
      {{"name": "water", "type": "Newtonian", "density": 1000, "bulk_modulus": 2e9,
       "dynamic_viscosity": 1e-3}}],
    "particles": [{{"generator": {{{}}}}}],
    "math_functions": [{{"id": 0, "type": "Linear", "xvalues": [0, 1], "fxvalues": [0, 1]}},
      {{"id": 1, "type": "Linear", "xvalues": [0, 1], "fxvalues": [0, 1], "derivative": true}}],
    "external_loading_conditions": {{"gravity": [0, -10]}},
    "analysis": {{{}}}}})",
                     parts.conditions, parts.material, parts.generator, parts.analysis);
}

Scenario scenario_of(const Parts& parts, const ScenarioOptions& options = {}) {
  return read_scenario_text(text_of(parts), "", options);
}

Model<2> model_of(const Parts& parts) {
  return std::get<Model<2>>(scenario_of(parts).model);
}

/// With keys beside those of the scheme and the step.
Parts with(const std::string& keys) {
  return {.analysis = R"("mpm_scheme": "newmark", "dt": 0.01, "nsteps": 10, )" + keys};
}

Parts with_settings(const std::string& keys) {
  return with("\"scheme_settings\": {" + keys + "}");
}

std::string refusal(const Parts& parts, const ScenarioOptions& options = {}) {
  return refusal_of([&] { scenario_of(parts, options); });
}

std::string refused(std::string_view what) {
  return std::string(what) + " is not supported yet in implicit analyses";
}

}  // namespace

TEST_CASE("implicit steps without settings are those that the input's tables say") {
  const Model<2> plain = model_of({}), written = model_of(with_settings(""));
  for (const Model<2>* model : {&plain, &written}) {
    const ImplicitSteps& steps = model->analysis.implicit;
    const LinearSolver& linear = model->analysis.linear;
    CHECK(model->analysis.scheme == Scheme::newmark);
    CHECK(!steps.quasi_static);
    CHECK(steps.nonlinear);
    CHECK(steps.beta == 0.25);
    CHECK(steps.gamma == 0.5);
    CHECK(steps.most_iterations == 40);
    CHECK(steps.displacement_tolerance == 1e-10);
    CHECK(steps.residual_tolerance == 1e-10);
    CHECK(steps.relative_residual_tolerance == 1e-6);
    CHECK(linear.method == LinearSolver::Method::automatic);
    CHECK(linear.tolerance == 0);
    CHECK(linear.most_iterations == 0);
  }
  CHECK(!plain.analysis.step.adaptive);
  CHECK(!plain.analysis.opening);
  CHECK(!plain.analysis.transfer.takes());
}

TEST_CASE("implicit steps are read as the fork of CB-Geo MPM writes them") {
  const Model<2> model = model_of({.analysis = R"("type": "MPMImplicit2D", "dt": 0.01, "nsteps": 10,
    "scheme_settings": {"nonlinear": false, "quasi_static": true, "beta": 0.3, "gamma": 0.6,
      "max_iteration": 7, "displacement_tolerance": 1e-3, "residual_tolerance": 0,
      "relative_residual_tolerance": 1e-2},
    "linear_solver": {"solver_type": "DirectEigen", "max_iter": 5, "tolerance": 1e-4,
      "solver_settings": [
        {"dof": "displacement", "solver_type": "KrylovPETSC", "max_iter": 9}]})"});
  const ImplicitSteps& steps = model.analysis.implicit;
  const LinearSolver& linear = model.analysis.linear;
  CHECK(model.analysis.scheme == Scheme::newmark);
  CHECK(!steps.nonlinear);
  CHECK(steps.quasi_static);
  CHECK(steps.beta == 0.3);
  CHECK(steps.gamma == 0.6);
  CHECK(steps.most_iterations == 7);
  CHECK(steps.displacement_tolerance == 1e-3);
  CHECK(steps.residual_tolerance == 0);
  CHECK(steps.relative_residual_tolerance == 1e-2);
  CHECK(linear.method == LinearSolver::Method::iterative);  // of the displacement
  CHECK(linear.most_iterations == 9);
  CHECK(linear.tolerance == 1e-4);
  CHECK(
      model_of(with(R"("linear_solver": {"solver_type": "DirectEigen"})")).analysis.linear.method ==
      LinearSolver::Method::direct);
}

TEST_CASE("keys of implicit analyses without effect are warned of") {
  CHECK(warnings_of(scenario_of(with(R"("scheme_settings": {"verbosity": 2}, "linear_solver": {
    "assembler_type": "EigenImplicit2D", "solver_settings": [
      {"dof": "displacement", "sub_solver_type": "cg", "abs_tolerance": 1},
      {"dof": "pressure"}]})"))) ==
        "'verbosity' has no effect\n"
        "the solver of the pressure has no effect: the unknown is the displacement\n"
        "no effect has, in 'linear_solver': assembler_type, sub_solver_type, abs_tolerance\n");
  CHECK(warnings_of(scenario_of({.analysis = R"("end_time": 1, "linear_solver": {})",
                                 .conditions = R"("velocity_constraints": [
                                {"nset": "base", "dir": "y", "velocity": 0}])"})) ==
        "'linear_solver' has no effect in an explicit analysis\n");
}

TEST_CASE("type and scheme have to agree, and in CB-Geo's input the type counts") {
  CHECK(refusal({.analysis = R"("type": "MPMExplicit2D", "mpm_scheme": "newmark", "dt": 1,
                                "nsteps": 1)"}) ==
        "'mpm_scheme': \"newmark\" is implicit, but 'type' is \"MPMExplicit2D\"");
  const std::string both = R"("type": "MPMImplicit2D", "mpm_scheme": "usl", "dt": 1, "nsteps": 1)";
  CHECK(refusal({.analysis = both + R"(, "preset": "lahar")"}) ==
        "'mpm_scheme': \"usl\" is explicit, but 'type' is \"MPMImplicit2D\"");
  const Scenario scenario = scenario_of({.analysis = both});
  CHECK(std::get<Model<2>>(scenario.model).analysis.scheme == Scheme::newmark);
  CHECK(warnings_of(scenario) ==
        "'mpm_scheme': newmark is run in place of usl, because 'type' is implicit\n");
}

TEST_CASE(
    "beta follows gamma: Newmark's method is stable in all steps, or the scenario is doubted") {
  const auto steps_of = [](const char* keys) {
    return model_of(with_settings(keys)).analysis.implicit;
  };
  CHECK(steps_of(R"("gamma": 1)").beta == 0.5625);
  CHECK(steps_of(R"("gamma": 0.5)").beta == 0.25);
  CHECK(steps_of(R"("gamma": 1, "beta": 0.6)").beta == 0.6);
  CHECK(warnings_of(scenario_of(with_settings(R"("gamma": 1, "beta": 0.25)"))) ==
        "Newmark's method with beta 0.25 and gamma 1 is not stable in long steps\n");
}

TEST_CASE("numbers of implicit steps have bounds") {
  for (const auto& [keys, message] : std::initializer_list<std::pair<const char*, const char*>>{
           {R"("beta": 0)", "'beta' must be greater than 0 and at most 1, found 0"},
           {R"("beta": 1.01)", "'beta' must be at least 0 and at most 1, found 1.01"},
           {R"("gamma": 0.49)", "'gamma' must be at least 0.5 and at most 1, found 0.49"},
           {R"("gamma": 1.1)", "'gamma' must be at least 0.5 and at most 1, found 1.1"},
           {R"("max_iteration": 0)", "'max_iteration' must be at least 1, found 0"},
           {R"("residual_tolerance": -1)", "'residual_tolerance' must be at least 0 [N], found -1"},
           {R"("relative_residual_tolerance": -1)",
            "'relative_residual_tolerance' must be at least 0, found -1"},
           {R"("displacement_tolerance": -1)",
            "'displacement_tolerance' must be at least 0 [m], found -1"}})
    CHECK(refusal(with_settings(keys)) == message);
  CHECK(model_of(with_settings(R"("beta": 0.5, "gamma": 1)")).analysis.implicit.beta == 0.5);
  CHECK(refusal(with(R"("linear_solver": {"max_iter": 0})")) ==
        "'max_iter' must be at least 1, found 0");
  CHECK(refusal(with(R"("linear_solver": {"tolerance": -1})")) ==
        "'tolerance' must be at least 0, found -1");
}

TEST_CASE("implicit steps are adaptive where the scenario says so, and need their longest step") {
  const auto step_of = [](const std::string& keys) {
    return model_of({.analysis = R"("mpm_scheme": "newmark", "end_time": 1, )" + keys})
        .analysis.step;
  };
  const TimeStep adaptive = step_of(R"("dt": 0.1, "time_step": {"adaptive": true})"),
                 eager = step_of(R"("dt": 0.1, "time_step": {"adaptive": true, "safety": 0.5})");
  CHECK(adaptive.adaptive);
  CHECK(adaptive.dt == 0.1);
  CHECK(adaptive.safety == 0.2);  // 8 of 40 iterations
  CHECK(eager.safety == 0.5);
  CHECK(!step_of(R"("dt": 0.1, "time_step": {})").adaptive);
  const Parts without{
      .analysis = R"("mpm_scheme": "newmark", "end_time": 1, "time_step": {"adaptive": true})"};
  CHECK(refusal(without) == "'dt' is missing in analysis");
  CHECK(refusal(with(R"("time_step": {"adaptive": true, "safety": 0})")) ==
        "'safety' must be greater than 0 and at most 1, found 0");
  CHECK(refusal(with(R"("time_step": {"adaptive": true, "smallest": 1e-3})"))
            .starts_with("unknown key 'smallest'"));
}

TEST_CASE("adaptive implicit steps refuse displacements of each step, but those that hold nodes") {
  const std::string adaptive =
      R"("mpm_scheme": "newmark", "dt": 0.01, "nsteps": 10, "time_step": {"adaptive": true})";
  CHECK(refusal({.analysis = adaptive}) == "");
  CHECK(refusal({.analysis = adaptive, .conditions = R"("displacement_constraints": [
      {"nset": "base", "dir": "x", "displacement": 0},
      {"nset": "base", "dir": "y", "displacement": 1e-3}])"})
            .starts_with("'displacement_constraints' move nodes by as much in each step"));
  CHECK(refusal({.analysis = adaptive, .conditions = R"("velocity_constraints": [
      {"nset": "base", "dir": "y", "velocity": 1e-3}])"}) == "");
  CHECK(refusal({.conditions = R"("displacement_constraints": [
      {"nset": "base", "dir": "y", "displacement": 1e-3, "math_function_id": 1}])"})
            .starts_with("'displacement_constraints' do not go together with a function that has"));
}

TEST_CASE("what implicit analyses do not support is refused by its key") {
  CHECK(refusal({.analysis = R"("mpm_scheme": "newmark", "nsteps": 10)"}) ==
        "'dt' is missing in analysis");
  for (const std::string functions : {"cpdi", "cpdi2"})
    CHECK(refusal(with("\"shape_functions\": \"" + functions + "\"")) ==
          refused("'shape_functions': \"" + functions + "\""));
  for (const std::string update : {"pic", "apic", "tpic", "asflip", "xpic", "fmpm"})
    CHECK(refusal(with("\"velocity_update\": \"" + update + "\"")) ==
          refused("'velocity_update' other than FLIP"));
  CHECK(refusal(with(R"("velocity_update_settings": {"relaxation": 0.1})")) ==
        refused("'velocity_update_settings' other than FLIP"));
  CHECK(refusal(with(R"("pressure_smoothing": true)")) == refused("'pressure_smoothing'"));
  CHECK(refusal(with(R"("damping": {"type": "Cundall", "damping_factor": 0.1})")) ==
        refused("'damping'"));
  CHECK(refusal(with(R"("opening": true)")) ==
        "'opening' does not go together with implicit steps");
  Parts wet{.generator = R"("type": "region", "per_cell": 2, "material": ["soil", "water"])",
            .material = R"(, "porosity": 0.4, "k_x": 1e-3)"};
  CHECK(refusal(wet) == refused("a liquid in pores"));
  wet.analysis = R"("type": "MPMImplicit2D", "dt": 0.01, "nsteps": 10)";
  CHECK(refusal(wet) == "particles have a liquid in their pores, but 'type' is of one phase");
  CHECK(refusal({.generator = R"("type": "inject", "nparticles_per_dir": 2, "velocity": [0, 1],
                                 "cset_id": -1, "material": "soil")"}) ==
        refused("a generator of type \"inject\""));
}

TEST_CASE("contact of bodies is refused in implicit analyses") {
  std::string text = text_of(with(R"("interface": true)"));
  const std::string one = R"({"generator": {"type": "region", "per_cell": 2, "material": "soil"}})";
  const auto at = text.find(one);
  REQUIRE(at != std::string::npos);
  text.replace(at, one.size(), R"(
    {"generator": {"type": "region", "per_cell": 2, "material": "soil",
                   "region": {"box": {"min": [0, 0], "max": [1, 1]}}}},
    {"generator": {"type": "region", "per_cell": 2, "material": "water",
                   "region": {"box": {"min": [0, 1], "max": [1, 2]}}}})");
  CHECK_THROWS_WITH_AS(read_scenario_text(text, ""),
                       refused("'interface', contact of bodies,").c_str(), InputError);
}

TEST_CASE("conditions of nodes and particles that implicit analyses do not have are refused") {
  for (const auto& [key, entry] : std::initializer_list<std::pair<const char*, const char*>>{
           {"absorbing_constraints",
            R"({"nset": "base", "dir": 1, "delta": 10, "h_min": 1, "a": 1, "b": 1,
                "position": "edge"})"},
           {"spring_constraints", R"({"nset": "base", "dir": 1, "stiffness": 1})"},
           {"particles_velocity_constraints", R"({"pset": -1, "dir": 1, "velocity": 0})"}})
    CHECK(refusal({.conditions = fmt::format("\"{}\": [{}]", key, entry)}) ==
          refused(fmt::format("'{}'", key)));
  CHECK(refusal({.conditions = R"("friction_constraints": [
      {"nset": "base", "dir": 1, "sign_n": -1, "friction": 0.2, "two_sided": true}])"}) ==
        refused("friction at two-sided walls"));
  CHECK(refusal({.conditions = R"("acceleration_constraints": [
      {"nset": "base", "dir": "x", "acceleration": 1}])"}) == "");
  CHECK(refusal({.conditions = R"("walls": [{"nset": "base", "normal": [0, 1]}])"}) == "");
  // None are given.
  CHECK(refusal({.conditions = R"("velocity_constraints": [
      {"nset": "base", "dir": "y", "velocity": 0}], "walls": [], "spring_constraints": [])"}) ==
        "");
}

TEST_CASE("of displacement constraints, the first of a node and direction counts") {
  const Model<2> model = model_of({.conditions = R"("displacement_constraints": [
    {"nset": "corner", "dir": 1, "displacement": 2e-3, "math_function_id": 0},
    {"nset": "base", "dir": "y", "displacement": 1e-3},
    {"nset": "base", "dir": "x", "displacement": 0}])"});
  const auto& all = entries_of<NodeDisplacement>(model);
  REQUIRE(all.size() == 6);
  for (std::size_t i = 0; i < all.size(); ++i) {
    CHECK(all[i].node == static_cast<Index>(i / 2));
    CHECK(all[i].dir == static_cast<int>(i % 2));
    CHECK(all[i].displacement == (i == 1 ? 2e-3 : i % 2 == 1 ? 1e-3 : 0.0));
    CHECK(all[i].function == (i == 1 ? 0 : -1));
  }
  CHECK(refusal({.conditions = R"("displacement_constraints": [
      {"nset": "base", "dir": "y", "displacement": 0}], "velocity_constraints": [
      {"nset": "corner", "dir": "y", "velocity": 0}])"}) ==
        "node 0 has a prescribed velocity in direction 1 as well");
}

TEST_CASE("explicit analyses refuse displacement constraints, and ignore them in CB-Geo's input") {
  CHECK(refusal({.analysis = R"("end_time": 1)"}) ==
        "'displacement_constraints' act in implicit analyses only");
  const Scenario scenario =
      scenario_of({.analysis = R"("type": "MPMExplicit2D", "dt": 1e-4, "nsteps": 1)",
                   .conditions = R"("displacement_constraints": [
                       {"nset": "base", "dir": "y", "displacement": 0}], "velocity_constraints": [
                       {"nset": "base", "dir": "y", "velocity": 0}])"});
  CHECK(warnings_of(scenario) ==
        "'displacement_constraints' are ignored in an explicit analysis\n");
  const auto& model = std::get<Model<2>>(scenario.model);
  CHECK(entries_of<NodeDisplacement>(model).empty());
  CHECK(entries_of<NodeVelocity>(model).size() == 3);
}

TEST_CASE("velocity constraints act in implicit analyses, but not as in CB-Geo MPM") {
  const Parts parts{.conditions = R"("velocity_constraints": [
      {"nset": "base", "dir": "y", "velocity": 0}], "displacement_constraints": [
      {"nset": "base", "dir": "x", "displacement": 0}])"};
  CHECK(entries_of<NodeVelocity>(model_of(parts)).size() == 3);
  ScenarioOptions as_cbgeo;
  as_cbgeo.as_cbgeo = true;
  const Scenario scenario = scenario_of(parts, as_cbgeo);
  const auto& model = std::get<Model<2>>(scenario.model);
  CHECK(entries_of<NodeVelocity>(model).empty());
  CHECK(entries_of<NodeDisplacement>(model).size() == 3);
  CHECK(warnings_of(scenario).starts_with(
      "'velocity_constraints' are ignored in an implicit analysis, as by CB-Geo\n"));
}

TEST_CASE("a published block of implicit steps is accepted, with and without --as-cbgeo") {
  const auto file = std::filesystem::path(LAHAR_SOURCE_DIR).parent_path() / "shared" / "cases" /
                    "2d_newmark_block" / "case.json";
  if (!std::filesystem::exists(file)) {
    MESSAGE("no published cases beside the repository: skipped");
    return;
  }
  for (const bool as_cbgeo : {false, true}) {
    ScenarioOptions options;
    options.as_cbgeo = as_cbgeo;
    const auto model = std::get<Model<2>>(read_scenario(file, options).model);
    CHECK(model.analysis.scheme == Scheme::newmark);
    CHECK(model.analysis.implicit.most_iterations == 50);
    CHECK(model.analysis.linear.method == LinearSolver::Method::direct);
    CHECK(entries_of<NodeDisplacement>(model).size() == 18);
  }
}
