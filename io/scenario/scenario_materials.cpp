// Materials and functions of time.
#include <fmt/format.h>

#include <algorithm>

#include "io/scenario/law_reader.h"
#include "io/scenario/scenario_builder.h"
#include "io/schema/keys.h"
#include "physics/materials/law.h"

namespace lahar {

namespace {

// Complains about an id or name that an earlier entry has; true if it is new.
template <class T>
bool is_new(const std::map<T, const JsonValue*>& seen, const T& key, const JsonValue& at,
            std::string_view what, ScenarioInput& in) {
  const auto it = seen.find(key);
  if (it == seen.end()) return true;
  in.error(at,
           fmt::format("{} '{}' occurs twice; first {}", what, key, in.document.line(*it->second)));
  return false;
}

// The entry with this id or name; reports one that does not exist.
template <class Entries, class Id, class Name>
int find_entry(const JsonValue& value, const Entries& entries, Id id, Name name,
               std::string_view what, ScenarioInput& in) {
  std::vector<std::string> names, ids;
  for (std::size_t i = 0; i < entries.size(); ++i) {
    if (value.is<std::string>() ? name(i) == value.as<std::string>()
                                : id(i) == static_cast<Index>(value.number()))
      return static_cast<int>(i);
    if (!name(i).empty()) names.push_back(name(i));
    ids.push_back(fmt::format("{}", id(i)));
  }
  if (value.is<std::string>())
    in.error(value, fmt::format("there is no {} named '{}'", what, value.as<std::string>()),
             names.empty() ? fmt::format("no {} has a name", what)
                           : suggest(value.as<std::string>(), names, "names"));
  else
    in.error(value, fmt::format("there is no {} with the id {}", what, to_json(value)),
             ids.empty() ? "" : fmt::format("ids: {}", list_some(ids)));
  return -1;
}

// Frames hold all state variables; a name that no material has is probably misspelt.
void check_names_of_state_variables(const JsonValue& post, std::span<const Material> materials,
                                    ScenarioInput& in) {
  std::vector<std::string> known;
  for (const StateVariable* variable : state_variables(materials))
    known.emplace_back(variable->name);
  const auto check = [&](const JsonValue* names) {
    if (!names || !names->is<JsonValue::Array>()) return;
    for (const JsonValue& name : names->as<JsonValue::Array>()) {
      if (!name.is<std::string>()) continue;
      const auto& text = name.as<std::string>();
      if (std::find(known.begin(), known.end(), text) == known.end())
        in.warning(name, fmt::format("no material has a state variable '{}'", text),
                   known.empty() ? "" : suggest(text, known, "state variables"));
    }
  };
  check(post.find("vtk_statevars"));  // the older form
  for (const JsonValue* entry : get_list(post, "vtk_statevars")) check(entry->find("statevars"));
}

}  // namespace

template <int Dim>
void ScenarioBuilder<Dim>::build_materials() {
  std::map<Index, const JsonValue*> ids;
  std::map<std::string, const JsonValue*> names;
  Index position = 0;
  for (const JsonValue* m : get_list(root_, "materials")) {
    Material& material = model_.materials.emplace_back();
    const JsonValue* id = m->find("id");
    material.id = get_integer(*m, "id").value_or(position++);
    if (is_new(ids, material.id, id ? *id : *m, "material id", in_)) ids[material.id] = m;
    const auto name = get_text(*m, "name");
    material.name = name.value_or(fmt::format("{}", material.id));
    if (name && is_new(names, *name, *m->find("name"), "material name", in_)) names[*name] = m;
    material.density = get_number(*m, "density").value_or(1);
    const std::optional<JsonValue> plain = take_fields(*m);
    material.law = read_law(plain ? *plain : *m, in_);
  }
  const JsonValue* list = root_.find("materials");
  if (list && model_.materials.empty() && list->is<JsonValue::Array>())
    in_.error(*list, "there are no materials",
              "give at least one material: its type, density and parameters");
  check_names_of_state_variables(section("post_processing"), model_.materials, in_);
}

template <int Dim>
int ScenarioBuilder<Dim>::find_material(const JsonValue& object, bool assigned) {
  const JsonValue* value = in_.either(object, "material_id", "material");
  if (!value) {
    const auto& members = object.as<JsonValue::Object>();
    if (std::none_of(members.begin(), members.end(),
                     [](const auto& m) { return m.key == "material_id" || m.key == "material"; }))
      in_.error(object, "'material' is missing", "material: an id or a name of materials[]");
    return -1;
  }
  if (model_.materials.empty()) return -1;  // reported
  const auto find = [&](const JsonValue& wanted) {
    return find_entry(
        wanted, model_.materials, [&](std::size_t i) { return model_.materials[i].id; },
        [&](std::size_t i) { return model_.materials[i].name; }, "material", in_);
  };
  const auto one = [&](const JsonValue& wanted) {
    const int found = find(wanted);
    if (found >= 0 && assigned) single_.push_back({found, &wanted});
    return found;
  };
  if (!value->is<JsonValue::Array>()) return one(*value);
  const auto& phases = value->as<JsonValue::Array>();
  if (phases.size() == 1) return one(phases.front());
  if (phases.size() != 2) {
    in_.error(*value,
              fmt::format("'material_id' must have one or two materials, found {}", phases.size()),
              "[skeleton, liquid in its pores]");
    return -1;
  }
  const int skeleton = find(phases[0]), liquid = find(phases[1]);
  if (skeleton < 0 || liquid < 0) return -1;
  saturate(skeleton, liquid, *value);
  return skeleton;
}

template <int Dim>
void ScenarioBuilder<Dim>::build_functions() {
  std::map<Index, const JsonValue*> ids;
  for (const JsonValue* v : get_list(root_, "math_functions")) {
    const auto position = static_cast<Index>(model_.functions.size());
    MathFunction& f = model_.functions.emplace_back();
    const Index id = get_integer(*v, "id").value_or(position);
    if (is_new(ids, id, *v, "math function id", in_)) ids[id] = v;
    f.differentiated = get_bool(*v, "derivative").value_or(false);
    if (get_text(*v, "type") == "Sin") {
      f.kind = MathFunction::Kind::sine;
      f.x0 = get_number(*v, "x0").value_or(0);
      f.a = get_number(*v, "a").value_or(0);
      const auto range = get_numbers(*v, "xrange");
      if (v->find("xrange") && (range.size() != 2 || range[0] > range[1]))
        in_.error(*v->find("xrange"), "'xrange' must be [from, to] with from <= to");
      else if (!range.empty())
        f.lo = range[0], f.hi = range[1];
      continue;
    }
    if (written(*v, "file")) {
      read_function(*v, f);
      continue;
    }
    for (const char* key : {"xvalues", "fxvalues"})
      if (!written(*v, key))
        in_.error(*v, fmt::format("'{}' is missing in a math function", key),
                  "give xvalues [s] and fxvalues, or a file");
    f.x = get_numbers(*v, "xvalues");
    f.f = get_numbers(*v, "fxvalues");
    if (!v->find("xvalues") || !v->find("fxvalues")) continue;
    if (f.x.size() != f.f.size() || f.x.empty())
      in_.error(*v->find("fxvalues"),
                fmt::format("'xvalues' and 'fxvalues' must have the same length of at least 1, "
                            "found {} and {}",
                            f.x.size(), f.f.size()));
    else if (std::adjacent_find(f.x.begin(), f.x.end(), std::greater_equal<>()) != f.x.end())
      in_.error(*v->find("xvalues"), "'xvalues' must be ascending");
  }
}

template <int Dim>
void ScenarioBuilder<Dim>::read_function(const JsonValue& object, MathFunction& f) {
  for (const char* key : {"xvalues", "fxvalues"})
    if (const JsonValue* value = object.find(key))
      in_.error(*value, fmt::format("'{}' does not go together with 'file'", key),
                "the file has a time and a value in each row");
  const auto file = in_.open(object, "file");
  if (!file) return;
  SideFile plain = *file;
  plain.text = file->all();
  std::replace(plain.text.begin(), plain.text.end(), ',', ' ');
  RowReader rows(plain, in_.problems);
  while (rows.next()) {
    double x = 0, fx = 0;
    if (!rows.real(x, "the time") || !rows.real(fx, "the value") || !rows.end_of_row()) continue;
    if (!f.x.empty() && x <= f.x.back())
      rows.complain(fmt::format("times must be ascending, found {} after {}", x, f.x.back()));
    f.x.push_back(x);
    f.f.push_back(fx);
  }
  if (f.x.empty() && !rows.failed())
    rows.complain_file("the file holds no data", "rows are: time value");
}

template <int Dim>
int ScenarioBuilder<Dim>::find_function(const JsonValue& object) {
  const JsonValue* value = object.find("math_function_id");
  if (!value) return -1;
  const auto entries = get_list(root_, "math_functions");
  return find_entry(
      *value, entries,
      [&](std::size_t i) { return get_integer(*entries[i], "id").value_or(static_cast<Index>(i)); },
      [&](std::size_t i) { return get_text(*entries[i], "name").value_or(""); }, "math function",
      in_);
}

}  // namespace lahar

#include "io/scenario/scenario_builder_instances.h"
