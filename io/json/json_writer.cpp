// Values as JSON text, and as words in a message.
#include <fmt/format.h>

#include <cmath>

#include "io/json/json_parser.h"
#include "io/json/json_source.h"

namespace lahar {

JsonValue parse_json_literal(std::string_view text) {
  return parse_json(text, 0).root;
}

std::string json_quoted(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\')
      (out += '\\') += c;
    else if (c == '\n')
      out += "\\n";
    else if (c == '\t')
      out += "\\t";
    else if (static_cast<unsigned char>(c) < 0x20)
      out += fmt::format("\\u{:04x}", static_cast<int>(c));
    else
      out += c;
  }
  return out + '"';
}

namespace {

bool nested(const JsonValue& v) {
  return v.is<JsonValue::Array>() || v.is<JsonValue::Object>();
}

void write(const JsonValue& value, int indent, std::string& out) {
  const auto newline = [&](int extra) {
    if (indent >= 0) out += '\n' + std::string(static_cast<std::size_t>(2 * (indent + extra)), ' ');
  };
  const int inner = indent < 0 ? indent : indent + 1;
  if (value.is<bool>()) out += value.as<bool>() ? "true" : "false";
  if (value.is<JsonValue::Null>()) out += "null";
  if (value.is<std::int64_t>()) out += fmt::format("{}", value.as<std::int64_t>());
  if (value.is<double>()) out += fmt::format("{}", value.as<double>());
  if (value.is<std::string>()) out += json_quoted(value.as<std::string>());
  if (value.is<JsonValue::Array>()) {
    const auto& items = value.as<JsonValue::Array>();
    const bool lines = !items.empty() && nested(items.front());
    out += '[';
    bool first = true;
    for (const auto& item : items) {
      if (!item.valid()) continue;
      if (!first) out += lines && indent >= 0 ? "," : ", ";
      first = false;
      if (lines) newline(1);
      write(item, inner, out);
    }
    if (lines) newline(0);
    out += ']';
  }
  if (value.is<JsonValue::Object>()) {
    out += '{';
    bool first = true;
    for (const auto& m : value.as<JsonValue::Object>()) {
      if (!m.value.valid()) continue;
      if (!first) out += indent >= 0 ? "," : ", ";
      first = false;
      newline(1);
      out += json_quoted(m.key) + ": ";
      write(m.value, inner, out);
    }
    if (!first) newline(0);
    out += '}';
  }
}

}  // namespace

std::string to_json(const JsonValue& value, int indent) {
  std::string out;
  write(value, indent, out);
  return out;
}

std::string describe(const JsonValue& value) {
  if (value.is<std::string>()) return "text " + json_quoted(value.as<std::string>());
  if (value.is_number()) return "number " + to_json(value);
  if (value.is<JsonValue::Object>()) return "an object";
  if (value.is<JsonValue::Array>()) {
    const std::string text = to_json(value, -1);
    return text.size() <= 40 && text.find('{') == std::string::npos ? "array " + text : "an array";
  }
  return to_json(value);
}

}  // namespace lahar
