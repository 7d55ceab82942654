#include "io/geometry/ascii_grid.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <fstream>
#include <limits>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>

#include "io/base/text.h"
#include "physics/base/error.h"

namespace lahar {

namespace {

constexpr std::size_t piece = std::size_t{1} << 20;  ///< that is read at once [bytes]
constexpr std::size_t longest_word = 64;             ///< no number of a grid is longer

constexpr std::array<std::string_view, 10> keys = {
    "ncols",     "nrows", "xllcorner", "yllcorner", "xllcenter",
    "yllcenter", "dx",    "dy",        "cellsize",  "nodata_value"};

bool is_space(char c) {
  return c == ' ' || c == '\t' || c == '\n' || c == '\r' || c == '\v' || c == '\f';
}

bool is_digit(char c) {
  return '0' <= c && c <= '9';
}

std::string lower(std::string_view text) {
  std::string out(text);
  std::transform(out.begin(), out.end(), out.begin(), [](char c) {
    return 'A' <= c && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  });
  return out;
}

/// Words that programs write where a value is not known.
bool is_unknown(std::string_view word) {
  const std::string text = lower(word.substr(word[0] == '-' || word[0] == '+' ? 1 : 0));
  constexpr std::array<std::string_view, 5> words = {"nan", "inf", "1.#qnan", "1.#ind", "1.#inf"};
  return std::find(words.begin(), words.end(), text) != words.end();
}

/// Whether GDAL reads all of a word as a number; both decimal separators are known to it.
bool is_number(std::string_view word) {
  const char *at = word.data(), *const end = at + word.size();
  const auto digits = [&] {
    const char* const begin = at;
    while (at != end && is_digit(*at)) ++at;
    return at - begin;
  };
  if (at != end && (*at == '-' || *at == '+')) ++at;
  auto all = digits();
  if (at != end && (*at == '.' || *at == ',')) {
    ++at;
    all += digits();
  }
  if (all > 0 && at != end && (*at == 'e' || *at == 'E')) {
    ++at;
    if (at != end && (*at == '-' || *at == '+')) ++at;
    all = digits();
  }
  return word.size() <= longest_word && ((all > 0 && at == end) || is_unknown(word));
}

/// Words between spaces, in pieces.
class Words {
 public:
  explicit Words(const MapFile& file) : in_(file.path, std::ios::binary), text_(piece, '\0') {}

  /// The next word; nothing at the end. It is valid until the next call. A word is cut off after
  /// longest_word + 1 characters.
  std::optional<std::string_view> next() {
    word_.clear();
    while (at_ != size_ || fill()) {
      const char c = text_[at_];
      if (is_space(c) && !word_.empty()) break;
      ++at_;
      line_ += c == '\n';
      if (!is_space(c) && word_.size() <= longest_word) word_ += c;
    }
    if (word_.empty()) return std::nullopt;
    return word_;
  }
  Index line() const { return line_; }  ///< of the word

 private:
  bool fill() {
    in_.read(text_.data(), static_cast<std::streamsize>(text_.size()));
    size_ = static_cast<std::size_t>(in_.gcount());
    at_ = 0;
    return size_ > 0;
  }
  std::ifstream in_;
  std::string text_, word_;
  std::size_t at_ = 0, size_ = 0;
  Index line_ = 1;
};

[[noreturn]] void fail(std::string message, std::string hint) {
  throw InputError({Problem{.message = std::move(message), .hint = std::move(hint)}});
}

[[noreturn]] void refuse_word(const MapFile& file, const Words& words, std::string_view word) {
  fail(
      fmt::format("line {} of '{}' has '{}', which is not a number", words.line(), file.name, word),
      "values of a grid are numbers with spaces between; cells without data have its NODATA_value");
}

Index count_of(const MapFile& file, const Words& words, std::string_view word) {
  Index count = 0;
  constexpr Index most = std::numeric_limits<int>::max();  // GDAL reads no more
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), count);
  if (error != std::errc() || end != word.data() + word.size() || count < 1 || count > most)
    fail(fmt::format("line {} of '{}' has '{}' in place of a number of cells", words.line(),
                     file.name, word),
         fmt::format("ncols and nrows are whole numbers from 1 to {}", most));
  return count;
}

}  // namespace

void check_ascii_grid(const MapFile& file) {
  Words words(file);
  std::array<Index, 2> counts{};  // columns and rows
  std::array<bool, keys.size()> given{};
  auto word = words.next();
  for (bool first = true; word; word = words.next(), first = false) {
    const auto key = std::find(keys.begin(), keys.end(), lower(*word));
    if (key == keys.end()) {
      if (first) return;  // of another format
      break;
    }
    const auto value = words.next();
    if (!value) break;
    const auto which = static_cast<std::size_t>(key - keys.begin());
    if (std::exchange(given[which], true))
      fail(fmt::format("line {} of '{}' has a second '{}'", words.line(), file.name, *key),
           "a grid has one head");
    if (which < 2)
      counts[which] = count_of(file, words, *value);
    else if (!is_number(*value) || (*key != "nodata_value" && is_unknown(*value)))
      refuse_word(file, words, *value);
  }
  if (counts[0] == 0 || counts[1] == 0) return;  // GDAL says what is missing
  const double wanted = static_cast<double>(counts[0]) * static_cast<double>(counts[1]);
  Index found = 0;
  for (; word; word = words.next(), ++found) {
    if (!is_number(*word)) refuse_word(file, words, *word);
    if (static_cast<double>(found) >= wanted)
      fail(fmt::format("'{}' has more values than its {} columns and {} rows take, from line {} on",
                       file.name, format_count(counts[0]), format_count(counts[1]), words.line()),
           "do ncols and nrows belong to these values?");
  }
  if (static_cast<double>(found) < wanted)
    fail(fmt::format("'{}' ends after {} values; its {} columns and {} rows take {}", file.name,
                     format_count(found), format_count(counts[0]), format_count(counts[1]),
                     format_count(static_cast<Index>(wanted))),
         "is the file whole?");
}

}  // namespace lahar
