// What a stage does to particles when it begins.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "io/scenario/regions.h"
#include "io/scenario/scenario_builder.h"

namespace lahar {

template <int Dim>
ParticleGroup<Dim> ScenarioBuilder<Dim>::group_of(const JsonValue& entry) {
  ParticleGroup<Dim> group;
  const JsonValue* shape = entry.find("region");
  const bool set = entry.find("pset") || entry.find("pset_id");
  if (!shape == !set) {
    if (!written(entry, "region"))
      in_.error(entry, "which particles? Give a 'region' or a 'pset', and one of them",
                "{\"region\": {\"box\": {\"min\": [0, 0], \"max\": [1, 1]}}}");
    return group;
  }
  if (shape) {
    const auto region = std::make_shared<const Region<Dim>>(region_of(*shape));
    group.region = [region](const Vec<Dim>& x) { return region->contains(x); };
  } else if (auto ids = members(entry, "pset_id", "pset", sets_.particles)) {
    group.members = std::move(*ids);
  }
  return group;
}

// Particles have the columns of a liquid in their pores, or they have not.
template <int Dim>
void ScenarioBuilder<Dim>::check_new_material(const JsonValue& at, std::uint16_t material) {
  const auto& used = model_.particles.material;
  const auto has_liquid = [&](std::uint16_t m) { return model_.materials[m].liquid.has_value(); };
  const bool liquid = has_liquid(material);
  const bool other = std::any_of(used.begin(), used.end(),
                                 [&](std::uint16_t m) { return has_liquid(m) != liquid; });
  if (team_.any(other))
    in_.error(at,
              liquid ? "a material with a liquid in its pores is for particles that have one"
                     : "this material has no liquid in its pores, and the particles have one",
              liquid ? "take a material without a liquid" : "\"material\": [skeleton, liquid]");
}

template <int Dim>
void ScenarioBuilder<Dim>::build_changes() {
  StageChanges<Dim>& changes = model_.changes;
  changes.keeps_strains = in_.keeps_strains;
  for (const JsonValue& entry : in_.given_materials)
    if (const int material = find_material(entry); material >= 0)
      changes.given.push_back(static_cast<std::uint16_t>(material));
  const JsonValue* given = root_.find("at_start");
  if (!given || !given->is<JsonValue::Object>()) return;
  for (const JsonValue* entry : get_list(*given, "remove"))
    changes.removed.push_back({group_of(*entry), get_number(*entry, "over").value_or(0.0)});
  for (const JsonValue* entry : get_list(*given, "change_material")) {
    ParticleGroup<Dim> group = group_of(*entry);
    const int material = find_material(*entry);
    if (material < 0) continue;
    check_new_material(*entry, static_cast<std::uint16_t>(material));
    changes.materials.push_back({std::move(group), static_cast<std::uint16_t>(material)});
  }
  for (const std::string& what : get_texts(*given, "reset")) {
    changes.reset_displacements |= what == "displacement";
    changes.reset_strains |= what == "strain";
    if (what != "displacement" && what != "strain")
      in_.error(*given->find("reset"),
                fmt::format("'reset' knows \"displacement\" and \"strain\", found {}",
                            json_quoted(what)));
  }
}

// What is left has to come to rest after all is gone.
template <int Dim>
void ScenarioBuilder<Dim>::check_removal_times() {
  constexpr double few_steps = 10;
  const JsonValue* given = root_.find("at_start");
  if (!given || !given->is<JsonValue::Object>()) return;
  const Analysis& analysis = model_.analysis;
  double end = analysis.end_time;
  if (!analysis.step.adaptive)
    end = std::min(end, static_cast<double>(analysis.nsteps) * analysis.step.dt);
  for (const JsonValue* entry : get_list(*given, "remove")) {
    const double over = get_number(*entry, "over").value_or(0.0);
    if (over <= 0) {
      const JsonValue* given_over = entry->find("over");
      const bool is_meant = given_over && !given_over->defaulted;
      if (!is_meant && !is_implicit(analysis) && !is_projection(analysis) &&
          !model_.gravity.isZero(0.0))
        in_.warning(*entry,
                    "all of it is gone at once: what it lay on bounces, and loses horizontal "
                    "stress where it is soil without cohesion",
                    "let it go in a time that is long for waves in the ground, as \"over\": 1; "
                    "\"over\": 0 says that it is as sudden as that");
      continue;
    }
    if (is_projection(analysis) && !analysis.two_phase)
      in_.error(*entry->find("over"),
                "in a projection of a liquid nothing goes little by little: cells that count as "
                "filled keep their volume",
                "leave 'over' out, or take an explicit scheme");
    else if (over >= end)
      in_.error(
          *entry->find("over"),
          fmt::format("all is gone after {:.6g} s, but the stage ends at {:.6g} s", over, end),
          "let the stage be longer, so that what is left comes to rest, or 'over' shorter");
    else if (!analysis.step.adaptive && over < few_steps * analysis.step.dt)
      in_.warning(
          *entry->find("over"),
          fmt::format("all goes within {:.2g} step(s), nearly as suddenly as without 'over'",
                      std::ceil(over / analysis.step.dt)),
          fmt::format("at least {} steps: \"over\": {:.3g}, or a shorter dt", few_steps,
                      few_steps * analysis.step.dt));
  }
}

}  // namespace lahar

#include "io/scenario/scenario_builder_instances.h"
