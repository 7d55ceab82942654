// The schema and the reference page say what the reader does.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>
#include <string_view>

#include "io/scenario/scenario.h"
#include "io/schema/keys.h"
#include "tests/published_cases.h"
#include "tests/within.h"

namespace fs = std::filesystem;
using namespace lahar;

namespace {

using Array = JsonValue::Array;
using Object = JsonValue::Object;

// As much of JSON Schema as ours uses; the first violation, or "".
class Validator {
 public:
  explicit Validator(const JsonValue& schema) : root_(schema) {}

  std::string check(const JsonValue& v, const JsonValue& schema) const {
    if (const auto* ref = schema.find("$ref")) {
      const std::string path = ref->as<std::string>().substr(std::string("#/$defs/").size());
      const auto* target = root_.find("$defs")->find(path);
      return target ? check(v, *target) : "no definition of " + path;
    }
    if (schema.find("not")) return "never valid";
    if (const auto* constant = schema.find("const"))
      if (to_json(*constant) != to_json(v)) return "not the constant";
    if (const auto* values = schema.find("enum")) {
      bool any = false;
      for (const auto& e : values->as<Array>()) any |= to_json(e) == to_json(v);
      if (!any) return to_json(v) + " is not in the enumeration";
    }
    if (const auto* any = schema.find("anyOf")) {
      std::string why;
      for (const auto& s : any->as<Array>()) {
        why = check(v, s);
        if (why.empty()) break;
      }
      if (!why.empty()) return why;
    }
    if (const auto* type = schema.find("type"))
      if (!has_type(v, *type)) return to_json(v) + " is not of type " + to_json(*type);
    if (v.is_number()) return check_number(v.number(), schema);
    if (v.is<Array>()) return check_array(v, schema);
    if (v.is<Object>()) return check_object(v, schema);
    return "";
  }

 private:
  static bool has_type(const JsonValue& v, const JsonValue& type) {
    if (type.is<Array>()) {
      for (const auto& t : type.as<Array>())
        if (has_type(v, t)) return true;
      return false;
    }
    const auto& name = type.as<std::string>();
    if (name == "object") return v.is<Object>();
    if (name == "array") return v.is<Array>();
    if (name == "string") return v.is<std::string>();
    if (name == "null") return v.is<JsonValue::Null>();
    if (name == "boolean") return v.is<bool>();
    if (name == "integer") return v.is_number() && v.number() == std::floor(v.number());
    return name == "number" && v.is_number();
  }

  static std::string check_number(double x, const JsonValue& schema) {
    const auto bound = [&](const char* key) { return schema.find(key); };
    if (bound("minimum") && x < bound("minimum")->number()) return "too small";
    if (bound("maximum") && x > bound("maximum")->number()) return "too large";
    if (bound("exclusiveMinimum") && x <= bound("exclusiveMinimum")->number()) return "too small";
    if (bound("exclusiveMaximum") && x >= bound("exclusiveMaximum")->number()) return "too large";
    return "";
  }

  std::string check_array(const JsonValue& v, const JsonValue& schema) const {
    const auto n = static_cast<double>(v.as<Array>().size());
    if (schema.find("minItems") && n < schema.find("minItems")->number()) return "too short";
    if (schema.find("maxItems") && n > schema.find("maxItems")->number()) return "too long";
    if (const auto* items = schema.find("items"))
      for (const auto& item : v.as<Array>())
        if (auto why = check(item, *items); !why.empty()) return why;
    return "";
  }

  std::string check_object(const JsonValue& v, const JsonValue& schema) const {
    const auto* properties = schema.find("properties");
    const auto* additional = schema.find("additionalProperties");
    for (const auto& m : v.as<Object>()) {
      const JsonValue* s = properties ? properties->find(m.key) : nullptr;
      if (!s && additional && additional->is<bool>()) return "additional key " + m.key;
      if (!s) s = additional;
      if (s)
        if (auto why = check(m.value, *s); !why.empty()) return m.key + ": " + why;
    }
    if (const auto* required = schema.find("required"))
      for (const auto& key : required->as<Array>())
        if (!v.find(key.as<std::string>())) return "no " + key.as<std::string>();
    if (const auto* rules = schema.find("allOf"))
      for (const auto& rule : rules->as<Array>())
        if (check(v, *rule.find("if")).empty())
          if (auto why = check(v, *rule.find("then")); !why.empty()) return why;
    return "";
  }

