#include "io/json/json_source.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

#include "io/json/json_parser.h"

namespace lahar {

double JsonValue::number() const {
  return is<std::int64_t>() ? static_cast<double>(as<std::int64_t>()) : as<double>();
}

const JsonValue* JsonValue::find(std::string_view key) const {
  if (!is<Object>()) return nullptr;
  for (const Member& m : as<Object>())
    if (m.key == key) return m.value.valid() ? &m.value : nullptr;
  return nullptr;
}

JsonValue* JsonValue::find(std::string_view key) {
  return const_cast<JsonValue*>(std::as_const(*this).find(key));
}

JsonDocument::JsonDocument(std::string file, std::string text, ProblemList& problems, bool printed)
    : printed_(printed) {
  add_text(std::move(file), std::move(text));
  root = parse(0, problems);
}

void JsonDocument::add_text(std::string file, std::string text) {
  Text entry{std::move(file), std::move(text), {0}};
  for (std::size_t i = 0; i < entry.text.size(); ++i)
    if (entry.text[i] == '\n') entry.lines.push_back(i + 1);
  texts_.push_back(std::move(entry));
}

JsonValue JsonDocument::parse(std::uint32_t source, ProblemList& problems) {
  const std::string& text = texts_[source].text;
  if (std::all_of(text.begin(), text.end(), [](unsigned char c) { return std::isspace(c); })) {
    Problem p;
    p.file = texts_[source].file;
    p.message = "the file is empty";
    problems.error(std::move(p));
    return {};
  }
  if (text.size() > std::numeric_limits<std::uint32_t>::max()) {
    problems.error(at_offset(source, 0, "a JSON file must be smaller than 4 GiB"));
    return {};
  }
  JsonParse result = parse_json(text, source);
  for (const auto& d : result.duplicates)
    problems.error(
        at_offset(source, d.offset,
                  fmt::format("'{}' occurs twice in the same object; the first is on line {}",
                              d.key, at_offset(source, d.first, "").line)));
  if (!result.error.empty()) {
    problems.error(at_offset(source, result.error_offset, result.error, result.hint));
    return {};
  }
  return std::move(result.root);
}

Problem JsonDocument::at_offset(std::uint32_t source, std::size_t offset, std::string message,
                                std::string hint) const {
  const Text& text = texts_[source];
  Problem p;
  p.file = text.file;
  p.message = std::move(message);
  p.hint = std::move(hint);
  const auto next = std::upper_bound(text.lines.begin(), text.lines.end(), offset);
  const std::size_t begin = *(next - 1);
  std::size_t end = text.text.find('\n', begin);
  if (end == std::string::npos) end = text.text.size();
  if (end > begin && text.text[end - 1] == '\r') --end;
  p.source = text.text.substr(begin, end - begin);
  p.column = static_cast<int>(offset - begin) + 1;
  if (source == 0 && !printed_) p.line = static_cast<int>(next - text.lines.begin());
  return p;
}

Problem JsonDocument::at(const JsonValue& value, std::string message, std::string hint) const {
  Problem p = at_offset(value.source, value.offset, std::move(message), std::move(hint));
  p.where = pointer(value);
  explain_overrides(value, p);
  return p;
}

Problem JsonDocument::at_key(const JsonValue& object, const JsonValue::Member& member,
                             std::string message, std::string hint) const {
  Problem p = at_offset(member.value.source, member.offset, std::move(message), std::move(hint));
  p.where = pointer(object) + "/" + member.key;
  explain_overrides(member.value, p);
  return p;
}

std::string JsonDocument::line(const JsonValue& value) const {
  if (printed_ && value.source == 0) return "at " + pointer(value);
  const int line = at_offset(value.source, value.offset, "").line;
  return line > 0 ? fmt::format("on line {}", line) : "on the command line";
}

namespace {

// Depth-first search by address: slow, but only messages need it, and no value has to carry it.
bool find_pointer(const JsonValue& tree, const JsonValue& wanted, std::string& pointer) {
  if (&tree == &wanted) return true;
  const std::size_t length = pointer.size();
  if (tree.is<JsonValue::Object>())
    for (const auto& m : tree.as<JsonValue::Object>()) {
      pointer += "/" + m.key;
      if (find_pointer(m.value, wanted, pointer)) return true;
      pointer.resize(length);
    }
  if (tree.is<JsonValue::Array>()) {
    const auto& items = tree.as<JsonValue::Array>();
    // An element of this very array needs no descent.
    if (!items.empty() && &wanted >= items.data() && &wanted < items.data() + items.size()) {
      pointer += fmt::format("/{}", &wanted - items.data());
      return true;
    }
    for (std::size_t i = 0; i < items.size(); ++i) {
      if (!items[i].is<JsonValue::Array>() && !items[i].is<JsonValue::Object>()) continue;
      pointer += fmt::format("/{}", i);
      if (find_pointer(items[i], wanted, pointer)) return true;
      pointer.resize(length);
    }
  }
  return false;
}

}  // namespace

namespace {

/// Mark the texts that parts of a value come from.
void mark_sources(const JsonValue& value, std::vector<bool>& of) {
  of[value.source] = true;
  if (value.is<JsonValue::Object>())
    for (const auto& m : value.as<JsonValue::Object>()) mark_sources(m.value, of);
  if (value.is<JsonValue::Array>())
    for (const auto& item : value.as<JsonValue::Array>()) mark_sources(item, of);
}

/// "--set KEY=VALUE"; a long value is left out.
std::string shown_override(const std::string& text) {
  constexpr std::size_t longest = 100;
  return text.size() <= longest ? text : text.substr(0, text.find('=')) + "=...";
}

}  // namespace

// The line that is shown may have values that count no more.
void JsonDocument::explain_overrides(const JsonValue& value, Problem& problem) const {
  if (texts_.size() == 1 || &value == &root) return;
  std::vector<bool> in_effect(texts_.size(), false);
  mark_sources(value, in_effect);
  const auto& lines = texts_.front().lines;
  const auto line_of = [&](std::size_t offset) {
    return std::upper_bound(lines.begin(), lines.end(), offset);
  };
  std::vector<std::string> overrides;
  for (std::size_t k = 1; k < texts_.size(); ++k) {
    if (k == value.source) continue;
    const std::size_t replaced = texts_[k].replaced;
    const bool on_line = value.source == 0 && replaced != std::string::npos &&
                         line_of(replaced) == line_of(value.offset);
    if (in_effect[k] || on_line) overrides.push_back(shown_override(texts_[k].text));
  }
  if (overrides.empty()) return;
  if (!problem.hint.empty()) problem.hint += "; ";
  problem.hint += fmt::format("{} {} what is written here", join(overrides, " and "),
                              overrides.size() > 1 ? "change" : "changes");
}

std::string JsonDocument::pointer(const JsonValue& value) const {
  std::string out;
  return find_pointer(root, value, out) ? out : "";
}

}  // namespace lahar
