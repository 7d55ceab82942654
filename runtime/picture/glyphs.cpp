#include "runtime/picture/glyphs.h"

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <iterator>

namespace lahar {

namespace {

constexpr double units_per_size = 2048;
constexpr int curve_pieces = 6;

struct Glyph {
  std::uint32_t code;
  int advance;
  const char* outline;  ///< commands of SVG paths: M L H V Q Z, absolute
};

constexpr Glyph glyphs[] = {
#include "runtime/picture/glyphs.inc"
};
constexpr Glyph missing{0, 1229, "M102 -362V1444H1126V-362ZM217 -248H1012V1329H217Z"};

const Glyph& glyph_of(std::uint32_t code) {
  const auto* found = std::lower_bound(std::begin(glyphs), std::end(glyphs), code,
                                       [](const Glyph& g, std::uint32_t c) { return g.code < c; });
  return found != std::end(glyphs) && found->code == code ? *found : missing;
}

/// Characters of UTF-8 that is valid; other bytes stand for themselves.
std::vector<std::uint32_t> characters(std::string_view words) {
  std::vector<std::uint32_t> codes;
  for (const char c : words) {
    const auto byte = static_cast<unsigned char>(c);
    if ((byte & 0xC0u) == 0x80u && !codes.empty())
      codes.back() = codes.back() << 6 | (byte & 0x3Fu);
    else if (byte < 0x80u)
      codes.push_back(byte);
    else
      codes.push_back(byte & (byte < 0xE0u ? 0x1Fu : byte < 0xF0u ? 0x0Fu : 0x07u));
  }
  return codes;
}

class OutlineReader {
 public:
  OutlineReader(const char* at, double left, double scale) : at_(at), left_(left), scale_(scale) {}

  std::vector<Drawing::Points> read() {
    char command = 'M';
    for (; *at_;) {
      if ((*at_ >= 'A' && *at_ <= 'Z')) command = *at_++;
      if (command == 'Z') continue;
      if (command == 'H')
        x_ = number();
      else if (command == 'V')
        y_ = number();
      else if (command == 'Q')
        curve();
      else
        x_ = number(), y_ = number();
      if (command == 'M') outlines_.emplace_back();
      if (command != 'Q') add(x_, y_);
      if (command == 'M') command = 'L';
    }
    return std::move(outlines_);
  }

 private:
  double number() {
    char* end = nullptr;
    const double value = std::strtod(at_, &end);
    at_ = end;
    return value;
  }
  void add(double x, double y) { outlines_.back().emplace_back(left_ + scale_ * x, -scale_ * y); }
  void curve() {
    const double x0 = x_, y0 = y_, cx = number(), cy = number();
    x_ = number(), y_ = number();
    for (int k = 1; k <= curve_pieces; ++k) {
      const double t = static_cast<double>(k) / curve_pieces, s = 1 - t;
      add(s * s * x0 + 2 * s * t * cx + t * t * x_, s * s * y0 + 2 * s * t * cy + t * t * y_);
    }
  }

  const char* at_;
  double left_, scale_, x_ = 0, y_ = 0;
  std::vector<Drawing::Points> outlines_;
};

}  // namespace

double text_length(std::string_view words, double size) {
  double length = 0;
  for (const std::uint32_t code : characters(words)) length += glyph_of(code).advance;
  return length * size / units_per_size;
}

std::vector<Drawing::Points> text_outline(std::string_view words, double size) {
  std::vector<Drawing::Points> outlines;
  double left = 0;
  const double scale = size / units_per_size;
  for (const std::uint32_t code : characters(words)) {
    const Glyph& glyph = glyph_of(code);
    for (auto& points : OutlineReader(glyph.outline, left, scale).read())
      outlines.push_back(std::move(points));
    left += glyph.advance * scale;
  }
  return outlines;
}

}  // namespace lahar
