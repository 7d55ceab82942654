// Implicit analyses: settings, solver, and what they do not go together with.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "io/base/problems.h"
#include "io/scenario/scenario_builder.h"

namespace lahar {

namespace {

/// What is written of an analysis before its defaults are known.
struct WrittenScheme {
  const JsonValue *type = nullptr, *scheme = nullptr;  ///< null where they are not written
  bool type_is_implicit = false, scheme_is_implicit = false;
};

WrittenScheme written_scheme(const JsonValue& analysis) {
  WrittenScheme at;
  if (const JsonValue* type = analysis.find("type"); type && !type->defaulted) at.type = type;
  at.scheme = analysis.find("mpm_scheme");
  at.type_is_implicit = at.type && at.type->as<std::string>().starts_with("MPMImplicit");
  at.scheme_is_implicit = at.scheme && at.scheme->as<std::string>() == "newmark";
  return at;
}

/// Keys of an object that are written but have no effect.
void add_without_effect(const JsonValue& object, std::vector<std::string>& keys) {
  for (const char* key : {"assembler_type", "sub_solver_type", "preconditioner_type",
                          "abs_tolerance", "div_tolerance", "verbosity"})
    if (object.find(key) && std::find(keys.begin(), keys.end(), key) == keys.end())
      keys.emplace_back(key);
}

}  // namespace

template <int Dim>
void ScenarioBuilder<Dim>::build_implicit() {
  JsonValue* analysis = root_.find("analysis");
  if (!analysis) return;
  const WrittenScheme at = written_scheme(*analysis);
  if (at.scheme_is_implicit && at.type && !at.type_is_implicit)
    in_.error(*at.scheme,
              fmt::format("'mpm_scheme': \"newmark\" is implicit, but 'type' is {}",
                          json_quoted(at.type->as<std::string>())),
              fmt::format("\"MPMImplicit{}D\"", Dim));
  if (at.type_is_implicit && at.scheme && !at.scheme_is_implicit) {
    const std::string explicit_name = at.scheme->as<std::string>();
    if (in_.cbgeo_defaults)
      in_.warning(*at.scheme, fmt::format("'mpm_scheme': newmark is run in place of {}, because "
                                          "'type' is implicit",
                                          explicit_name));
    else
      in_.error(*at.scheme,
                fmt::format("'mpm_scheme': {} is explicit, but 'type' is {}",
                            json_quoted(explicit_name), json_quoted(at.type->as<std::string>())),
                "\"newmark\"");
  }
  if (!at.type_is_implicit && !at.scheme_is_implicit) {
    if (asks_for_projection(*analysis)) return;
    for (const char* key : {"scheme_settings", "linear_solver"})
      if (const JsonValue* given = analysis->find(key))
        in_.warning(*given, fmt::format("'{}' has no effect in an explicit analysis", key),
                    "\"mpm_scheme\": \"newmark\" is implicit, \"projection\" solves for the "
                    "pressure");
    return;
  }
  if (!at.type) set(*analysis, "type", fmt::format("MPMImplicit{}D", Dim));
  set(*analysis, "mpm_scheme", std::string("newmark"));
  model_.analysis.scheme = Scheme::newmark;
  build_implicit_steps(*analysis);
  build_linear_solver(*analysis, "displacement");
}

template <int Dim>
void ScenarioBuilder<Dim>::build_implicit_steps(const JsonValue& analysis) {
  const JsonValue* given = analysis.find("scheme_settings");
  if (!given || !given->is<JsonValue::Object>()) return;
  ImplicitSteps& steps = model_.analysis.implicit;
  steps.nonlinear = get_bool(*given, "nonlinear").value_or(steps.nonlinear);
  steps.quasi_static = get_bool(*given, "quasi_static").value_or(steps.quasi_static);
  steps.most_iterations =
      static_cast<int>(get_integer(*given, "max_iteration").value_or(steps.most_iterations));
  const auto number = [&](const char* key, double& value) {
    value = get_number(*given, key).value_or(value);
  };
  number("gamma", steps.gamma);
  // With less, long steps are not stable.
  const double stable = 0.25 * std::pow(steps.gamma + 0.5, 2);
  if (!in_.cbgeo_defaults) steps.beta = stable;
  number("beta", steps.beta);
  if (!(steps.beta > 0 && steps.beta <= 1))
    in_.error(*given->find("beta"),
              fmt::format("'beta' must be greater than 0 and at most 1, found {:g}", steps.beta));
  else if (steps.beta < stable && !steps.quasi_static)
    in_.warning(*given,
                fmt::format("Newmark's method with beta {:g} and gamma {:g} is not stable in long "
                            "steps",
                            steps.beta, steps.gamma),
                fmt::format("a 'beta' of {:g}, (gamma + 0.5)^2 / 4, is", stable));
  number("displacement_tolerance", steps.displacement_tolerance);
  number("residual_tolerance", steps.residual_tolerance);
  number("relative_residual_tolerance", steps.relative_residual_tolerance);
  if (const JsonValue* verbosity = given->find("verbosity"))
    in_.warning(*verbosity, "'verbosity' has no effect");
}

// As in the fork of CB-Geo MPM, an entry of solver_settings counts before the keys around it.
template <int Dim>
void ScenarioBuilder<Dim>::build_linear_solver(const JsonValue& analysis,
                                               std::string_view unknown) {
  const JsonValue* given = analysis.find("linear_solver");
  if (!given || !given->is<JsonValue::Object>()) return;
  std::vector<const JsonValue*> sources{given};
  std::vector<std::string> without_effect;
  add_without_effect(*given, without_effect);
  for (const JsonValue* entry : get_list(*given, "solver_settings")) {
    const auto dof = get_text(*entry, "dof");
    if (dof == unknown) {
      sources.push_back(entry);
      add_without_effect(*entry, without_effect);
    } else if (dof) {
      in_.warning(*entry, fmt::format("the solver of the {} has no effect: the unknown is the {}",
                                      *dof, unknown));
    }
  }
  if (!without_effect.empty())
    in_.warning(*given, fmt::format("no effect has, in 'linear_solver': {}", join(without_effect)),
                "the program chooses preconditioners itself");
  LinearSolver& solver = model_.analysis.linear;
  for (const JsonValue* from : sources) {
    if (const auto type = get_text(*from, "solver_type"))
      solver.method =
          *type == "DirectEigen" ? LinearSolver::Method::direct : LinearSolver::Method::iterative;
    solver.tolerance = get_number(*from, "tolerance").value_or(solver.tolerance);
    if (const auto most = get_integer(*from, "max_iter"))
      solver.most_iterations =
          static_cast<int>(std::min<Index>(*most, std::numeric_limits<int>::max()));
  }
}

template <int Dim>
void ScenarioBuilder<Dim>::refuse_implicit(const JsonValue* at, const std::string& what,
                                           const std::string& hint) {
  in_.error(at ? *at : section("analysis"),
            fmt::format("{} is not supported yet in implicit analyses", what), hint);
}

// What implicit analyses do not go together with.
template <int Dim>
void ScenarioBuilder<Dim>::check_implicit() {
  const Analysis& a = model_.analysis;
  if (!is_implicit(a)) return;
  const JsonValue& analysis = section("analysis");
  const JsonValue* type = analysis.find("type");
  if (a.two_phase && type && type->defaulted)  // else reported
    refuse_implicit(analysis.find("mpm_scheme"), "a liquid in pores",
                    "take an explicit scheme, such as \"musl\"");
  if (a.contact.bodies > 1)
    refuse_implicit(analysis.find("interface"), "'interface', contact of bodies,");
  if (a.functions == ShapeFunctions::cpdi || a.functions == ShapeFunctions::cpdi2)
    refuse_implicit(analysis.find("shape_functions"),
                    fmt::format("'shape_functions': {}",
                                json_quoted(get_text(analysis, "shape_functions").value_or(""))),
                    "take \"gimp\", \"quadratic_spline\", \"cubic_spline\" or \"element\"");
  if (a.transfer.takes() || a.affine != Affine::none) {
    const bool other = a.affine != Affine::none || !analysis.find("velocity_update_settings");
    const char* key = other ? "velocity_update" : "velocity_update_settings";
    refuse_implicit(analysis.find(key), fmt::format("'{}' other than FLIP", key),
                    "leave it out: particles take the change of velocity from the nodes");
  }
  if (a.pressure_smoothing)
    refuse_implicit(analysis.find("pressure_smoothing"), "'pressure_smoothing'", "leave it out");
  if (a.damping > 0)
    refuse_implicit(analysis.find("damping"), "'damping'",
                    "a 'gamma' above 0.5 in 'scheme_settings' damps short waves");
  if (team_.any(!model_.injections.empty())) refuse_injection();
  check_implicit_conditions();
}

template <int Dim>
void ScenarioBuilder<Dim>::refuse_injection() {
  for (const JsonValue* entry : get_list(root_, "particles"))
    if (const JsonValue* generator = entry->find("generator");
        generator && get_text(*generator, "type") == "inject")
      refuse_implicit(generator, "a generator of type \"inject\"");
}

template <int Dim>
void ScenarioBuilder<Dim>::check_implicit_conditions() {
  const auto refuse = [&](std::string_view key) {
    const JsonValue* at = boundary().find(key);
    if (!at || (at->is<JsonValue::Array>() && at->as<JsonValue::Array>().empty())) return;
    refuse_implicit(at, fmt::format("'{}'", key),
                    "velocity and displacement constraints act there, and loads");
  };
  for_each_condition([&]<class T>() {
    if (ActsOnNode<T> && !is_load<T>) refuse(T::key);
  });
  if (in_.cbgeo_defaults) refuse(NodeAcceleration::key);
  refuse("particles_velocity_constraints");
  const auto& frictions = entries_of<NodeFriction>(model_);
  if (team_.any(std::any_of(frictions.begin(), frictions.end(),
                            [](const NodeFriction& friction) { return friction.two_sided; })))
    refuse_implicit(boundary().find(NodeFriction::key), "friction at two-sided walls",
                    "with \"two_sided\": false the wall pushes and does not pull");
  const auto& displacements = entries_of<NodeDisplacement>(model_);
  const bool by_slope =
      std::any_of(displacements.begin(), displacements.end(), [this](const NodeDisplacement& one) {
        return one.function >= 0 &&
               model_.functions[static_cast<std::size_t>(one.function)].differentiated;
      });
  if (team_.any(by_slope))
    in_.error(*boundary().find(NodeDisplacement::key),
              "'displacement_constraints' do not go together with a function that has "
              "\"derivative\": they are displacements of a step",
              "give 'velocity_constraints' of 1 m/s with this function: nodes follow its values");
  const bool move = std::any_of(displacements.begin(), displacements.end(),
                                [](const NodeDisplacement& one) { return one.displacement != 0; });
  if (model_.analysis.step.adaptive && team_.any(move))
    in_.error(
        *boundary().find(NodeDisplacement::key),
        "'displacement_constraints' move nodes by as much in each step, and how many adaptive "
        "steps there are is not known",
        "give velocities, 'velocity_constraints': nodes then move with the time");
}

}  // namespace lahar

#include "io/scenario/scenario_builder_instances.h"