  const JsonValue& root_;
};

JsonValue parse(const std::string& text) {
  ProblemList problems;
  JsonDocument document("text", text, problems);
  CHECK(format_problems(problems.errors("text")) == "");
  return std::move(document.root);
}

std::string content(const fs::path& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::string first_code_block(const std::string& markdown) {
  const auto begin = markdown.find("```json\n") + 8;
  return markdown.substr(begin, markdown.find("```", begin) - begin);
}

}  // namespace

TEST_CASE("every key of every table is in the schema and in the reference, with its help") {
  const JsonValue schema = parse(scenario_schema());
  const std::string reference = scenario_reference();
  const auto sections = all_sections();
  const auto& definitions = schema.find("$defs")->as<Object>();
  const auto of_stages = std::count_if(definitions.begin(), definitions.end(),
                                       [](const auto& m) { return m.key.ends_with(" (change)"); });
  CHECK(definitions.size() == sections.size() + static_cast<std::size_t>(of_stages));
  for (const Section* section : sections) {
    CAPTURE(std::string(section->path));
    const auto* definition = schema.find("$defs")->find(section->path);
    REQUIRE(definition);
    std::set<std::string_view> keys;  // some have a row for each of several types
    for (const KeySpec& spec : section->keys) keys.insert(spec.key);
    CHECK(definition->find("properties")->as<Object>().size() == keys.size());
    const auto heading = reference.find("\n## " + std::string(section->path) + "\n");
    REQUIRE(heading != std::string::npos);
    const auto end = std::min(reference.find("\n## ", heading + 1), reference.size());
    const std::string chapter = reference.substr(heading, end - heading);
    for (const KeySpec& spec : section->keys) {
      CAPTURE(std::string(spec.key));
      const auto* property = definition->find("properties")->find(spec.key);
      REQUIRE(property);
      const auto says = [&](const JsonValue& one) {
        const auto* description = one.find("description");
        return description && description->as<std::string>().find(spec.help) == 0;
      };
      const auto* rows = property->find("anyOf");
      CHECK((says(*property) || (rows && std::any_of(rows->as<JsonValue::Array>().begin(),
                                                     rows->as<JsonValue::Array>().end(), says))));
      CHECK(chapter.find("| `" + std::string(spec.key) + "` |") != std::string::npos);
      CHECK_FALSE(spec.help.empty());
    }
  }
}

TEST_CASE("the schema accepts the examples, the example of the reference and published cases") {
  const JsonValue schema = parse(scenario_schema());
  const Validator validator(schema);
  const fs::path source = LAHAR_SOURCE_DIR;
  for (const auto& entry : fs::directory_iterator(source / "examples"))
    if (entry.path().extension() == ".json") {
      CAPTURE(entry.path().string());
      CHECK(validator.check(parse(content(entry.path())), schema) == "");
    }
  CHECK(validator.check(parse(first_code_block(scenario_reference())), schema) == "");
  for (const auto& folder : test::published_cases()) {
    CAPTURE(folder.string());
    const auto written = folder / "mpm.json", run = folder / "case.json";
    CHECK(validator.check(parse(content(fs::exists(written) ? written : run)), schema) == "");
  }
}

TEST_CASE("the schema refuses what the reader refuses") {
  const JsonValue schema = parse(scenario_schema());
  const Validator validator(schema);
  const std::string good = first_code_block(scenario_reference());
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    const auto at = text.find(from);
    REQUIRE(at != std::string::npos);
    text.replace(at, from.size(), to);
    CHECK_THROWS_AS(read_scenario_text(text, "."), InputError);
    return validator.check(parse(text), schema);
  };
  CHECK(with("\"dt\"", "\"dT\"") == "analysis: additional key dT");
  CHECK(with("\"density\": 1000", "\"density\": 0") == "materials: density: too small");
  CHECK(with("\"density\": 1000,", "") == "materials: no density");
  CHECK(with("\"youngs_modulus\": 1e6,", "") == "materials: no youngs_modulus");
  CHECK(with("\"usl\"", "\"ulf\"") == "analysis: mpm_scheme: \"ulf\" is not in the enumeration");
}

TEST_CASE("the schema says what a stage may have") {
  const JsonValue schema = parse(scenario_schema());
  const Validator validator(schema);
  const JsonValue* stage = schema.find("$defs")->find("stages[]");
  REQUIRE(stage);
  const auto says = [&](const std::string& text) { return validator.check(parse(text), *stage); };
  CHECK(says(R"({"name": "a", "analysis": {"dt": null, "scheme_settings": null, "nsteps": 3}})") ==
        "");
  CHECK(says(R"({"name": "a", "analysis": {"damping": {"damping_factor": 0.5}}})") == "");
  CHECK(says(R"({"name": "a", "mesh": {"boundary_conditions": {"walls": null}}})") == "");
  CHECK(says(R"({"name": "a", "remove": [{"pset": "dug"}], "reset": ["strain"]})") == "");
  CHECK(says(R"({"name": "a", "analysis": {"nstep": 3}})") == "analysis: additional key nstep");
  CHECK(says(R"({"name": "a", "mesh": {"structured": null}})") ==
        "mesh: additional key structured");
  CHECK(says(R"({"name": "a", "remove": [{"set": "dug"}]})") == "remove: additional key set");
  CHECK(says(R"({"analysis": {}})") == "no name");
}

TEST_CASE("the example of the reference runs as it stands") {
  const Scenario s = read_scenario_text(first_code_block(scenario_reference()), ".");
  const auto& m = std::get<Model<2>>(s.model);
  CHECK(m.particles.size() == 400);
  CHECK(m.particles.volume[0] == test::within(1e-5, 0.0025));
  CHECK(entries_of<NodeVelocity>(m).size() == 21);
  CHECK(s.warnings.empty());
  CHECK(fs::path(m.output.folder) == fs::path("results/block-on-the-floor"));
}
