// Bodies in contact: a particle's body is its material's, so bodies of one material get copies of
// it.
#include <fmt/format.h>

#include <algorithm>

#include "io/scenario/scenario_builder.h"

namespace lahar {

namespace {

/// Copies of materials stay so few that a particle's 16 bits can name one.
constexpr std::size_t max_materials = 32768;

}  // namespace

template <int Dim>
void ScenarioBuilder<Dim>::build_contact() {
  const JsonValue& analysis = section("analysis");
  const bool interface = get_bool(analysis, "interface").value_or(false);
  const JsonValue* contact = analysis.find("contact");
  if (contact && !interface)
    in_.error(*contact, "'contact' needs \"interface\": true", "or leave it out");
  if (!interface) return;
  if (model_.mesh && info(model_.mesh->element()).order > 1)
    in_.error(
        *analysis.find("interface"),
        fmt::format("'interface' does not go together with {} cells: their nodal masses may be "
                    "negative",
                    info(model_.mesh->element()).name),
        "take linear elements, or GIMP or B-splines on a structured mesh");
  Contact& plan = model_.analysis.contact;
  if (contact) plan.friction = get_number(*contact, "friction").value_or(0);
  const auto bodies = contact ? get_list(*contact, "bodies") : std::vector<const JsonValue*>{};
  if (bodies.empty())
    for (std::size_t m = 0; m < model_.materials.size(); ++m)
      model_.materials[m].body = static_cast<int>(m);
  int count = 0;  // body 0 is what the list does not name
  for (const JsonValue* body : bodies) add_body(*body, ++count);
  number_bodies();
  check_scheme_of_contact();
  if (plan.bodies == 1 && particles_complete_ && !model_.materials.empty())
    in_.warning(*analysis.find("interface"),
                "'interface' has no effect: all particles are one body",
                "bodies are those of analysis.contact.bodies, or else one for each material");
}

template <int Dim>
void ScenarioBuilder<Dim>::check_scheme_of_contact() {
  if (model_.analysis.contact.bodies == 1 || model_.analysis.scheme == Scheme::musl) return;
  if (is_implicit(model_.analysis)) return;  // refused
  const bool usf = model_.analysis.scheme == Scheme::usf;
  const JsonValue& at = *section("analysis").find("interface");
  const std::string reason =
      usf ? "usf takes strains from velocities before bodies push each other apart, and so contact "
            "makes or takes energy that a smaller step does not give back"
          : "usl takes strains from nodes with hardly any mass that contact accelerates, and so "
            "contact takes up to half of the energy, or cells collapse";
  const std::string hint = "take \"mpm_scheme\": \"musl\", whose energy closes with the step";
  if (in_.cbgeo_defaults)
    in_.warning(at, "'interface' is inaccurate with this 'mpm_scheme': " + reason, hint);
  else
    in_.error(at, "'interface' does not go together with this 'mpm_scheme': " + reason, hint);
}

template <int Dim>
void ScenarioBuilder<Dim>::add_body(const JsonValue& body, int number) {
  const auto& keys = body.as<JsonValue::Object>();
  const auto has = [&](std::string_view key) {
    return std::any_of(keys.begin(), keys.end(), [&](const auto& m) { return m.key == key; });
  };
  const bool of_material = has("material") || has("material_id"),
             of_set = has("pset") || has("pset_id");
  if (of_material == of_set)
    return in_.error(body, "a body needs either 'material' or 'pset'",
                     "material: all particles of that material; pset: the particles of a set");
  if (of_material) {
    if (const int m = find_material(body, false); m >= 0)
      model_.materials[static_cast<std::size_t>(m)].body = number;
    return;
  }
  const auto ids = members(body, "pset_id", "pset", sets_.particles);
  if (!ids || !particles_complete_) return;
  const std::size_t n = model_.materials.size();
  if (2 * n > max_materials)
    return in_.error(body, fmt::format("there are too many bodies of {} materials", n));
  for (std::size_t m = 0; m < n; ++m) {
    model_.materials.push_back(model_.materials[m]);
    model_.materials.back().body = number;
  }
  for (const Index i : *ids) {
    auto& material = model_.particles.material[static_cast<std::size_t>(rows_.local(i))];
    material = static_cast<std::uint16_t>(material + n);
  }
}

// Numbers without gaps for the bodies that have particles, or will get some.
template <int Dim>
void ScenarioBuilder<Dim>::number_bodies() {
  auto& materials = model_.materials;
  if (materials.empty()) return;  // reported; particles name a material that does not exist
  std::vector<char> used(materials.size(), 0);
  for (const std::uint16_t m : model_.particles.material) used[m] = 1;
  for (const Injection<Dim>& injection : model_.injections) used[injection.material] = 1;
  for (char& u : used) u = team_.any(u != 0);
  int last = 0;
  for (const Material& material : materials) last = std::max(last, material.body);
  std::vector<int> number(static_cast<std::size_t>(last) + 1, -1);
  for (std::size_t m = 0; m < materials.size(); ++m)
    if (used[m]) number[static_cast<std::size_t>(materials[m].body)] = 0;
  int count = 0;
  for (int& n : number)
    if (n == 0) n = count++;
  for (Material& material : materials)
    material.body = std::max(0, number[static_cast<std::size_t>(material.body)]);
  model_.analysis.contact.bodies = std::max(1, count);
  if (count > 1 && in_.cbgeo_defaults && team_.any(!entries_of<NodeAcceleration>(model_).empty()))
    in_.error(*boundary().find("acceleration_constraints"),
              "accelerations of nodes cannot be prescribed where bodies are in contact",
              "prescribe velocities, or leave out analysis.contact");
}

}  // namespace lahar

#include "io/scenario/scenario_builder_instances.h"
