// Command line overrides: --set analysis.nsteps=10, --set /materials/0/density=1800.
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <variant>

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

using Object = JsonValue::Object;
using Array = JsonValue::Array;

Object::iterator find_member(Object& members, const std::string& key) {
  return std::find_if(members.begin(), members.end(), [&](const auto& m) { return m.key == key; });
}

// The member `step` of an object, added if missing: whether it exists the key tables decide.
JsonValue& member(Object& members, const Step& step, std::uint32_t source) {
  auto it = find_member(members, step.name);
  const auto offset = static_cast<std::uint32_t>(step.offset);
  if (it == members.end()) {
    JsonValue fresh;
    fresh.source = source;
    fresh.offset = offset;
    fresh.data = Object{};
    it = members.insert(members.end(), {step.name, offset, std::move(fresh)});
  }
  return it->value;
}

// The "name" of each entry of a list; empty where it has none.
std::vector<std::string> names_in(const Array& items) {
  std::vector<std::string> names;
  for (const JsonValue& item : items) {
    const JsonValue* name = item.find("name");
    names.push_back(name && name->is<std::string>() ? name->as<std::string>() : "");
  }
  return names;
}

// What is wrong with a step on the way to a value.
struct WrongStep {
  std::string message, hint = {};
};

// The entry of a list that a step means by its position or its name.
std::variant<std::size_t, WrongStep> entry(const Array& items, const std::string& step) {
  std::size_t index = items.size();
  const char* end = step.data() + step.size();
  const auto [rest, ec] = std::from_chars(step.data(), end, index);
  if (ec == std::errc{} && rest == end && index < items.size()) return index;
  std::vector<std::string> names = names_in(items);
  const auto count = std::count(names.begin(), names.end(), step);
  if (!step.empty() && count == 1)
    return static_cast<std::size_t>(std::find(names.begin(), names.end(), step) - names.begin());
  if (!step.empty() && count > 1)
    return WrongStep{fmt::format("{} entries are named '{}'", count, step), "give a position"};
  std::erase(names, "");
  if (names.empty() || (ec == std::errc{} && rest == end))
    return WrongStep{
        fmt::format("'{}' is not a position in this array of {} elements", step, items.size())};
  return WrongStep{fmt::format("no entry is named '{}'", step), suggest(step, names, "there are")};
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

  const std::vector<Step> steps =
      split(argument.substr(slash, equals - slash), slash ? '/' : '.', prefix.size() + slash);
  const bool removes = value.is<JsonValue::Null>() && steps.front().name != "stages";
  JsonValue* node = &root;
  for (const Step& step : steps) {
    const bool last = &step == &steps.back();
    if (node->is<Array>()) {
      auto& items = std::get<Array>(node->data);
      const auto found = entry(items, step.name);
      if (const auto* wrong = std::get_if<WrongStep>(&found))
        return fail(step.offset, wrong->message, wrong->hint);
      if (removes && last)
        return fail(step.offset, "null removes a key, not an entry of a list",
                    "give the whole list without it");
      node = &items[std::get<std::size_t>(found)];
    } else if (node->is<Object>()) {
      auto& members = std::get<Object>(node->data);
      const auto at = find_member(members, step.name);
      if (removes && at == members.end())
        return fail(step.offset, fmt::format("there is no '{}' to remove", step.name));
      if (removes && last) {
        if (at->value.source == 0) texts_[source].replaced = at->value.offset;
        members.erase(at);
        return;
      }
      node = &member(members, step, source);
    } else {
      return fail(step.offset, fmt::format("there is no '{}' in {}", step.name, describe(*node)));
    }
  }
  if (node->source == 0) texts_[source].replaced = node->offset;
  *node = std::move(value);
}

}  // namespace lahar
