// The JSON Schema of the input, from the key tables.
#include <fmt/format.h>

#include <cmath>

#include "io/json/json_text.h"
#include "io/schema/keys.h"

namespace lahar {

namespace {

using Json = nlohmann::ordered_json;

Json reference_to(const Section& section) {
  return {{"$ref", fmt::format("#/$defs/{}", section.path)}};
}

// A merge patch of such an object: any of its keys, or null for those that it removes.
Json reference_to_change(const Section& section) {
  return {{"$ref", fmt::format("#/$defs/{} (change)", section.path)}};
}

Json number_schema(const KeySpec& spec, const char* type) {
  Json schema = {{"type", type}};
  if (std::isfinite(spec.min)) schema[spec.above_min ? "exclusiveMinimum" : "minimum"] = spec.min;
  if (std::isfinite(spec.max)) schema[spec.below_max ? "exclusiveMaximum" : "maximum"] = spec.max;
  return schema;
}

Json items_schema(const Json& items, int least = 0, int most = 0) {
  Json schema = {{"type", "array"}, {"items", items}};
  if (least > 0) schema["minItems"] = least;
  if (most > 0) schema["maxItems"] = most;
  return schema;
}

// {"enum": [...]}: the words, and those with 2D and 3D where the key may have them.
Json enumeration(const std::vector<std::string_view>& words, bool dimension_suffix) {
  Json all = Json::array();
  for (const std::string_view view : words) {
    const std::string word(view);
    all.push_back(word);
    if (!dimension_suffix) continue;
    for (const char* suffix : {"2D", "3D"}) all.push_back(word + suffix);
  }
  return {{"enum", all}};
}

Json kind_schema(const Section& section, const KeySpec& spec, unsigned kind) {
  const Json name = {{"type", "string"}}, any_number = {{"type", "number"}};
  switch (kind) {
    case boolean:
      if (spec.planned.size() == 1 && spec.planned[0] == "true") return {{"const", false}};
      return {{"type", "boolean"}};
    case integer:
    case number:
      return number_schema(spec, kind == integer ? "integer" : "number");
    case text:
      if (spec.allowed.empty()) return name;
      return enumeration(spec.allowed,
                         section.dimension_suffix && spec.key == section.discriminator);
    case file:
      return name;
    case vector:
      return items_schema(number_schema(spec, "number"), 2, 3);
    case cell_counts:
      return items_schema(number_schema(spec, "integer"), 2, 3);
    case numbers:
      return items_schema(any_number);
    case texts:
      return items_schema(name);
    case object:
      return &section == &stage_section() ? reference_to_change(spec.section())
                                          : reference_to(spec.section());
    case list:
      return items_schema(reference_to(spec.section()));
    case map:
      return {{"type", "object"}, {"additionalProperties", reference_to(spec.section())}};
    case id:
      return {{"anyOf", Json::array({number_schema(spec, "integer"), name})}};
    case ids:
      return items_schema({{"type", Json::array({"integer", "string"})}}, 1, 2);
    case direction:
      return {{"enum", Json::array({0, 1, 2, "x", "y", "z"})}};
    case phase_direction:
      return {{"enum", Json::array({0, 1, 2, 3, 4, 5, "x", "y", "z"})}};
    case places:
      return items_schema(items_schema(any_number, 2, 3));
    default:
      return items_schema(items_schema(any_number, 2, 2), 3);
  }
}

Json row_schema(const Section& section, const KeySpec& spec) {
  std::string help(spec.help);
  if (!spec.unit.empty()) help += fmt::format(" [{}]", spec.unit);
  if (spec.support == Support::planned || spec.support == Support::older) {
    help += spec.support == Support::planned ? " (not supported yet)" : " (older format)";
    return {{"description", help}, {"not", Json::object()}};
  }
  Json schema = {{"description", help}};
  if (!spec.fallback.empty() && spec.fallback_3d.empty())
    schema["default"] = Json::parse(spec.fallback);
  if (spec.kinds == any) return schema;
  for (unsigned kind = 1; kind < any; kind <<= 1)
    if ((spec.kinds & kind) && !(spec.planned_kinds & kind))
      schema["anyOf"].push_back(kind_schema(section, spec, kind));
  return schema;
}

// The schema of a key: of all rows that it has, for different values of the discriminator.
Json key_schema(const Section& section, std::string_view key) {
  Json all = Json::array();
  for (const KeySpec& spec : section.keys)
    if (spec.key == key) all.push_back(row_schema(section, spec));
  if (all.size() == 1) return all[0];
  return {{"anyOf", all}};
}

// {"if": {"properties": {"type": {"enum": [...]}}}, "then": {"required": [...]}}
Json variant_rule(const Section& section, const KeySpec& spec) {
  const Json type = {
      {std::string(section.discriminator), enumeration(spec.only, section.dimension_suffix)}};
  Json rule;
  rule["if"]["properties"] = type;
  rule["then"]["required"] = Json::array({spec.key});
  return rule;
}

Json object_schema(const Section& section) {
  Json properties = Json::object(), required = Json::array(), rules = Json::array();
  for (const KeySpec& spec : section.keys) {
    if (section.find(spec.key) == &spec)
      properties[std::string(spec.key)] = key_schema(section, spec.key);
    if (!spec.required) continue;
    if (spec.only.empty())
      required.push_back(spec.key);
    else
      rules.push_back(variant_rule(section, spec));
  }
  Json schema = {{"type", "object"},
                 {"description", section.help},
                 {"properties", properties},
                 {"additionalProperties", false}};
  if (!required.empty()) schema["required"] = required;
  if (!rules.empty()) schema["allOf"] = rules;
  return schema;
}

Json change_schema(const Section& section) {
  Json properties = Json::object();
  for (const KeySpec& spec : section.keys) {
    if (section.find(spec.key) != &spec) continue;
    Json& kinds = properties[std::string(spec.key)]["anyOf"];
    kinds = Json::array({{{"type", "null"}}, key_schema(section, spec.key)});
    if (spec.kinds & object) kinds.push_back(reference_to_change(spec.section()));
  }
  return {{"type", "object"},
          {"description", section.help},
          {"properties", properties},
          {"additionalProperties", false}};
}

// Sections that a stage may change, and those inside of them.
void add_changes(const Section& section, Json& definitions) {
  for (const KeySpec& spec : section.keys) {
    if (!(spec.kinds & object) || !spec.section) continue;
    const std::string path = fmt::format("{} (change)", spec.section().path);
    if (definitions.contains(path)) continue;
    definitions[path] = change_schema(spec.section());
    add_changes(spec.section(), definitions);
  }
}

std::string text_of(const Json& schema) {
  return to_json(parse_json_literal(schema.dump())) + "\n";
}

}  // namespace

std::string section_schema(const Section& section) {
  return text_of(object_schema(section));
}

std::string scenario_schema() {
  Json definitions;
  for (const Section* section : all_sections())
    definitions[std::string(section->path)] = object_schema(*section);
  add_changes(stage_section(), definitions);
  Json schema = {{"$schema", "https://json-schema.org/draft/2020-12/schema"},
                 {"title", "Lahar scenario"}};
  schema.update(reference_to(scenario_section()));
  schema["$defs"] = definitions;
  return text_of(schema);
}

}  // namespace lahar
