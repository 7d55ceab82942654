#include "io/json/json_parser.h"

#include <fmt/format.h>

#include <algorithm>
#include <deque>
#include <iterator>
#include <nlohmann/json.hpp>

namespace lahar {

namespace {

bool contains(std::string_view text, std::string_view part) {
  return text.find(part) != std::string_view::npos;
}

// An iterator over the text that lets others see how far the lexer has read.
class Cursor {
 public:
  using iterator_category = std::input_iterator_tag;
  using value_type = char;
  using difference_type = std::ptrdiff_t;
  using pointer = const char*;
  using reference = const char&;

  Cursor(const char* at, const char** read) : at_(at), read_(read) {}
  reference operator*() const { return *at_; }
  Cursor& operator++() {
    *read_ = ++at_;
    return *this;
  }
  Cursor operator++(int) {
    Cursor old = *this;
    ++*this;
    return old;
  }
  bool operator==(const Cursor& other) const { return at_ == other.at_; }
  bool operator!=(const Cursor& other) const { return at_ != other.at_; }

 private:
  const char* at_;
  const char** read_;
};

// Builds the tree from the library's events. The lexer has just read the token that an event is
// about (a number and one character more), so its start is found backwards from there.
class TreeBuilder {
 public:
  TreeBuilder(std::string_view text, const char* const* read, std::uint32_t source,
              JsonParse& result)
      : text_(text), read_(read), source_(source), result_(result) {}

  bool null() { return scalar(JsonValue::Null{}, before(4)); }
  bool boolean(bool value) { return scalar(value, before(value ? 4 : 5)); }
  bool number_integer(std::int64_t value) { return scalar(value, number_start()); }
  bool number_unsigned(std::uint64_t value) {
    if (value > static_cast<std::uint64_t>(INT64_MAX))
      return scalar(static_cast<double>(value), number_start());
    return scalar(static_cast<std::int64_t>(value), number_start());
  }
  bool number_float(double value, const std::string&) { return scalar(value, number_start()); }
  bool string(std::string& value) { return scalar(std::move(value), string_start()); }
  bool binary(std::vector<std::uint8_t>&) { return false; }

  bool start_object(std::size_t) { return open(JsonValue::Object{}); }
  bool start_array(std::size_t) { return open(JsonValue::Array{}); }
  bool end_object() { return close(); }
  bool end_array() { return close(); }

  bool key(std::string& name) {
    auto& members = std::get<JsonValue::Object>(stack_.back()->data);
    const std::size_t offset = string_start();
    const auto first =
        std::find_if(members.begin(), members.end(), [&](const auto& m) { return m.key == name; });
    if (first != members.end()) {
      result_.duplicates.push_back({name, offset, first->offset});
      skip_.push_back({});
      duplicate_ = true;
      return true;
    }
    members.push_back({std::move(name), static_cast<std::uint32_t>(offset), {}});
    return true;
  }

  bool parse_error(std::size_t position, const std::string&,
                   const nlohmann::json::exception& error) {
    explain(position, error.what());
    return false;
  }

 private:
  // No scenario needs more; recursion over the tree must not exhaust the stack.
  static constexpr std::size_t deepest = 100;

  std::size_t end() const { return static_cast<std::size_t>(*read_ - text_.data()); }
  std::size_t before(std::size_t length) const { return end() - length; }

  // A number that ends at or just before the last character read.
  std::size_t number_start() const {
    const auto digit = [](char c) { return contains("0123456789+-.eE", {&c, 1}); };
    std::size_t i = end();
    if (i > 0 && !digit(text_[i - 1])) --i;
    while (i > 0 && digit(text_[i - 1])) --i;
    return i;
  }

  std::size_t string_start() const { return opening_quote(end() - 1); }

  // The quote that opens the text before `closing`.
  std::size_t opening_quote(std::size_t i) const {
    while (i > 0) {
      --i;
      if (text_[i] != '"') continue;
      std::size_t slashes = 0;
      while (slashes < i && text_[i - 1 - slashes] == '\\') ++slashes;
      if (slashes % 2 == 0) break;
    }
    return i;
  }

  // Where the next value goes: the root, the last key of the object, the end of the array.
  JsonValue& slot() {
    if (duplicate_) {
      duplicate_ = false;
      return skip_.back();
    }
    if (stack_.empty()) return result_.root;
    JsonValue& parent = *stack_.back();
    if (parent.is<JsonValue::Object>())
      return std::get<JsonValue::Object>(parent.data).back().value;
    return std::get<JsonValue::Array>(parent.data).emplace_back();
  }

