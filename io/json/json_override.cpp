// Command line overrides: --set analysis.nsteps=10, --set /materials/0/density=1800.
#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "io/json/json_parser.h"
#include "io/json/json_source.h"

namespace lahar {

namespace {

constexpr std::string_view prefix = "--set ";

struct Step {
  std::string name;
  std::size_t offset;  // in the text "--set ..."
};

// The key names between the separators, with their position.
std::vector<Step> split(const std::string& path, char separator, std::size_t offset) {
  std::vector<Step> steps;
  for (std::size_t begin = 0; begin <= path.size();) {
    const std::size_t end = std::min(path.find(separator, begin), path.size());
    steps.push_back({path.substr(begin, end - begin), offset + begin});
    begin = end + 1;
  }
  return steps;
}

// The member `step` of an object, added if missing: whether it exists the key tables decide.
JsonValue& member(JsonValue::Object& members, const Step& step, std::uint32_t source) {
  auto it = std::find_if(members.begin(), members.end(),
                         [&](const auto& m) { return m.key == step.name; });
  const auto offset = static_cast<std::uint32_t>(step.offset);
  if (it == members.end()) {
    JsonValue fresh;
    fresh.source = source;
    fresh.offset = offset;
    fresh.data = JsonValue::Object{};
    it = members.insert(members.end(), {step.name, offset, std::move(fresh)});
  }
  return it->value;
}

}  // namespace

void JsonDocument::override_value(const std::string& argument, ProblemList& problems) {
  const auto source = static_cast<std::uint32_t>(texts_.size());
  add_text("", std::string(prefix) + argument);
  const auto fail = [&](std::size_t offset, std::string message, std::string hint = "") {
    problems.error(at_offset(source, offset, std::move(message), std::move(hint)));
  };
  const std::size_t equals = argument.find('=');
  if (equals == std::string::npos || equals == 0)
    return fail(prefix.size(), fmt::format("'{}' is not of the form key=value", argument),
                "for example --set analysis.nsteps=10 or --set /materials/0/density=1800");
  const std::size_t slash = argument[0] == '/' ? 1 : 0;
  JsonParse parsed = parse_json(argument.substr(equals + 1), source);
  JsonValue value = std::move(parsed.root);
  if (!parsed.error.empty()) value.data = argument.substr(equals + 1);
  value.source = source;
  shift(value, static_cast<std::uint32_t>(prefix.size() + equals + 1));

  JsonValue* node = &root;
  for (const Step& step :
       split(argument.substr(slash, equals - slash), slash ? '/' : '.', prefix.size() + slash)) {
    if (node->is<JsonValue::Array>()) {
      auto& items = std::get<JsonValue::Array>(node->data);
      std::size_t index = items.size();
      const char* end = step.name.data() + step.name.size();
      const auto [rest, ec] = std::from_chars(step.name.data(), end, index);
      if (ec != std::errc{} || rest != end || index >= items.size())
        return fail(step.offset, fmt::format("'{}' is no position in an array of {} elements",
                                             step.name, items.size()));
      node = &items[index];
    } else if (node->is<JsonValue::Object>()) {
      node = &member(std::get<JsonValue::Object>(node->data), step, source);
    } else {
      return fail(step.offset, fmt::format("there is no '{}' in {}", step.name, describe(*node)));
    }
  }
  *node = std::move(value);
}

}  // namespace lahar
