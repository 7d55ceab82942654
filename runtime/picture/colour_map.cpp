#include "runtime/picture/colour_map.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace lahar {

namespace {

using Triple = std::array<double, 3>;

std::uint8_t byte_of(double share) {
  return static_cast<std::uint8_t>(std::lround(255 * std::clamp(share, 0.0, 1.0)));
}

/// A colour of the space Oklab (Ottosson 2020): lightness, green to red, blue to yellow.
Rgba from_oklab(const Triple& lab) {
  const double l = std::pow(lab[0] + 0.3963377774 * lab[1] + 0.2158037573 * lab[2], 3),
               m = std::pow(lab[0] - 0.1055613458 * lab[1] - 0.0638541728 * lab[2], 3),
               s = std::pow(lab[0] - 0.0894841775 * lab[1] - 1.2914855480 * lab[2], 3);
  const auto encoded = [](double linear) {
    return byte_of(linear <= 0.0031308 ? 12.92 * linear
                                       : 1.055 * std::pow(linear, 1 / 2.4) - 0.055);
  };
  return {encoded(4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s),
          encoded(-1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s),
          encoded(-0.0041960863 * l - 0.7034186147 * m + 1.7076147010 * s), 255};
}

}  // namespace

Rgba viridis(double value) {
  // Nine colours of the map, equally spaced; linear between them.
  static constexpr std::array<Triple, 9> colours{{{68, 1, 84},
                                                  {71, 44, 122},
                                                  {59, 81, 139},
                                                  {44, 113, 142},
                                                  {33, 144, 141},
                                                  {39, 173, 129},
                                                  {92, 200, 99},
                                                  {170, 220, 50},
                                                  {253, 231, 37}}};
  const double at = std::clamp(value, 0.0, 1.0) * (colours.size() - 1);
  const auto i = std::min(static_cast<std::size_t>(at), colours.size() - 2);
  const double w = at - static_cast<double>(i);
  Rgba colour{0, 0, 0, 255};
  for (std::size_t k = 0; k < 3; ++k)
    colour[k] =
        static_cast<std::uint8_t>(std::lround((1 - w) * colours[i][k] + w * colours[i + 1][k]));
  return colour;
}

Rgba diverging(double value) {
  // Lightness and hue of the ends and of the middle; straight lines between them.
  static constexpr Triple blue{0.42, -0.03, -0.15}, middle{0.95, 0.0, 0.005}, red{0.45, 0.16, 0.07};
  const double at = 2 * std::clamp(value, 0.0, 1.0) - 1, w = std::abs(at);
  const Triple& end = at < 0 ? blue : red;
  Triple lab{};
  for (std::size_t k = 0; k < 3; ++k) lab[k] = (1 - w) * middle[k] + w * end[k];
  return from_oklab(lab);
}

std::string hex_of(const Rgba& colour) {
  return fmt::format("#{:02x}{:02x}{:02x}", colour[0], colour[1], colour[2]);
}

Rgba ColourScale::colour(double value) const {
  return is_signed ? diverging(share(value)) : viridis(share(value));
}

}  // namespace lahar
