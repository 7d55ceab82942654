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

JsonDocument::JsonDocument(std::string file, std::string text, ProblemList& problems) {
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
  if (source == 0) p.line = static_cast<int>(next - text.lines.begin());
  return p;
}

Problem JsonDocument::at(const JsonValue& value, std::string message, std::string hint) const {
  Problem p = at_offset(value.source, value.offset, std::move(message), std::move(hint));
  p.where = pointer(value);
  return p;
}

Problem JsonDocument::at_key(const JsonValue& object, const JsonValue::Member& member,
                             std::string message, std::string hint) const {
  Problem p = at_offset(member.value.source, member.offset, std::move(message), std::move(hint));
  p.where = pointer(object) + "/" + member.key;
  return p;
}

std::string JsonDocument::line(const JsonValue& value) const {
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

std::string JsonDocument::pointer(const JsonValue& value) const {
  std::string out;
  return find_pointer(root, value, out) ? out : "";
}

}  // namespace lahar
