// Stages of generated scenarios.
#include <fmt/format.h>

#include <algorithm>

#include "tests/properties/scenario_parts.h"

namespace lahar::test {

namespace {

Json half_of(const Outline& outline, int axis, double share, bool upper) {
  std::vector<double> at(3, 0.0);
  Json normal = Json::array();
  for (int d = 0; d < outline.dim; ++d) normal.push_back(d == axis ? (upper ? -1 : 1) : 0);
  at[static_cast<std::size_t>(axis)] = share * outline.counts[static_cast<std::size_t>(axis)];
  return {{"half_space", {{"point", point(outline, at)}, {"normal", normal}}}};
}

/// Some particles: of a set or of a region.
Json group_of(Choices& choices, const std::string& of, const Outline& outline) {
  switch (choices.pick(of + "where", outline.shapes ? 4 : 3)) {
    case 1:
      return {{"pset", "body0"}};
    case 2:
      return {{"region", half_of(outline, outline.dim - 1, 0.45, true)}};
    case 3:
      return {{"region", {{"above", "middle"}}}};
    default:
      return {{"region", half_of(outline, 0, choices.number(of + "share", 0.4, 0.1, 0.9), false)}};
  }
}

void add_particles(Choices& choices, const std::string& of, const Outline& outline, Json& stage) {
  if (choices.chance(of + "remove", 45)) {
    stage["remove"].push_back(group_of(choices, of + "remove.", outline));
    if (choices.chance(of + "remove.more", 25))
      stage["remove"].push_back(group_of(choices, of + "remove.other.", outline));
    for (Json& removal : stage["remove"])
      if (choices.chance(of + "remove.slowly", 50))
        removal["over"] = choices.number(of + "remove.over", 0.2, 0.05, 0.5) * stable_step(outline);
  }
  if (choices.chance(of + "change", 45)) {
    Json change = group_of(choices, of + "change.", outline);
    change["material"] =
        material_of(outline, choices.pick(of + "change.to", static_cast<int>(outline.solids())));
    stage["change_material"].push_back(change);
  }
  if (choices.chance(of + "reset", 40))
    stage["reset"] = choices.chance(of + "reset.both", 50) ? Json{"displacement", "strain"}
                                                           : Json{"displacement"};
  if (!choices.chance(of + "place", 45)) return;
  const double x = choices.pick(of + "place.x", 5), y = 2 + choices.pick(of + "place.y", 3);
  Json generator{{"type", "region"}, {"per_cell", 1 + choices.pick(of + "place.per_cell", 2)}};
  const Json box{{"min", point(outline, {x, y, y})},
                 {"max", point(outline, {x + 2, y + 1, y + 1})}};
  generator["region"]["box"] = box;
  if (outline.shapes && choices.chance(of + "place.shape", 50))
    generator["region"] = shape_region_of(choices, of + "place.", outline, box);
  generator["material"] =
      material_of(outline, choices.pick(of + "place.material", static_cast<int>(outline.solids())));
  if (outline.has_soil || choices.chance(of + "place.stress", 40)) generator["stress"] = {-2000};
  if (choices.chance(of + "place.velocity", 20))
    generator["velocity"] = outline.dim == 2 ? Json{0.5, -0.5} : Json{0.5, 0, -0.5};
  stage["place"].push_back({{"generator", generator}});
}

Json gravity_of(Choices& choices, const std::string& of, const Outline& outline) {
  const bool tilts = outline.plane != "axisymmetric" && choices.chance(of + "loads.tilted", 50);
  Json gravity = outline.dim == 2 ? Json{0, -5} : Json{0, 0, -5};
  if (tilts) gravity[0] = 2;
  if (choices.chance(of + "loads.ramp", 30)) return {{"gravity", gravity}, {"ramping_time", 0.05}};
  return gravity;
}

void add_method(Choices& choices, const std::string& of, const Outline& outline,
                const GeneratedCase& made, Json& stage) {
  if (choices.chance(of + "steps", 50))
    stage["analysis"]["nsteps"] = 1 + choices.pick(of + "steps.number", made.steps);
  if (outline.solves.empty() && choices.chance(of + "scheme", 30) && !outline.contact)
    stage["analysis"]["mpm_scheme"] = choices.of(of + "scheme.name", {"musl", "usf"});
  if (choices.chance(of + "undamped", 20)) stage["analysis"]["damping"] = nullptr;
  if (choices.chance(of + "until", 15)) stage["analysis"]["until"] = nullptr;
  if (choices.chance(of + "loads", 25))
    stage["external_loading_conditions"]["gravity"] = gravity_of(choices, of, outline);
  if (choices.chance(of + "free", 15))
    stage["mesh"]["boundary_conditions"]["velocity_constraints"] = nullptr;
  if (choices.chance(of + "output", 30))
    stage["post_processing"].update({{"output_steps", 3}, {"output_dt", nullptr}});
  if (outline.gauges && choices.chance(of + "gauges", 20))
    stage["post_processing"]["gauges"] = {{{"name", "later"}, {"type", "particles"}}};
}

/// A stage is longer than what it removes little by little needs, whatever its steps.
void outlast_removals(const GeneratedCase& made, Json& stage) {
  constexpr int enough = 6;  // of a tenth of a stable step, the shortest that there are
  const Json removals = stage.value("remove", Json::array());
  if (std::none_of(removals.begin(), removals.end(),
                   [](const Json& removal) { return removal.contains("over"); }))
    return;
  Json& analysis = stage["analysis"];
  const int steps = analysis.contains("nsteps") ? analysis["nsteps"].get<int>() : made.steps;
  analysis["nsteps"] = std::max(enough, steps);
  analysis["end_time"] = nullptr;
}

/// All materials, of which some are softer or stronger.
void add_materials(Choices& choices, const std::string& of, const Json& materials, Json& stage) {
  if (!choices.chance(of + "materials", 25)) return;
  Json changed = materials;
  for (Json& law : changed)
    for (const char* key : {"youngs_modulus", "cohesion", "yield_stress", "dynamic_viscosity"})
      if (law.contains(key) && law[key].is_number() && !law.contains("residual_cohesion"))
        law[key] = 1.3 * law[key].get<double>();
  stage["materials"] = changed;
}

}  // namespace

Json stages_of(Choices& choices, const Outline& outline, const GeneratedCase& made,
               const Json& materials) {
  Json all = Json::array();
  if (!outline.stages) return all;
  all.push_back({{"name", "first"}});
  // Implicit steps before explicit ones, or after them.
  const bool changes =
      outline.is_implicit() && !outline.displaces && choices.chance("stages.solve", 50);
  const bool begins = changes && choices.chance("stages.solve.later", 50);
  if (begins) all[0]["analysis"] = explicit_steps_of(choices, "stages.first.", outline);
  const int more = 1 + choices.pick("stages.more", 2);
  for (int k = 0; k < more; ++k) {
    const std::string of = name("stage", k, "");
    Json stage{{"name", fmt::format("more{}", k)}};
    if (!choices.chance(of + "same_particles", 15)) add_particles(choices, of, outline, stage);
    if (!choices.chance(of + "same_method", 25)) {
      add_method(choices, of, outline, made, stage);
      add_materials(choices, of, materials, stage);
    }
    if (changes && k == 0) {
      stage["analysis"].update(begins ? solving_steps_of(choices, outline)
                                      : explicit_steps_of(choices, of, outline));
      if (begins && !stage["analysis"].contains("time_step"))
        stage["analysis"]["time_step"] = nullptr;
    }
    outlast_removals(made, stage);
    all.push_back(stage);
  }
  return all;
}

}  // namespace lahar::test
