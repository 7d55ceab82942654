// The JSON Schema of the input, from the key tables.
#include <fmt/format.h>

#include <cmath>

#include "io/schema/keys.h"

namespace lahar {

namespace {

std::string pair(std::string_view key, const std::string& value) {
  return fmt::format("{}: {}", json_quoted(key), value);
}

std::string object_of(const std::vector<std::string>& members) {
  return "{" + join(members) + "}";
}

std::string array_of(const std::vector<std::string>& items) {
  return "[" + join(items) + "]";
}

std::string texts_of(const std::vector<std::string_view>& words) {
  std::vector<std::string> quoted;
  for (const auto w : words) quoted.push_back(json_quoted(w));
  return array_of(quoted);
}

std::string reference_to(const KeySpec& spec) {
  return object_of({pair("$ref", json_quoted(fmt::format("#/$defs/{}", spec.section().path)))});
}

// {"type": "number", "minimum": 0}
std::string number_schema(const KeySpec& spec, std::string_view type) {
  std::vector<std::string> m = {pair("type", json_quoted(type))};
  if (std::isfinite(spec.min))
    m.push_back(pair(spec.above_min ? "exclusiveMinimum" : "minimum", fmt::format("{}", spec.min)));
  if (std::isfinite(spec.max))
    m.push_back(pair(spec.below_max ? "exclusiveMaximum" : "maximum", fmt::format("{}", spec.max)));
  return object_of(m);
}

std::string items_schema(const std::string& items, int least = 0, int most = 0) {
  std::vector<std::string> m = {pair("type", "\"array\""), pair("items", items)};
  if (least > 0) m.push_back(pair("minItems", fmt::format("{}", least)));
  if (most > 0) m.push_back(pair("maxItems", fmt::format("{}", most)));
  return object_of(m);
}

// Every spelling of a text that is allowed today.
std::string spellings(const Section& section, const KeySpec& spec) {
  std::vector<std::string> out;
  for (const auto word : spec.allowed) {
    out.push_back(json_quoted(word));
    if (section.dimension_suffix && spec.key == section.discriminator)
      for (const char* suffix : {"2D", "3D"})
        out.push_back(json_quoted(std::string(word) + suffix));
  }
  return array_of(out);
}

std::string kind_schema(const Section& section, const KeySpec& spec, unsigned kind) {
  const std::string name = object_of({pair("type", "\"string\"")});
  switch (kind) {
    case boolean:
      return spec.planned.size() == 1 && spec.planned[0] == "true" ? "{\"const\": false}"
                                                                   : "{\"type\": \"boolean\"}";
    case integer:
    case number:
      return number_schema(spec, kind == integer ? "integer" : "number");
    case text:
      return spec.allowed.empty() ? name : object_of({pair("enum", spellings(section, spec))});
    case file:
      return name;
    case vector:
      return items_schema(number_schema(spec, "number"), 2, 3);
    case counts:
      return items_schema(number_schema(spec, "integer"), 2, 3);
    case numbers:
      return items_schema("{\"type\": \"number\"}");
    case texts:
      return items_schema(name);
    case object:
      return reference_to(spec);
    case list:
      return items_schema(reference_to(spec));
    case map:
      return object_of(
          {pair("type", "\"object\""), pair("additionalProperties", reference_to(spec))});
    case id:
      return object_of({pair("anyOf", array_of({number_schema(spec, "integer"), name}))});
    case ids:
      return items_schema("{\"type\": [\"integer\", \"string\"]}", 1, 1);
    case direction:
      return "{\"enum\": [0, 1, 2, \"x\", \"y\", \"z\"]}";
    default:
      return items_schema(items_schema("{\"type\": \"number\"}", 2, 2), 3);
  }
}

std::string row_schema(const Section& section, const KeySpec& spec) {
  std::string help(spec.help);
  if (!spec.unit.empty()) help += fmt::format(" [{}]", spec.unit);
  std::vector<std::string> members;
  if (spec.support == Support::planned || spec.support == Support::older) {
    const char* why = spec.support == Support::planned ? " (not supported yet)" : " (older format)";
    members = {pair("description", json_quoted(help + why)), pair("not", "{}")};
    return object_of(members);
  }
  members.push_back(pair("description", json_quoted(help)));
  if (!spec.fallback.empty() && spec.fallback_3d.empty())
    members.push_back(pair("default", std::string(spec.fallback)));
  std::vector<std::string> kinds;
  for (unsigned kind = 1; kind <= points; kind <<= 1)
    if ((spec.kinds & kind) && !(spec.planned_kinds & kind))
      kinds.push_back(kind_schema(section, spec, kind));
  if (spec.kinds != any) members.push_back(pair("anyOf", array_of(kinds)));
  return object_of(members);
}

// The schema of a key: of all rows that it has, for different values of the discriminator.
std::string key_schema(const Section& section, const KeySpec& first) {
  std::vector<std::string> all;
  for (const KeySpec& spec : section.keys)
    if (spec.key == first.key) all.push_back(row_schema(section, spec));
  return all.size() == 1 ? all.front() : object_of({pair("anyOf", array_of(all))});
}

// {"if": {"properties": {"type": {"enum": [...]}}}, "then": {"required": [...]}}
std::string variant_rule(const Section& section, const KeySpec& spec) {
  std::vector<std::string> names;
  for (const auto variant : spec.only) {
    names.push_back(json_quoted(variant));
    if (!section.dimension_suffix) continue;
    for (const char* suffix : {"2D", "3D"})
      names.push_back(json_quoted(std::string(variant) + suffix));
  }
  const std::string type =
      object_of({pair(section.discriminator, object_of({pair("enum", array_of(names))}))});
  return object_of({pair("if", object_of({pair("properties", type)})),
                    pair("then", object_of({pair("required", texts_of({spec.key}))}))});
}

std::string section_schema(const Section& section) {
  std::vector<std::string> properties, rules;
  std::vector<std::string_view> required;
  for (const KeySpec& spec : section.keys) {
    if (section.find(spec.key) == &spec)
      properties.push_back(pair(spec.key, key_schema(section, spec)));
    if (spec.required && spec.only.empty()) required.push_back(spec.key);
    if (spec.required && !spec.only.empty()) rules.push_back(variant_rule(section, spec));
  }
  std::vector<std::string> members = {
      pair("type", "\"object\""), pair("description", json_quoted(section.help)),
      pair("properties", object_of(properties)), pair("additionalProperties", "false")};
  if (!required.empty()) members.push_back(pair("required", texts_of(required)));
  if (!rules.empty()) members.push_back(pair("allOf", array_of(rules)));
  return object_of(members);
}

}  // namespace

std::string scenario_schema() {
  std::vector<std::string> definitions;
  for (const Section* section : all_sections())
    definitions.push_back(pair(section->path, section_schema(*section)));
  const std::string text =
      object_of({pair("$schema", "\"https://json-schema.org/draft/2020-12/schema\""),
                 pair("title", "\"Lahar scenario\""),
                 pair("$ref", json_quoted(fmt::format("#/$defs/{}", scenario_section().path))),
                 pair("$defs", object_of(definitions))});
  return to_json(parse_json_literal(text)) + "\n";
}

}  // namespace lahar
