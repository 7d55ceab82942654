/// \file Pixels, and PNG files of them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace lahar {

/// Red, green, blue, opacity; 0 to 255.
using Rgba = std::array<std::uint8_t, 4>;

/// Rows from the top.
struct Image {
  Image() = default;
  Image(int columns, int rows, const Rgba& colour = {})
      : width(columns),
        height(rows),
        pixels(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows), colour) {}
  Rgba& at(int i, int j) {
    return pixels[static_cast<std::size_t>(j) * static_cast<std::size_t>(width) +
                  static_cast<std::size_t>(i)];
  }
  const Rgba& at(int i, int j) const { return const_cast<Image&>(*this).at(i, j); }

  int width = 0, height = 0;
  std::vector<Rgba> pixels;
};

/// The bytes of a PNG file. Opaque images have no opacity in it, and those of up to 256 colours a
/// palette.
std::string png_of(const Image& image);

/// `data:image/png;base64,...`
std::string png_url(const Image& image);

}  // namespace lahar
