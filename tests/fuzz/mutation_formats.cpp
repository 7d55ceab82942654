// Changes of files whose ending says what they are: fields of binary files, words of texts, numbers
// in base 64, JSON.
#include <algorithm>
#include <cctype>
#include <cstring>
#include <limits>

#include "io/base/base64.h"
#include "tests/fuzz/mutation_values.h"

namespace lahar::fuzz {

namespace {

/// Words at which readers of numbers and keys may err.
const std::vector<std::string> words{
    // clang-format off
    "nan", "-nan", "inf", "-inf", "1e308", "-1e308", "1e400", "4e38", "1e-320", "-0", "+1", "0x10", "1,5",
    "99999999999999999999", "4294967295", "4294967296", "-2147483648", "2", "3", "-1", "1e9", "1000000000",
    "UInt64", "Int8", "Float64", "binary", "ascii", "appended", "list", "element", "endsolid", "f", "v", "1/2/3"
    // clang-format on
};

const std::vector<double> reals{0,
                                -0.0,
                                1,
                                -1,
                                0.5,
                                1e-30,
                                1e30,
                                3e38,
                                1e300,
                                -1e308,
                                5e-324,
                                std::numeric_limits<double>::quiet_NaN(),
                                std::numeric_limits<double>::infinity()};

template <class T>
std::string bytes_of(T value) {
  return {reinterpret_cast<const char*>(&value), sizeof value};
}

void put(std::string& text, std::size_t at, const std::string& bytes) {
  if (at < text.size()) text.replace(at, std::min(bytes.size(), text.size() - at), bytes);
}

std::string without(std::string text, std::size_t at, std::size_t n) {
  return at < text.size() ? text.erase(at, n) : text;
}

/// A number of 1 to 8 bytes at any place, in any byte order; heads are changed more often.
std::string mutate_field(std::string text, Random& random) {
  if (text.size() < 8) return text;
  constexpr std::size_t head = 256;
  const std::size_t at =
      below(one_in(2, random) ? std::min(head, text.size()) : text.size(), random);
  std::size_t size = std::size_t{1} << below(4, random);
  std::string bytes;
  switch (below(5, random)) {
    case 0:
      bytes = one_in(2, random) ? bytes_of(any_of(reals, random))
                                : bytes_of(static_cast<float>(any_of(reals, random)));
      size = bytes.size();
      break;
    case 1: {  // a little more or less
      std::uint64_t value = 0;
      std::memcpy(&value, text.data() + at, std::min(size, text.size() - at));
      bytes = bytes_of(one_in(2, random) ? value + 1 + below(4, random) : value - 1);
      break;
    }
    case 2:
      bytes = text.substr(below(text.size(), random), size);
      break;
    case 3:
      bytes = bytes_of(std::uint64_t{random()});
      break;
    default:
      bytes = bytes_of(any_of(integers, random));
  }
  bytes.resize(size);
  if (one_in(4, random)) std::reverse(bytes.begin(), bytes.end());
  put(text, at, bytes);
  return text;
}

/// A part goes, comes twice, or takes another's place; or the end is missing.
std::string mutate_parts(std::string text, std::size_t record, Random& random) {
  if (text.size() <= record) return text;
  const std::size_t n = record * (1 + below(3, random));
  const std::size_t at = below(text.size(), random), from = below(text.size(), random);
  switch (below(4, random)) {
    case 0:
      return without(std::move(text), at, n);
    case 1:
      return text.insert(at, text.substr(from, n));
    case 2:
      put(text, at, text.substr(from, n));
      return text;
    default:
      return text.substr(0, at);
  }
}

/// Triangles of a binary file go, come twice or get wrong numbers; mostly with the right count.
std::string mutate_stl(std::string text, Random& random) {
  constexpr std::size_t head = 84, row = 50;
  if (text.size() < head + row) return mutate_field(std::move(text), random);
  const std::size_t n = (text.size() - head) / row;
  const auto place = [&] { return head + row * below(n, random); };
  switch (below(4, random)) {
    case 0:
      text = without(std::move(text), place(), row);
      break;
    case 1:
      text.insert(place(), text.substr(place(), row));
      break;
    case 2:
      put(text, place() + 4 * below(12, random),
          bytes_of(static_cast<float>(any_of(reals, random))));
      break;
    default:
      put(text, place() + 12 + 12 * below(3, random), text.substr(place() + 12, 12));
  }
  if (!one_in(8, random))
    put(text, head - 4, bytes_of(static_cast<std::uint32_t>((text.size() - head) / row)));
  return text;
}

/// An entry of a directory of a TIFF: its tag, type, count or value.
std::string mutate_tiff(std::string text, Random& random) {
  std::uint32_t at = 0;
  std::uint16_t n = 0;
  if (text.size() < 8) return text;
  std::memcpy(&at, text.data() + 4, sizeof at);
  if (at + 2 > text.size()) return mutate_field(std::move(text), random);
  std::memcpy(&n, text.data() + at, sizeof n);
  const std::size_t entry = at + 2 + 12 * below(n, random);
  if (entry + 12 > text.size()) return mutate_field(std::move(text), random);
  switch (below(5, random)) {
    case 0:
      put(text, entry, bytes_of(static_cast<std::uint16_t>(254 + below(90, random))));
      break;
    case 1:
      put(text, entry + 2, bytes_of(static_cast<std::uint16_t>(below(19, random))));
      break;
    case 2:
      put(text, entry + 4, bytes_of(static_cast<std::uint32_t>(any_of(integers, random))));
      break;
    case 3: {  // what it points to
      std::uint32_t value = 0;
      std::memcpy(&value, text.data() + entry + 8, sizeof value);
      put(text, value + 8 * below(6, random), bytes_of(any_of(reals, random)));
      break;
    }
    default:
      put(text, entry + 8, bytes_of(static_cast<std::uint32_t>(any_of(integers, random))));
  }
  return text;
}

constexpr std::string_view digits =
    "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

std::string from_base64(std::string_view text) {
  std::string bytes;
  for (std::size_t i = 0; i + 4 <= text.size(); i += 4) {
    std::uint32_t bits = 0;
    std::size_t known = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      const auto digit = digits.find(text[i + k]);
      known += digit != digits.npos ? 1 : 0;
      bits = bits << 6 | (digit != digits.npos ? static_cast<std::uint32_t>(digit) : 0U);
    }
    for (std::size_t k = 0; k + 1 < known; ++k)
      bytes += static_cast<char>(bits >> (16 - 8 * k) & 255U);
  }
  return bytes;
}

/// The numbers of an array in base 64. The first ones say how many bytes follow.
std::string mutate_base64(std::string text, Random& random) {
  std::vector<std::pair<std::size_t, std::size_t>> runs;
  const auto is_digit = [&](std::size_t i) {
    return text[i] == '=' || digits.find(text[i]) != digits.npos;
  };
  for (std::size_t i = 0; i < text.size(); ++i) {
    std::size_t end = i;
    while (end < text.size() && is_digit(end)) ++end;
    if (end - i >= 12 && (end - i) % 4 == 0) runs.emplace_back(i, end - i);
    i = end;
  }
  if (runs.empty()) return mutate_field(std::move(text), random);
  const auto [at, n] = any_of(runs, random);
  const std::string bytes = from_base64(std::string_view(text).substr(at, n));
  return text.replace(
      at, n,
      base64(one_in(4, random) ? mutate_parts(bytes, 8, random) : mutate_field(bytes, random)));
}

/// A word between blanks, quotes, commas or brackets becomes another.
std::string mutate_word(std::string text, Random& random) {
  if (text.empty()) return text;
  std::size_t begin = below(text.size(), random), end = begin;
  const auto in_word = [&](std::size_t i) {
    return std::isspace(static_cast<unsigned char>(text[i])) == 0 &&
           std::string_view("\"'<>=,/[]{}").find(text[i]) == std::string_view::npos;
  };
  while (begin > 0 && in_word(begin - 1)) --begin;
  while (end < text.size() && in_word(end)) ++end;
  const std::string word = one_in(3, random) ? std::to_string(any_of(integers, random))
                           : one_in(3, random)
                               ? text.substr(below(text.size(), random), end - begin)
                               : any_of(words, random);
  return text.replace(begin, end - begin, word);
}

bool is_binary(const std::string& text) {
  return text.find('\0') != text.npos;
}

}  // namespace

