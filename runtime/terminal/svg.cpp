#include "runtime/terminal/svg.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "io/base/text.h"

namespace lahar {

namespace {

std::string attributes(const Svg::Style& style) {
  std::string text = fmt::format("fill=\"{}\"", style.fill);
  if (style.stroke != "none")
    text += fmt::format(" stroke=\"{}\" stroke-width=\"{:g}\"", style.stroke, style.width);
  if (!style.dash.empty()) text += fmt::format(" stroke-dasharray=\"{}\"", style.dash);
  if (style.opacity < 1) text += fmt::format(" opacity=\"{:g}\"", style.opacity);
  return text;
}

}  // namespace

Svg::Svg(double width, double height)
    : head_(
          fmt::format("<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0:g}\" height=\"{1:g}\" "
                      "viewBox=\"0 0 {0:g} {1:g}\" font-family=\"Helvetica, Arial, sans-serif\">\n",
                      width, height)) {
  rectangle(0, 0, width, height, {.fill = "#ffffff"});
}

void Svg::rectangle(double x, double y, double width, double height, const Style& style) {
  body_ += fmt::format(
      "<rect x=\"{:.2f}\" y=\"{:.2f}\" width=\"{:.2f}\" height=\"{:.2f}\" "
      "shape-rendering=\"crispEdges\" {}/>\n",
      x, y, width, height, attributes(style));
}

void Svg::line(double x1, double y1, double x2, double y2, const Style& style) {
  body_ += fmt::format("<line x1=\"{:.2f}\" y1=\"{:.2f}\" x2=\"{:.2f}\" y2=\"{:.2f}\" {}/>\n", x1,
                       y1, x2, y2, attributes(style));
}

void Svg::polyline(const std::vector<std::pair<double, double>>& points, const Style& style) {
  body_ += "<polyline points=\"";
  for (const auto& [x, y] : points) body_ += fmt::format("{:.2f},{:.2f} ", x, y);
  body_ += fmt::format("\" {}/>\n", attributes(style));
}

void Svg::arrow(double x, double y, double a, double b, double length, const Style& style) {
  constexpr double along = 9, beside = 5;  // of its head
  const double norm = std::hypot(a, b), u = a / norm, v = -b / norm;
  const double x1 = x + length * u, y1 = y + length * v;
  line(x, y, x1, y1, style);
  polyline({{x1 - along * u - beside * v, y1 - along * v + beside * u},
            {x1, y1},
            {x1 - along * u + beside * v, y1 - along * v - beside * u}},
           style);
}

void Svg::circle(double x, double y, double radius, const Style& style) {
  body_ += fmt::format("<circle cx=\"{:.2f}\" cy=\"{:.2f}\" r=\"{:.2f}\" {}/>\n", x, y, radius,
                       attributes(style));
}

void Svg::text(double x, double y, const std::string& words, double size, const char* anchor,
               const char* fill, double angle) {
  body_ += fmt::format(
      "<text x=\"{:.2f}\" y=\"{:.2f}\" font-size=\"{:g}\" text-anchor=\"{}\" "
      "fill=\"{}\"",
      x, y, size, anchor, fill);
  if (angle != 0) body_ += fmt::format(" transform=\"rotate({:g} {:.2f} {:.2f})\"", angle, x, y);
  body_ += fmt::format(">{}</text>\n", xml_escaped(words));
}

std::string Svg::finish() const {
  return head_ + body_ + "</svg>\n";
}

double grid_step(double range, double lines) {
  const double unit = std::pow(10.0, std::floor(std::log10(range / lines)));
  for (const double factor : {1.0, 2.0, 5.0})
    if (range / (factor * unit) <= lines + 1) return factor * unit;
  return 10 * unit;
}

std::string viridis(double value) {
  // Nine colours of matplotlib's map, equally spaced; linear between them.
  static constexpr std::array<std::array<double, 3>, 9> colours{{{68, 1, 84},
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
  std::array<int, 3> rgb{};
  for (std::size_t k = 0; k < 3; ++k)
    rgb[k] = static_cast<int>(std::lround((1 - w) * colours[i][k] + w * colours[i + 1][k]));
  return fmt::format("#{:02x}{:02x}{:02x}", rgb[0], rgb[1], rgb[2]);
}

}  // namespace lahar
