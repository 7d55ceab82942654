#include "io/mesh/vtu_arrays.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <charconv>
#include <cstdint>

namespace lahar {

void fail_vtu(const SideFile& file, std::string message, std::string hint) {
  throw InputError(
      {Problem{.file = file.name, .message = std::move(message), .hint = std::move(hint)}});
}

namespace {

/// The bytes of an array, raw or in base 64.
class ArrayBytes {
 public:
  ArrayBytes(const SideFile& file, const VtuArray& array, Index begin, bool base64)
      : file_(file), name_(array.name), in_(file, begin), base64_(base64) {}

  void get(void* to, std::size_t n) {
    auto* out = static_cast<unsigned char*>(to);
    if (!base64_) {
      if (!in_.bytes(out, n)) cut_short();
      return;
    }
    while (n > 0) {
      if (at_ == have_) next_group();
      *out++ = group_[at_++];
      --n;
    }
  }
  /// What comes next begins a group of base 64 of its own.
  void end_block() { at_ = have_ = 0; }

 private:
  [[noreturn]] void cut_short() const {
    fail_vtu(file_, fmt::format("the array '{}' is cut short", name_));
  }
  void next_group() {
    std::uint32_t bits = 0;
    int digits = 0, padding = 0;
    while (digits + padding < 4) {
      char c;
      if (!in_.get(c)) cut_short();
      if (c == ' ' || c == '\n' || c == '\r' || c == '\t') continue;
      const int value = 'A' <= c && c <= 'Z'   ? c - 'A'
                        : 'a' <= c && c <= 'z' ? c - 'a' + 26
                        : '0' <= c && c <= '9' ? c - '0' + 52
                        : c == '+'             ? 62
                        : c == '/'             ? 63
                                               : -1;
      if (c == '=')
        ++padding;
      else if (c == '<')
        cut_short();
      else if (value < 0 || padding > 0)
        fail_vtu(file_,
                 fmt::format("the array '{}' has a character that is not of base 64", name_));
      else
        ++digits;
      bits = bits << 6 | static_cast<std::uint32_t>(std::max(value, 0));
    }
    if (padding > 2) cut_short();
    for (std::size_t i = 0; i < 3; ++i)
      group_[i] = static_cast<unsigned char>(bits >> (16 - 8 * i) & 0xff);
    at_ = 0;
    have_ = static_cast<std::size_t>(3 - padding);
  }

  const SideFile& file_;
  const std::string& name_;
  BinaryReader in_;
  bool base64_;
  unsigned char group_[3] = {};
  std::size_t at_ = 0, have_ = 0;
};

struct NumberType {
  std::string_view name;
  std::size_t bytes;
};
constexpr std::array<NumberType, 10> types{{{"Int8", 1},
                                            {"UInt8", 1},
                                            {"Int16", 2},
                                            {"UInt16", 2},
                                            {"Int32", 4},
                                            {"UInt32", 4},
                                            {"Int64", 8},
                                            {"UInt64", 8},
                                            {"Float32", 4},
                                            {"Float64", 8}}};

class ArrayReader {
 public:
  ArrayReader(const SideFile& file, const VtuHead& head, const VtuArray& array, Index count)
      : file_(file), head_(head), array_(array), count_(count) {}

  template <class To>
  std::vector<To> read() {
    if (array_.format == "ascii") return read_text<To>();
    const auto type = std::find_if(types.begin(), types.end(),
                                   [&](const NumberType& t) { return t.name == array_.type; });
    if (type == types.end())
      fail_vtu(file_, fmt::format("the array '{}' is of type '{}'", array_.name, array_.type));
    const auto bytes = read_bytes(static_cast<std::size_t>(count_) * type->bytes);
    std::vector<To> out(static_cast<std::size_t>(count_));
    const auto take = [&]<class From>(From value) {
      for (std::size_t i = 0; i < out.size(); ++i) {
        std::memcpy(&value, bytes.data() + i * sizeof value, sizeof value);
        out[i] = static_cast<To>(value);
      }
    };
    switch (type - types.begin()) {
      case 0:
        take(std::int8_t{});
        break;
      case 1:
        take(std::uint8_t{});
        break;
      case 2:
        take(std::int16_t{});
        break;
      case 3:
        take(std::uint16_t{});
        break;
      case 4:
        take(std::int32_t{});
        break;
      case 5:
        take(std::uint32_t{});
        break;
      case 6:
        take(std::int64_t{});
        break;
      case 7:
        take(std::uint64_t{});
        break;
      case 8:
        take(float{});
        break;
      default:
        take(double{});
        break;
    }
    return out;
  }

 private:
  void check_size(Index found, std::string_view what) const {
    if (found != count_)
      fail_vtu(file_, fmt::format("the array '{}' has {} {}, expected {}", array_.name, found, what,
                                  count_));
  }

