/// \file JSON text (with // and /* */ comments) as a tree in which every value knows its position.
#pragma once

#include <cstdint>
#include <deque>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "io/base/problems.h"

namespace lahar {

/// One JSON value. `invalid` marks a value that has been reported and is to be left alone.
struct JsonValue {
  struct Invalid {};
  struct Null {};
  struct Member;
  using Array = std::vector<JsonValue>;
  using Object = std::vector<Member>;

  std::variant<Invalid, Null, bool, std::int64_t, double, std::string, Array, Object> data;
  std::uint32_t source = 0;  ///< which text of the document
  std::uint32_t offset = 0;  ///< first byte of the value in that text
  bool defaulted = false;    ///< filled in, not written by the user

  template <class T>
  bool is() const {
    return std::holds_alternative<T>(data);
  }
  template <class T>
  const T& as() const {
    return std::get<T>(data);
  }
  bool valid() const { return !is<Invalid>(); }
  bool is_number() const { return is<std::int64_t>() || is<double>(); }
  double number() const;  ///< integer or floating point
  void invalidate();

  /// The valid value under `key` of an object; null if there is none (or this is no object).
  const JsonValue* find(std::string_view key) const;
  JsonValue* find(std::string_view key);
};

/// `"key": value` of an object.
struct JsonValue::Member {
  std::string key;
  std::uint32_t offset = 0;  ///< of the key's opening quote
  JsonValue value;
};

inline void JsonValue::invalidate() {
  data = Invalid{};
}

/// A JSON file with its `--set` overrides. Values keep the position of the text that they come
/// from.
class JsonDocument {
 public:
  /// Parse `text`. Syntax errors and duplicate keys go to `problems`; the root is then invalid
  /// (syntax) or has the first of the duplicates.
  /// `printed` says that a program wrote the text. Its lines are then unknown to the user, and
  /// problems do not name them.
  JsonDocument(std::string file, std::string text, ProblemList& problems, bool printed = false);

  JsonValue root;

  /// Apply "/a/0/b=value" or "a.0.b=value"; the value is parsed as JSON, else taken as text. An
  /// entry of a list may be named by its "name". Null removes a key; in a stage it stays, because
  /// there it removes the key of the scenario.
  void override_value(const std::string& argument, ProblemList& problems);

  /// A problem at a value (a key, a byte) of this document.
  Problem at(const JsonValue& value, std::string message, std::string hint = "") const;
  Problem at_key(const JsonValue& object, const JsonValue::Member& member, std::string message,
                 std::string hint = "") const;
  Problem at_offset(std::uint32_t source, std::size_t offset, std::string message,
                    std::string hint = "") const;

  /// JSON pointer of a value inside the tree; empty for the root.
  std::string pointer(const JsonValue& value) const;
  /// Where a value is: "on line 3", or "on the command line"; of a printed text "at /materials/0".
  std::string line(const JsonValue& value) const;

 private:
  struct Text {
    std::string file;
    std::string text;
    std::vector<std::size_t> lines;  ///< offset of the first byte of each line
    /// Where the first text has what this one, an override, has replaced there.
    std::size_t replaced = std::string::npos;
  };
  std::deque<Text> texts_;
  bool printed_;
  void explain_overrides(const JsonValue& value, Problem& problem) const;
  JsonValue parse(std::uint32_t source, ProblemList& problems);
  void add_text(std::string file, std::string text);
};

/// Parse JSON that we wrote ourselves (defaults of the key tables).
JsonValue parse_json_literal(std::string_view text);

/// Text of a value: indented over several lines, or on one line where indent < 0. Invalid values
/// are left out; numbers are the shortest text that reads back to the same double.
std::string to_json(const JsonValue& value, int indent = 0);

/// `text` in JSON's quotes.
std::string json_quoted(std::string_view text);

/// How a message names what was found: `text "abc"`, `number 3`, `an array`, `an object`, `true`.
std::string describe(const JsonValue& value);

}  // namespace lahar