std::string Mutator::mutate_formats(const std::string& input, const std::string& other,
                                    Random& random) const {
  std::vector<BundledFile> files = unbundle(input);
  const std::vector<BundledFile> lent = unbundle(other);
  if (files.size() < 2 || lent.size() < 2) return mutate_bytes(input, random);
  BundledFile& file = files[1 + (one_in(3, random) ? below(files.size() - 1, random) : 0)];
  const auto dot = file.name.rfind('.');
  const std::string ending = dot == file.name.npos ? "" : file.name.substr(dot + 1);
  if (one_in(100, random))
    file.name = lent[1].name;
  else
    file.text = mutate_file(ending, std::move(file.text), lent[1].text, random);
  return bundle(files);
}

std::string Mutator::mutate_file(const std::string& ending, std::string text,
                                 const std::string& other, Random& random) const {
  if (one_in(16, random)) return mutate_bytes(std::move(text), random);
  if (ending == "geojson" && !one_in(4, random)) return mutate_json(text, other, random);
  if (one_in(12, random)) return mutate_parts(std::move(text), 1 + below(64, random), random);
  if (ending == "vtu" && one_in(2, random)) return mutate_base64(std::move(text), random);
  if (ending == "tif" && one_in(2, random)) return mutate_tiff(std::move(text), random);
  const bool binary = is_binary(text);
  if (ending == "stl" && binary && !one_in(4, random)) return mutate_stl(std::move(text), random);
  if (binary && !one_in(3, random)) return mutate_field(std::move(text), random);
  return one_in(3, random) ? mutate_text(std::move(text), random)
                           : mutate_word(std::move(text), random);
}

}  // namespace lahar::fuzz
