// B-bar: material whose volume can hardly change does not lock.
#include <fmt/format.h>

#include <algorithm>

#include "io/base/problems.h"
#include "io/scenario/scenario_builder.h"

namespace lahar {

// By its key, by the type of particles, or in implicit steps for elements that lock without it.
template <int Dim>
void ScenarioBuilder<Dim>::build_b_bar() {
  JsonValue* analysis = root_.find("analysis");
  if (!analysis) return;
  Analysis& a = model_.analysis;
  const std::optional<bool> asked = written_b_bar();
  const JsonValue* by_type = with_particle_type("BBAR");
  const bool locks = is_implicit(a) && !deforms_across(a) && !in_.cbgeo_defaults && mesh_ &&
                     mesh_->element() == multilinear<Dim> && a.functions == ShapeFunctions::element;
  a.mean_volume = asked.value_or(by_type || locks);
  if (const JsonValue* key = analysis->find("b_bar"); a.mean_volume && (asked || by_type))
    refuse_b_bar(key ? *key : asked ? *analysis : *by_type);
  set(*analysis, "b_bar", a.mean_volume);
  check_finite_strain();
}

// analysis.b_bar, or its older place, which counts in implicit steps.
template <int Dim>
std::optional<bool> ScenarioBuilder<Dim>::written_b_bar() {
  const JsonValue& analysis = section("analysis");
  const std::optional<bool> here = get_bool(analysis, "b_bar");
  const JsonValue* settings = analysis.find("scheme_settings");
  if (!settings || !settings->is<JsonValue::Object>() || !is_implicit(model_.analysis)) return here;
  const std::optional<bool> there = get_bool(*settings, "b_bar");
  if (here && there && *here != *there)
    in_.error(*settings->find("b_bar"),
              fmt::format("'b_bar' is {} here and {} in analysis", *there, *here),
              "write it in analysis alone");
  return here ? here : there;
}

// What B-bar does not go together with; implicit steps have refused most of it already.
template <int Dim>
void ScenarioBuilder<Dim>::refuse_b_bar(const JsonValue& at) {
  const Analysis& a = model_.analysis;
  const bool cpdi = a.functions == ShapeFunctions::cpdi || a.functions == ShapeFunctions::cpdi2;
  if (cpdi && !is_implicit(a))
    in_.error(at,
              fmt::format("B-bar does not go together with \"shape_functions\": \"{}\": corners of "
                          "domains follow the gradients at particles, and volumes would not",
                          row_of(a.functions).key),
              "take \"gimp\", \"quadratic_spline\", \"cubic_spline\" or \"element\"");
  if (a.pressure_smoothing && !is_implicit(a))
    in_.error(at, "B-bar does not go together with 'pressure_smoothing'",
              "leave 'pressure_smoothing' out: with B-bar the particles of a cell have the same "
              "change of pressure");
  if (a.two_phase && !is_implicit(a))
    in_.error(at, "B-bar is not supported yet for soil with a liquid in its pores",
              "leave it out, and take \"per_cell\": 1");
  if (is_projection(a) && !a.two_phase)
    in_.error(at, "B-bar does not go together with a projection",
              "leave it out: fluids do not lock");
  const bool simplex =
      mesh_ && (mesh_->element() == Element::T3 || mesh_->element() == Element::Tet4);
  if (simplex)
    in_.warning(at, "B-bar has no effect: the strain of such cells is constant",
                Dim == 2 ? "cells with four nodes do not lock with it"
                         : "cells with eight nodes do not lock with it");
}

// The first generator with particles of this type.
template <int Dim>
const JsonValue* ScenarioBuilder<Dim>::with_particle_type(std::string_view kind) const {
  const std::string name = fmt::format("P{}D{}", Dim, kind);
  for (const JsonValue* entry : get_list(root_, "particles"))
    if (const JsonValue* generator = entry->find("generator");
        generator && get_text(*generator, "particle_type") == name)
      return generator->find("particle_type");
  return nullptr;
}

// Particles of CB-Geo's input with finite strains.
template <int Dim>
void ScenarioBuilder<Dim>::check_finite_strain() {
  const JsonValue* at = with_particle_type("FS");
  if (!at) return;
  if (is_implicit(model_.analysis)) {
    if (model_.analysis.as_cbgeo)
      in_.warning(section("analysis"), "strains are small, not finite as 'particle_type' says",
                  "without --as-cbgeo they are finite");
    return;
  }
  const auto large = [](const Material& material) {
    return std::holds_alternative<NeoHookean>(material.law) || has_pressure(material.law);
  };
  if (!std::all_of(model_.materials.begin(), model_.materials.end(), large))
    in_.warning(*at,
                fmt::format("particles of type {} are as P{}D: explicit steps are so short that "
                            "increments of strain are small, whatever their sum is",
                            json_quoted(at->as<std::string>()), Dim),
                "\"NeoHookean\" is for large elastic strains and rotations");
}

namespace {

/// Whether a law yields at all, and keeps its volume then: the strength does not depend on the
/// pressure. At strains of 1 it breaks otherwise.
bool yields_at_constant_volume(const JsonValue& material, const Law& law) {
  constexpr double most = 1;  // strength over Young's modulus
  const double stiffness = get_number(material, "youngs_modulus").value_or(infinity);
  if (const auto* metal = std::get_if<VonMises>(&law))
    return metal->yield_stress < most * stiffness;
  const auto is_clay = [&](const auto* soil) {
    return soil && soil->friction == 0 && soil->dilation == 0 && soil->cohesion < most * stiffness;
  };
  return is_clay(std::get_if<MohrCoulomb>(&law)) || is_clay(std::get_if<DruckerPrager>(&law));
}

}  // namespace

// Particles ask for more volumetric strains than nodes have motions.
template <int Dim>
void ScenarioBuilder<Dim>::warn_of_locking() {
  constexpr double hardly = 0.45, several = 1.5;  // Poisson's ratio; particles per cell
  const auto materials = get_list(root_, "materials");
  const std::size_t n = materials.size();
  std::vector<bool> may_lock(n);
  for (std::size_t m = 0; m < n; ++m)
    may_lock[m] = yields_at_constant_volume(*materials[m], model_.materials[m].law) ||
                  get_number(*materials[m], "poisson_ratio").value_or(0) > hardly;
  if (in_.cbgeo_defaults || model_.analysis.mean_volume || model_.analysis.plane == Plane::stress ||
      std::find(may_lock.begin(), may_lock.end(), true) == may_lock.end())
    return;
  const ParticleTable<Dim>& p = model_.particles;
  const double cell = outer_cell().prod();
  std::vector<double> per_cell(n, 0.0);  // most, by material
  for (std::size_t i = 0; i < p.x.size(); ++i) {
    const std::size_t m = p.material[i] % n;  // bodies in contact have copies
    per_cell[m] = std::max(per_cell[m], cell * depth_at(model_.analysis, p.x[i][0]) / p.volume[i]);
  }
  per_cell = team_.most(std::move(per_cell));
  for (std::size_t m = 0; m < n; ++m) {
    if (!may_lock[m] || !(per_cell[m] > several)) continue;
    const JsonValue* ratio = materials[m]->find("poisson_ratio");
    in_.warning(ratio ? *ratio : *materials[m],
                fmt::format("material '{}' hardly changes its volume, and locks where a cell has "
                            "several particles: forces come out up to a fifth too high, "
                            "pressures have stripes",
                            model_.materials[m].name),
                "take \"b_bar\": true in 'analysis', or \"per_cell\": 1, and compare with half the "
                "cell");
  }
}

}  // namespace lahar

#include "io/scenario/scenario_builder_instances.h"
