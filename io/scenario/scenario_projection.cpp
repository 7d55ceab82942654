// Projections: settings, and what they do not go together with.
#include <fmt/format.h>

#include <optional>

#include "io/scenario/scenario_builder.h"
#include "physics/materials/law.h"

namespace lahar {

namespace {

bool is_semi_implicit(const JsonValue* type) {
  return type && !type->defaulted && type->as<std::string>().starts_with("MPMSemiImplicit");
}

bool is_named_projection(const JsonValue* scheme) {
  return scheme && scheme->as<std::string>() == "projection";
}

}  // namespace

bool asks_for_projection(const JsonValue& analysis) {
  return is_semi_implicit(analysis.find("type")) ||
         is_named_projection(analysis.find("mpm_scheme"));
}

template <int Dim>
void ScenarioBuilder<Dim>::build_projection() {
  JsonValue* analysis = root_.find("analysis");
  if (!analysis || !asks_for_projection(*analysis)) return;
  const JsonValue *type = analysis->find("type"), *scheme = analysis->find("mpm_scheme");
  const bool by_type = is_semi_implicit(type), by_scheme = is_named_projection(scheme);
  if (!by_type && type && !type->defaulted)
    in_.error(
        *scheme,
        fmt::format("'mpm_scheme': \"projection\" does not go together with 'type' {}",
                    json_quoted(type->as<std::string>())),
        fmt::format("\"MPMSemiImplicitNavierStokes{0}D\" or \"MPMSemiImplicitTwoPhase{0}D\"", Dim));
  if (!by_scheme && scheme)
    in_.warning(*scheme, fmt::format("'mpm_scheme': projection is run in place of {}, because of "
                                     "'type'",
                                     scheme->as<std::string>()));
  set(*analysis, "mpm_scheme", std::string("projection"));
  model_.analysis.scheme = Scheme::projection;
  Projection& settings = model_.analysis.projection;
  if (const JsonValue* given = analysis->find("free_surface_detection");
      given && given->is<JsonValue::Object>()) {
    settings.free_surface = get_text(*given, "type").value_or("density") != "none";
    settings.least_fill = get_number(*given, "volume_tolerance").value_or(settings.least_fill);
  }
  model_.analysis.linear.tolerance = 1e-7;  // of a divergence that the next step removes again
  build_linear_solver(*analysis, "pressure");
}

template <int Dim>
void ScenarioBuilder<Dim>::refuse_in_projection(const JsonValue* at, const std::string& what,
                                                const std::string& hint) {
  in_.error(at ? *at : section("analysis"),
            fmt::format("{} does not go together with a projection", what), hint);
}

template <int Dim>
void ScenarioBuilder<Dim>::check_projection() {
  Analysis& a = model_.analysis;
  if (!is_projection(a)) return;
  const JsonValue& analysis = section("analysis");
  if (!written(analysis, "type") || analysis.find("type")->defaulted)
    set(*root_.find("analysis"), "type",
        fmt::format("MPMSemiImplicit{}{}D", a.two_phase ? "TwoPhase" : "NavierStokes", Dim));
  check_materials_of_projection();
  choose_kept_pressure();
  // Pressure acts by gradients, and nothing opens.
  a.volume_as_cbgeo = !a.two_phase;
  a.opening = false;
  a.explicit_drag = false;
  if (a.as_cbgeo)
    in_.warning(analysis, "--as-cbgeo changes nothing in a projection but the default of 'beta'",
                "drag is in the equation of the pressure, and what a liquid in pores stores");
  const auto refuse = [&](const char* key, const std::string& hint) {
    refuse_in_projection(analysis.find(key), fmt::format("'{}'", key), hint);
  };
  if (a.contact.bodies > 1) refuse_in_projection(root_.find("interface"), "contact of bodies", "");
  if (a.functions != ShapeFunctions::element)
    refuse("shape_functions", "take \"element\": the pressure has the functions of elements");
  if (a.pressure_smoothing) refuse("pressure_smoothing", "leave it out");
  if (a.pore_pressure_smoothing) refuse("pore_pressure_smoothing", "leave it out");
  if (a.lagrange_functions || (mesh_ && info(mesh_->element()).order > 1))
    refuse_in_projection(root_.find("mesh"), "an element of second order", "take Q4 or H8");
  if (!a.two_phase && a.damping > 0.0 && !a.viscous_damping)
    refuse("damping",
           "Cundall's damping follows from forces that the pressure balances; take "
           "\"Viscous\", or leave it out");
  if (a.takes_means) refuse_in_projection(&boundary(), "an absorbing boundary or a spring", "");
  if (team_.any(!model_.injections.empty()))
    refuse_in_projection(root_.find("particles"), "a generator of type \"inject\"", "");
  if (team_.any(!model_.particle_velocities.empty()))
    refuse_in_projection(boundary().find("particles_velocity_constraints"),
                         "'particles_velocity_constraints'", "prescribe velocities of nodes");
}

// Forces on the skeleton have no part of a pressure that is not kept, before it is corrected. Part
// of a sudden load then strains the skeleton at once.
template <int Dim>
void ScenarioBuilder<Dim>::choose_kept_pressure() {
  Analysis& a = model_.analysis;
  const JsonValue* given = section("analysis").find("scheme_settings");
  std::optional<double> kept;
  if (given && given->is<JsonValue::Object>()) kept = get_number(*given, "beta");
  a.projection.kept = kept.value_or(a.two_phase || a.as_cbgeo ? 1.0 : 0.0);
  if (a.projection.kept > 0 && !a.two_phase && prescribes_pressure())
    in_.error(*boundary().find("pressure_constraints"),
              fmt::format("a pressure other than 0 does not go together with a 'beta' of {:g}: "
                          "nothing holds the pressure that is kept against it",
                          a.projection.kept),
              "write \"scheme_settings\": {\"beta\": 0} in analysis");
  if (a.two_phase && kept && *kept < 1.0)
    in_.warning(
        *given->find("beta"),
        fmt::format("with 'beta' {:g} soil gives way to a sudden load before water flows out",
                    *kept),
        "leave it out: all of the pressure is kept");
}

// All particles have a liquid: they are a fluid, or have it in their pores.
template <int Dim>
void ScenarioBuilder<Dim>::check_materials_of_projection() {
  for (const auto& [material, at] : single_) {
    const Material& used = model_.materials[static_cast<std::size_t>(material)];
    if (model_.analysis.two_phase)
      refuse_in_projection(at, fmt::format("'{}', which has no liquid in its pores,", used.name),
                           "material of a generator: [skeleton, liquid]");
    else if (!has_pressure(used.law))
      refuse_in_projection(at, fmt::format("'{}', which is a solid,", used.name),
                           "take a Newtonian or Bingham fluid, or give the solid a liquid in its "
                           "pores: material of a generator: [skeleton, liquid]");
  }
}

}  // namespace lahar

#include "io/scenario/scenario_builder_instances.h"
