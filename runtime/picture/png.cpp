// PNG (ISO/IEC 15948): chunks with checksums, rows with filters, deflated.
#include <zlib.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <optional>
#include <stdexcept>
#include <string_view>

#include "io/base/base64.h"
#include "runtime/picture/image.h"

namespace lahar {

namespace {

constexpr std::size_t most_palette = 256;

std::string big_endian(std::uint32_t value) {
  std::string bytes(4, '\0');
  for (std::size_t k = 0; k < 4; ++k) bytes[k] = static_cast<char>(value >> (24 - 8 * k));
  return bytes;
}

std::string chunk(const char* type, std::string_view data) {
  const std::string body = std::string(type) + std::string(data);
  const uLong sum =
      crc32(0, reinterpret_cast<const Bytef*>(body.data()), static_cast<uInt>(body.size()));
  return big_endian(static_cast<std::uint32_t>(data.size())) + body +
         big_endian(static_cast<std::uint32_t>(sum));
}

std::string deflated(const std::string& bytes) {
  uLongf size = compressBound(static_cast<uLong>(bytes.size()));
  std::string packed(size, '\0');
  if (compress2(reinterpret_cast<Bytef*>(packed.data()), &size,
                reinterpret_cast<const Bytef*>(bytes.data()), static_cast<uLong>(bytes.size()),
                Z_BEST_COMPRESSION) != Z_OK)
    throw std::logic_error("zlib cannot compress a picture");
  packed.resize(size);
  return packed;
}

/// The colours of an image, if they are few.
std::optional<std::map<Rgba, std::size_t>> palette_of(const Image& image) {
  std::map<Rgba, std::size_t> palette;
  const Rgba* last = nullptr;
  for (const Rgba& pixel : image.pixels) {
    if (last && *last == pixel) continue;
    last = &pixel;
    palette.try_emplace(pixel, 0);
    if (palette.size() > most_palette) return std::nullopt;
  }
  std::size_t k = 0;
  for (auto& [colour, index] : palette) index = k++;
  return palette;
}

/// Rows of bytes, each with the filter "up" (the difference to the row above), which suits squares
/// of one colour and smooth fields alike.
std::string filtered(const std::string& rows, std::size_t length) {
  std::string bytes;
  bytes.reserve(rows.size() + rows.size() / length);
  for (std::size_t from = 0; from < rows.size(); from += length) {
    bytes += '\2';
    for (std::size_t k = from; k < from + length; ++k)
      bytes += static_cast<char>(rows[k] - (from == 0 ? '\0' : rows[k - length]));
  }
  return bytes;
}

}  // namespace

std::string png_of(const Image& image) {
  if (image.pixels.empty()) throw std::logic_error("a picture without pixels");
  const auto palette = palette_of(image);
  const bool opaque = std::all_of(image.pixels.begin(), image.pixels.end(),
                                  [](const Rgba& p) { return p[3] == 255; });
  const std::size_t channels = palette ? 1 : opaque ? 3 : 4;
  std::string rows;
  rows.reserve(image.pixels.size() * channels);
  for (const Rgba& pixel : image.pixels) {
    if (palette)
      rows += static_cast<char>(palette->at(pixel));
    else
      for (std::size_t k = 0; k < channels; ++k) rows += static_cast<char>(pixel[k]);
  }
  std::string head = big_endian(static_cast<std::uint32_t>(image.width)) +
                     big_endian(static_cast<std::uint32_t>(image.height));
  head += '\x08';
  head += palette ? '\3' : opaque ? '\2' : '\6';
  head += std::string(3, '\0');
  std::string png = "\x89PNG\r\n\x1a\n" + chunk("IHDR", head);
  if (palette) {
    std::string colours, opacities;
    for (const auto& [colour, index] : *palette) {
      for (std::size_t k = 0; k < 3; ++k) colours += static_cast<char>(colour[k]);
      opacities += static_cast<char>(colour[3]);
    }
    png += chunk("PLTE", colours);
    if (!opaque) png += chunk("tRNS", opacities);
  }
  png += chunk("IDAT", deflated(filtered(rows, static_cast<std::size_t>(image.width) * channels)));
  return png + chunk("IEND", "");
}

std::string png_url(const Image& image) {
  return "data:image/png;base64," + base64(png_of(image));
}

}  // namespace lahar