  template <class T>
  JsonValue& put(T&& data, std::size_t offset) {
    JsonValue& value = slot();
    value.data = std::forward<T>(data);
    value.source = source_;
    value.offset = static_cast<std::uint32_t>(offset);
    return value;
  }
  template <class T>
  bool scalar(T&& data, std::size_t offset) {
    put(std::forward<T>(data), offset);
    return true;
  }
  template <class T>
  bool open(T&& data) {
    if (stack_.size() == deepest) {
      result_.error =
          fmt::format("arrays and objects are nested more than {} levels deep", deepest);
      result_.error_offset = before(1);
      return false;
    }
    stack_.push_back(&put(std::forward<T>(data), before(1)));
    return true;
  }
  bool close() {
    stack_.pop_back();
    return true;
  }

  // "[json.exception.parse_error.101] parse error at line 1, column 2: syntax error while parsing
  //  value - invalid literal; last read: 'N'; expected ..." without the position and what was read.
  void explain(std::size_t position, std::string what) {
    const auto column = what.find("column ");
    const auto begin = column != std::string::npos ? what.find(": ", column) : what.find("] ");
    what = what.substr(std::min(begin + 2, what.size()));
    if (const auto read = what.find("; last read: "); read != std::string::npos) {
      const auto next = what.find("'; expected", read);
      what = what.substr(0, read) + (next == std::string::npos ? "" : what.substr(next + 1));
    }
    result_.error = what;
    result_.error_offset = offender(position, what);
    const auto before_it = text_.substr(0, result_.error_offset).find_last_not_of(" \t\r\n");
    const char bracket = result_.error_offset < text_.size() ? text_[result_.error_offset] : ' ';
    if (contains(what, "unexpected end of input"))
      result_.hint = "the text ends too early: a '}', ']' or '\"' is missing";
    else if ((bracket == '}' || bracket == ']') && before_it != std::string_view::npos &&
             text_[before_it] == ',')
      result_.hint = fmt::format("remove the comma before this '{}'", bracket);
    else if (contains(what, "parsing object key - invalid literal") && !word_at_error().empty())
      result_.hint = fmt::format("names of keys are in double quotes: \"{}\"", word_at_error());
    else if (contains(what, "unexpected string literal; expected '"))
      result_.hint = "a comma is missing before it";
  }

  // The letters, digits and underscores from there on.
  std::string_view word_at_error() const {
    std::size_t end = result_.error_offset;
    while (end < text_.size() &&
           (std::isalnum(static_cast<unsigned char>(text_[end])) || text_[end] == '_'))
      ++end;
    return text_.substr(result_.error_offset, end - result_.error_offset);
  }

  // Where the token begins that the parser stumbled over, `position` characters having been read.
  std::size_t offender(std::size_t position, std::string_view what) const {
    std::size_t at = std::min(position > 0 ? position - 1 : 0, text_.size() - 1);
    if (contains(what, "unexpected end of input")) return text_.find_last_not_of(" \t\r\n");
    if (contains(what, "number")) return number_start();
    if (contains(what, "unexpected string") || contains(what, "missing closing quote") ||
        contains(what, "must be escaped"))
      return opening_quote(at);
    const auto word = [&](std::size_t i) {
      return std::isalnum(static_cast<unsigned char>(text_[i])) || text_[i] == '_';
    };
    while (contains(what, "literal") && at > 0 && word(at) && word(at - 1)) --at;
    return at;
  }

  std::string_view text_;
  const char* const* read_;
  std::uint32_t source_;
  JsonParse& result_;
  std::vector<JsonValue*> stack_;
  std::deque<JsonValue> skip_;  // values of duplicate keys; a deque keeps their addresses
  bool duplicate_ = false;
};

}  // namespace

JsonParse parse_json(std::string_view text, std::uint32_t source) {
  JsonParse result;
  const char* read = text.data();
  TreeBuilder builder(text, &read, source, result);
  const Cursor begin(text.data(), &read), end(text.data() + text.size(), &read);
  const bool ok = nlohmann::json::sax_parse(begin, end, &builder,
                                            nlohmann::json::input_format_t::json, true, true);
  if (!ok) result.root = {};
  return result;
}

void shift(JsonValue& value, std::uint32_t by) {
  value.offset += by;
  if (value.is<JsonValue::Array>())
    for (auto& item : std::get<JsonValue::Array>(value.data)) shift(item, by);
  if (value.is<JsonValue::Object>())
    for (auto& m : std::get<JsonValue::Object>(value.data)) {
      m.offset += by;
      shift(m.value, by);
    }
}

}  // namespace lahar