  template <class To>
  std::vector<To> read_text() const {
    std::string text(static_cast<std::size_t>(array_.end - array_.begin), ' ');
    text.resize(file_.read(array_.begin, text.data(), text.size()));
    std::vector<To> out;
    const char *at = text.data(), *end = at + text.size();
    while (true) {
      while (at < end && (*at == ' ' || *at == '\n' || *at == '\r' || *at == '\t')) ++at;
      if (at == end) break;
      To value;
      const auto [rest, error] = std::from_chars(at + (*at == '+'), end, value);
      if (error != std::errc{})
        fail_vtu(file_, fmt::format("the array '{}' has '{}' in place of a number", array_.name,
                                    std::string(at, std::find(at, end, ' ')).substr(0, 20)));
      out.push_back(value);
      at = rest;
    }
    check_size(static_cast<Index>(out.size()), "numbers");
    return out;
  }

  std::vector<char> read_bytes(std::size_t size) const {
    const bool appended = array_.format == "appended";
    if (appended && head_.appended < 0)
      fail_vtu(file_, "the file ends before its appended data: it is cut short");
    if (!appended && array_.format != "binary")
      fail_vtu(file_, fmt::format("the array '{}' has the format '{}'", array_.name, array_.format),
               "formats are ascii, binary and appended");
    if (appended && array_.offset > file_.size - head_.appended)
      fail_vtu(file_, fmt::format("the array '{}' begins behind the end of the file", array_.name));
    ArrayBytes in(file_, array_, appended ? head_.appended + array_.offset : array_.begin,
                  !appended || head_.appended_base64);
    std::vector<char> bytes;
    if (head_.compressed) return inflate_blocks(in, size);
    const auto said = header(in);
    if (said != size)
      fail_vtu(file_,
               fmt::format("the array '{}' has {} bytes, expected {}", array_.name, said, size));
    if (size > static_cast<std::size_t>(file_.size))
      fail_vtu(file_, fmt::format("the array '{}' is cut short", array_.name));
    bytes.resize(size);
    in.get(bytes.data(), size);
    return bytes;
  }

  std::uint64_t header(ArrayBytes& in) const {
    std::uint64_t wide = 0;
    std::uint32_t narrow = 0;
    if (head_.wide)
      in.get(&wide, sizeof wide);
    else
      in.get(&narrow, sizeof narrow);
    return head_.wide ? wide : narrow;
  }

  /// Blocks of one size, but for the last, each compressed.
  std::vector<char> inflate_blocks(ArrayBytes& in, std::size_t size) const {
    const auto blocks = header(in), block = header(in), last = header(in);
    const auto damaged = [&] {
      fail_vtu(file_,
               fmt::format("the compressed array '{}' is damaged or cut short", array_.name));
    };
    const std::uint64_t full = blocks == 0 ? 0 : blocks - (last > 0 ? 1 : 0);
    // Sums and products of these may be beyond 64 bits.
    const bool fits = blocks == 0 ? size == 0
                                  : last <= size && (full == 0 || block <= (size - last) / full) &&
                                        full * block + last == size;
    const auto bytes_of_file = static_cast<std::uint64_t>(file_.size);
    if (!fits || blocks > bytes_of_file || size > best_compression * bytes_of_file) damaged();
    std::vector<std::uint64_t> packed(blocks);
    for (auto& n : packed) n = header(in);
    in.end_block();
    std::vector<char> bytes(size);
    std::vector<char> from;
    std::size_t at = 0;
    for (std::size_t i = 0; i < packed.size(); ++i) {
      if (packed[i] > bytes_of_file) damaged();
      from.resize(packed[i]);
      in.get(from.data(), from.size());
      const std::size_t expected = i < full ? block : last;
      uLongf got = expected;
      if (::uncompress(reinterpret_cast<Bytef*>(bytes.data() + at), &got,
                       reinterpret_cast<const Bytef*>(from.data()), from.size()) != Z_OK ||
          got != expected)
        damaged();
      at += expected;
    }
    return bytes;
  }

  const SideFile& file_;
  const VtuHead& head_;
  const VtuArray& array_;
  Index count_;
};

}  // namespace

std::vector<double> read_vtu_numbers(const SideFile& file, const VtuHead& head,
                                     const VtuArray& array, Index count) {
  return ArrayReader(file, head, array, count).read<double>();
}

std::vector<Index> read_vtu_integers(const SideFile& file, const VtuHead& head,
                                     const VtuArray& array, Index count) {
  if (!array.integer())
    fail_vtu(file,
             fmt::format("the array '{}' must be of integers, found {}", array.name, array.type));
  return ArrayReader(file, head, array, count).read<Index>();
}

}  // namespace lahar
