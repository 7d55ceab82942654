// The JSON Schema of the input, from the field tables.
#include <fmt/format.h>

#include <cmath>

#include "io/schema/fields.h"

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

std::string reference_to(const Field& f) {
  return object_of({pair("$ref", json_quoted(fmt::format("#/$defs/{}", f.section().path)))});
}

// {"type": "number", "minimum": 0}
std::string number_schema(const Field& f, std::string_view type) {
  std::vector<std::string> m = {pair("type", json_quoted(type))};
  if (std::isfinite(f.min))
    m.push_back(pair(f.above_min ? "exclusiveMinimum" : "minimum", fmt::format("{}", f.min)));
  if (std::isfinite(f.max))
    m.push_back(pair(f.below_max ? "exclusiveMaximum" : "maximum", fmt::format("{}", f.max)));
  return object_of(m);
}

std::string items_schema(const std::string& items, int least = 0, int most = 0) {
  std::vector<std::string> m = {pair("type", "\"array\""), pair("items", items)};
  if (least > 0) m.push_back(pair("minItems", fmt::format("{}", least)));
  if (most > 0) m.push_back(pair("maxItems", fmt::format("{}", most)));
  return object_of(m);
}

// Every spelling of a text that is allowed today.
std::string spellings(const Section& section, const Field& f) {
  std::vector<std::string> out;
  for (const auto word : f.allowed) {
    out.push_back(json_quoted(word));
    if (section.dimension_suffix && f.key == section.discriminator)
      for (const char* suffix : {"2D", "3D"})
        out.push_back(json_quoted(std::string(word) + suffix));
  }
  return array_of(out);
}

std::string kind_schema(const Section& section, const Field& f, unsigned kind) {
  const std::string name = object_of({pair("type", "\"string\"")});
  switch (kind) {
    case boolean:
      return f.planned.size() == 1 && f.planned[0] == "true" ? "{\"const\": false}"
                                                             : "{\"type\": \"boolean\"}";
    case integer:
    case number:
      return number_schema(f, kind == integer ? "integer" : "number");
    case text:
      return f.allowed.empty() ? name : object_of({pair("enum", spellings(section, f))});
    case file:
      return name;
    case vector:
      return items_schema(number_schema(f, "number"), 2, 3);
    case counts:
      return items_schema(number_schema(f, "integer"), 2, 3);
    case numbers:
      return items_schema("{\"type\": \"number\"}");
    case texts:
      return items_schema(name);
    case object:
      return reference_to(f);
    case list:
      return items_schema(reference_to(f));
    case map:
      return object_of({pair("type", "\"object\""), pair("additionalProperties", reference_to(f))});
    case id:
      return object_of({pair("anyOf", array_of({number_schema(f, "integer"), name}))});
    case ids:
      return items_schema("{\"type\": [\"integer\", \"string\"]}", 1, 1);
    case direction:
      return "{\"enum\": [0, 1, 2, \"x\", \"y\", \"z\"]}";
    case phase_direction:
      return "{\"enum\": [0, 1, 2, 3, 4, 5, \"x\", \"y\", \"z\"]}";
    default:
      return items_schema(items_schema("{\"type\": \"number\"}", 2, 2), 3);
  }
}

std::string field_schema(const Section& section, const Field& f) {
  std::string help(f.help);
  if (!f.unit.empty()) help += fmt::format(" [{}]", f.unit);
  std::vector<std::string> members;
  if (f.support == Support::planned || f.support == Support::older) {
    const char* why = f.support == Support::planned ? " (not supported yet)" : " (older format)";
    members = {pair("description", json_quoted(help + why)), pair("not", "{}")};
    return object_of(members);
  }
  members.push_back(pair("description", json_quoted(help)));
  if (!f.fallback.empty() && f.fallback_3d.empty())
    members.push_back(pair("default", std::string(f.fallback)));
  std::vector<std::string> kinds;
  for (unsigned kind = 1; kind <= points; kind <<= 1)
    if ((f.kinds & kind) && !(f.planned_kinds & kind))
      kinds.push_back(kind_schema(section, f, kind));
  if (f.kinds != any) members.push_back(pair("anyOf", array_of(kinds)));
  return object_of(members);
}

// The schema of a key: of all rows that it has, for different values of the discriminator.
std::string key_schema(const Section& section, const Field& first) {
  std::vector<std::string> all;
  for (const Field& f : section.fields)
    if (f.key == first.key) all.push_back(field_schema(section, f));
  return all.size() == 1 ? all.front() : object_of({pair("anyOf", array_of(all))});
}

// {"if": {"properties": {"type": {"enum": [...]}}}, "then": {"required": [...]}}
std::string variant_rule(const Section& section, const Field& f) {
  std::vector<std::string> names;
  for (const auto variant : f.only) {
    names.push_back(json_quoted(variant));
    if (!section.dimension_suffix) continue;
    for (const char* suffix : {"2D", "3D"})
      names.push_back(json_quoted(std::string(variant) + suffix));
  }
  const std::string type =
      object_of({pair(section.discriminator, object_of({pair("enum", array_of(names))}))});
  return object_of({pair("if", object_of({pair("properties", type)})),
                    pair("then", object_of({pair("required", texts_of({f.key}))}))});
}

std::string section_schema(const Section& section) {
  std::vector<std::string> properties, rules;
  std::vector<std::string_view> required;
  for (const Field& f : section.fields) {
    if (section.find(f.key) == &f) properties.push_back(pair(f.key, key_schema(section, f)));
    if (f.required && f.only.empty()) required.push_back(f.key);
    if (f.required && !f.only.empty()) rules.push_back(variant_rule(section, f));
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
