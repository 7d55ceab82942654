#include "io/scenario/stages.h"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>

#include "io/json/json_merge.h"
#include "io/json/json_text.h"
#include "io/json/values.h"
#include "io/scenario/scenario_difference.h"
#include "io/schema/keys.h"
#include "physics/boundary/node_absorption.h"
#include "physics/boundary/node_spring.h"

namespace lahar {

namespace {

using Object = JsonValue::Object;

constexpr const char* may_change =
    "a stage may change analysis, materials (but for types and densities), "
    "external_loading_conditions, mesh.boundary_conditions, rigid_bodies and post_processing; and "
    "remove, place and change_material of particles";

/// What a stage does to particles once, when it begins: no part of the merge patch.
bool is_operation(std::string_view key) {
  return at_start_section().find(key) || key == "place";
}

bool is_folder_name(std::string_view name) {
  return !name.empty() && name != "." && name != ".." &&
         name.find_first_of(std::string_view("/\0", 2)) == name.npos;
}

void check_name(const JsonValue& stage, std::vector<std::string>& names, ScenarioInput& in) {
  const JsonValue* name = stage.find("name");
  const std::string hint = "results of the stage are in its own folder, RUN/name";
  if (!name) {
    in.error(stage, "'name' is missing in a stage", hint);
    names.emplace_back();
    return;
  }
  const std::string text = name->is<std::string>() ? name->as<std::string>() : "";
  if (!is_folder_name(text))
    in.error(*name,
             fmt::format("'name' must be the name of a folder, found {}",
                         name->is<std::string>() ? json_quoted(text) : describe(*name)),
             hint);
  else if (std::find(names.begin(), names.end(), text) != names.end())
    in.error(*name, fmt::format("two stages have the name {}", json_quoted(text)), hint);
  names.push_back(text);
}

/// Report members of `object` that a stage must not change.
void refuse_keys(const JsonValue& object, const std::string& of, ScenarioInput& in, auto&& may) {
  if (!object.is<Object>()) return;  // reported when it is merged
  for (const JsonValue::Member& member : object.as<Object>())
    if (!may(member.key))
      in.problems.error(in.document.at_key(
          object, member, fmt::format("'{}{}' is the same in all stages", of, member.key),
          may_change));
}

void check_keys(const JsonValue& stage, ScenarioInput& in) {
  const Section& section = stage_section();
  for (const JsonValue::Member& member : stage.as<Object>()) {
    if (section.find(member.key)) continue;
    if (scenario_section().find(member.key)) {
      in.problems.error(in.document.at_key(
          stage, member, fmt::format("'{}' is the same in all stages", member.key), may_change));
      continue;
    }
    std::vector<std::string> known;
    for (const KeySpec& spec : section.keys) known.emplace_back(spec.key);
    in.problems.error(in.document.at_key(stage, member,
                                         fmt::format("unknown key '{}' in a stage", member.key),
                                         suggest(member.key, known, "known keys")));
  }
  if (const JsonValue* mesh = stage.find("mesh"))
    refuse_keys(*mesh, "mesh.", in,
                [](std::string_view key) { return key == "boundary_conditions"; });
  if (const JsonValue* analysis = stage.find("analysis"))
    refuse_keys(*analysis, "analysis.", in,
                [](std::string_view key) { return key != "uuid" && key != "resume"; });
  if (const JsonValue* post = stage.find("post_processing"))
    refuse_keys(*post, "post_processing.", in, [](std::string_view key) { return key != "path"; });
}

/// Particles that are placed, and what is done to others: not in the first stage, which has none
/// before.
void check_operations(const JsonValue& stage, bool first, ScenarioInput& in) {
  for (const JsonValue::Member& member : stage.as<Object>())
    if (first && is_operation(member.key))
      in.problems.error(in.document.at_key(
          stage, member, fmt::format("'{}' is not for the first stage", member.key),
          "no stage is before it: say in particles what there is"));
  const JsonValue* placed = stage.find("place");
  if (placed && !placed->is<JsonValue::Array>())
    in.error(*placed,
             fmt::format("'place' must be an array of objects, found {}", describe(*placed)),
             "[{\"generator\": {\"type\": \"region\", ...}}]");
  for (const JsonValue* entry : get_list(stage, "place"))
    if (const JsonValue* generator = entry->find("generator"))
      if (const auto type = get_text(*generator, "type"); type && *type != "region")
        in.error(*generator,
                 fmt::format("a stage can place particles of type \"region\", found {}",
                             json_quoted(*type)),
                 "others share the volumes of cells with particles that may be there no more");
}

/// What scenarios with stages cannot have.
void check_whole(const JsonValue& root, ScenarioInput& in) {
  for (const JsonValue* entry : get_list(root, "particles"))
    if (const JsonValue* generator = entry->find("generator"))
      if (get_text(*generator, "type") == "inject")
        in.error(*generator, "particles cannot be injected in a scenario with stages",
                 "run the stages one after the other, with \"resume\" in analysis");
  if (const JsonValue* analysis = root.find("analysis"))
    if (const JsonValue* resume = analysis->find("resume"))
      if (get_bool(*resume, "resume").value_or(false))
        in.error(*resume, "a scenario with stages cannot begin with a particle file",
                 "leave out \"resume\", or the stages");
}

/// Materials are those of the scenario, with other parameters.
void check_materials(const JsonValue& before, const JsonValue& now, ScenarioInput& in) {
  if (!before.is<JsonValue::Array>() || !now.is<JsonValue::Array>()) return;
  const auto &a = before.as<JsonValue::Array>(), &b = now.as<JsonValue::Array>();
  if (a.size() != b.size())
    return in.error(now,
                    fmt::format("a stage must have all materials of the scenario, {} in the same "
                                "order; found {}",
                                a.size(), b.size()));
  for (std::size_t k = 0; k < a.size(); ++k)
    for (const char* key : {"id", "name", "type", "density"}) {
      const JsonValue *was = a[k].find(key), *is = b[k].find(key);
      const auto text = [](const JsonValue* value) {
        return value ? to_json(*value, -1) : std::string("not given");
      };
      if ((!was && !is) ||
          (was && is && was->is_number() && is->is_number() ? was->number() == is->number()
                                                            : text(was) == text(is)))
        continue;
      in.error(is ? *is : b[k],
               fmt::format("'{}' of a material is the same in all stages: it is {}, found {}", key,
                           text(was), text(is)),
               "particles keep their mass, and the state that their law gave them");
    }
}

/// Take out of a stage what it does to particles. Generators come after those of the stages before,
/// so that ids do. Of the stage that is read the rest is `at_start` of the scenario.
void take_operations(JsonValue& stage, bool is_read, ScenarioInput& in) {
  Object start;
  for (JsonValue::Member& member : std::get<Object>(stage.data)) {
    if (!is_operation(member.key)) continue;
    JsonValue* particles = in.document.root.find("particles");
    if (member.key == "change_material")
      for (const JsonValue* entry : get_list(stage, member.key))
        in.given_materials.push_back(*entry);
    if (member.key != "place")
      start.push_back(member);
    else if (particles && particles->is<JsonValue::Array>())
      for (JsonValue& entry : std::get<JsonValue::Array>(member.value.data)) {
        std::get<JsonValue::Array>(particles->data).push_back(std::move(entry));
        ++in.placed;
      }
  }
  std::erase_if(std::get<Object>(stage.data), [](const auto& m) { return is_operation(m.key); });
  if (!is_read || start.empty()) return;
  auto& members = std::get<Object>(in.document.root.data);
  const std::uint32_t offset = start.front().offset;
  members.push_back({"at_start", offset, {}});
  members.back().value.data = std::move(start);
}

}  // namespace

std::vector<std::string> take_stage(ScenarioInput& in, std::size_t stage) {
  auto& members = std::get<Object>(in.document.root.data);
  const auto is_list = [](const JsonValue::Member& m) { return m.key == "stages"; };
  const auto at = std::find_if(members.begin(), members.end(), is_list);
  for (const JsonValue::Member& member : members)
    if (member.key == "at_start")
      in.problems.error(in.document.at_key(in.document.root, member,
                                           "'at_start' is not written in a scenario",
                                           "write remove, change_material and reset in a stage"));
  if (at == members.end()) return {};
  if (!at->value.is<JsonValue::Array>() || at->value.as<JsonValue::Array>().empty()) {
    in.error(at->value,
             fmt::format("'stages' must be an array of objects, found {}", describe(at->value)));
    return {};
  }
  std::vector<std::string> names;
  for (const JsonValue& one : at->value.as<JsonValue::Array>()) {
    if (!one.is<Object>()) {
      in.error(one, fmt::format("a stage must be an object, found {}", describe(one)));
      return {};
    }
    check_operations(one, names.empty(), in);
    check_name(one, names, in);
    check_keys(one, in);
  }
  check_whole(in.document.root, in);
  if (!in.problems.empty()) return names;
  const JsonValue stages = std::move(at->value);
  members.erase(at);
  const JsonValue* const own = in.document.root.find("materials");
  const JsonValue materials = own ? *own : JsonValue{};
  for (std::size_t k = 0; k <= stage; ++k) {
    JsonValue patch = stages.as<JsonValue::Array>().at(k);
    take_operations(patch, k == stage, in);
    std::erase_if(std::get<Object>(patch.data), [](const auto& m) { return m.key == "name"; });
    if (const JsonValue* loads = patch.find("external_loading_conditions");
        k == stage && loads && loads->is<Object>())
      for (const JsonValue::Member& load : loads->as<Object>()) in.own_loads.push_back(load.key);
    merge_patch(in.document.root, patch);
  }
  if (const JsonValue* now = in.document.root.find("materials"))
    check_materials(materials, *now, in);
  const auto& all = stages.as<JsonValue::Array>();
  for (std::size_t k = stage + 1; k < all.size(); ++k)
    in.assigns_later |= all[k].find("place") || all[k].find("change_material");
  for (const JsonValue& one : all) {
    const std::vector<std::string> reset = get_texts(one, "reset");
    in.keeps_strains |= one.find("materials") || one.find("change_material") || one.find("place") ||
                        std::find(reset.begin(), reset.end(), "strain") != reset.end();
  }
  if (stage > 0) in.stage = names[stage];
  return names;
}

namespace {

std::vector<std::string> names_of_bodies(const Scenario& scenario) {
  return std::visit(
      [](const auto& model) {
        std::vector<std::string> all;
        for (const auto& body : model.rigid_bodies) all.push_back(body.name);
        return all;
      },
      scenario.model);
}

/// By name of a rigid body, what its entry has of these keys; only of free bodies, if so wanted.
std::map<std::string, std::string> texts_of_bodies(const Scenario& scenario,
                                                   const std::vector<const char*>& keys,
                                                   bool only_free) {
  std::map<std::string, std::string> texts;
  const auto names = names_of_bodies(scenario);
  if (names.empty()) return texts;
  const auto entries = json_of_text(scenario.full).at("rigid_bodies");
  for (std::size_t k = 0; k < names.size(); ++k) {
    const auto& entry = entries.at(k);
    if (only_free && !entry.contains("density") && !entry.contains("mass")) continue;
    std::string& text = texts[names[k]];
    for (const char* key : keys)
      if (!only_free || entry.contains(key)) text += entry.value(key, nlohmann::json()).dump();
  }
  return texts;
}

/// Which conditions of a scenario are springs: their keys.
std::vector<std::string> keys_of_springs(const Scenario& scenario) {
  std::vector<std::string> keys;
  const nlohmann::json::json_pointer where("/mesh/boundary_conditions");
  const auto json = json_of_text(scenario.full);
  if (!json.contains(where)) return keys;
  for (const std::string_view key : {NodeSpring::key, NodeAbsorption::key})
    if (const auto list = json[where].value(std::string(key), nlohmann::json());
        list.is_array() && !list.empty())
      keys.emplace_back(key);
  return keys;
}

bool resets_displacements(const Scenario& scenario) {
  return std::visit([](const auto& model) { return model.changes.reset_displacements; },
                    scenario.model);
}

}  // namespace

StageBody body_of(const Scenario& scenario) {
  return std::visit(
      [&](const auto& model) {
        const Analysis& analysis = model.analysis;
        return StageBody{.two_phase = analysis.two_phase,
                         .projection = analysis.scheme == Scheme::projection,
                         .functions = analysis.functions,
                         .bodies = analysis.contact.bodies,
                         .plane = analysis.plane,
                         .classes = scenario.classes,
                         .rigid_bodies = texts_of_bodies(scenario, {"region", "centre"}, false),
                         .starts = texts_of_bodies(scenario, {"velocity", "spin"}, true),
                         .b_bar = analysis.mean_volume,
                         .foundations = keys_of_springs(scenario)};
      },
      scenario.model);
}

void check_body(const StageBody& before, const Scenario& stage) {
  const StageBody now = body_of(stage);
  std::vector<Problem> problems;
  const auto same = [&](bool is, const char* where, const std::string& what,
                        const char* hint = may_change) {
    if (is) return;
    Problem problem{.where = where,
                    .message = fmt::format("stage {}: {} is the same in all stages",
                                           stage.stages.at(stage.stage), what),
                    .hint = hint};
    problems.push_back(stage.place(problem));
  };
  same(now.two_phase == before.two_phase, "/analysis/type", "the number of phases");
  same(now.projection == before.projection, "/analysis",
       "whether a liquid keeps its volume (projection)");
  same(now.functions == before.functions, "/analysis/shape_functions",
       "'analysis.shape_functions', whose domains particles have,");
  same(now.plane == before.plane, "/analysis/plane", "'analysis.plane', which volumes depend on,");
  same(now.bodies == before.bodies, "/analysis/interface",
       fmt::format("the number of bodies in contact, here {} and before {},", now.bodies,
                   before.bodies),
       "each material that particles have is a body: place particles of a material that there "
       "is, or name the bodies in analysis.contact.bodies");
  for (const auto& [name, shape] : now.rigid_bodies)
    if (const auto old = before.rigid_bodies.find(name); old != before.rigid_bodies.end())
      same(old->second == shape, "/rigid_bodies",
           fmt::format("the rigid body '{}', by 'region' and 'centre',", name),
           "a body that was not there before needs a name of its own");
  // Stages may place particles that come behind those of before.
  const auto &was = before.classes, &is = now.classes;
  same(was.size() <= is.size() && std::equal(was.begin(), was.end(), is.begin()), "/materials",
       "where fields of materials are high and low (seed, lengths, classes, profile)");
  if (!problems.empty()) throw InputError(std::move(problems));
}

std::vector<Problem> changes_of_method(const StageBody& before, const Scenario& stage) {
  std::vector<Problem> found;
  const StageBody own = body_of(stage);
  const auto names = names_of_bodies(stage);
  for (std::size_t k = 0; k < names.size(); ++k) {
    const auto start = own.starts.find(names[k]);
    if (start == own.starts.end() || start->second.empty()) continue;
    const auto was = before.starts.find(names[k]);
    if (!before.rigid_bodies.contains(names[k]) ||
        (was != before.starts.end() && was->second == start->second))
      continue;
    found.push_back(stage.place(
        {.where = fmt::format("/rigid_bodies/{}", k),
         .message = fmt::format("stage {}: 'velocity' and 'spin' of the rigid body '{}' have no "
                                "effect: it is free, and goes on as it moved in the stage before",
                                stage.stages.at(stage.stage), names[k]),
         .hint = "prescribe its motion in a stage of its own before (without density and mass), "
                 "or leave them out"}));
  }
  for (const std::string& key : own.foundations)
    if (std::ranges::find(before.foundations, key) == before.foundations.end() &&
        !resets_displacements(stage))
      found.push_back(stage.place(
          {.where = "/mesh/boundary_conditions/" + key,
           .message = fmt::format("stage {}: '{}' begin here, and their springs are stretched by "
                                  "all that moved in the stages before",
                                  stage.stages.at(stage.stage), key),
           .hint = "\"reset\": [\"displacement\"] in this stage lets them begin without a force. "
                   "What held the nodes before is not taken over: give its reaction as "
                   "concentrated_nodal_forces"}));
  const bool now = own.b_bar;
  if (now == before.b_bar) return found;
  Problem problem{
      .where = "/analysis",
      .message =
          fmt::format("stage {}: steps have {}B-bar, and those of the stage before {}",
                      stage.stages.at(stage.stage), now ? "" : "no ", now ? "have not" : "have"),
      .hint =
          "stiffness and strength change with it: write \"b_bar\" in analysis of the scenario, "
          "true or false; its default: \"lahar info --reference\", b_bar"};
  found.push_back(stage.place(problem));
  return found;
}

bool goes_on_alike(const std::string& before, const std::string& stage) {
  const auto found = differences(before, stage);
  if (!std::all_of(found.begin(), found.end(), [](const auto& one) { return one.allowed; }))
    return false;
  // Loads of the first step are others where they are functions of time, which begins anew.
  const auto json = json_of_text(stage);
  const auto at = [&](const char* pointer) {
    const nlohmann::json::json_pointer where(pointer);
    return json.contains(where) ? json[where] : nlohmann::json();
  };
  return at("/math_functions").empty() && !at("/external_loading_conditions/gravity").is_object();
}

}  // namespace lahar
