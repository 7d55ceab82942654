#include "runtime/picture/svg.h"

#include <fmt/format.h>

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

Svg::Svg(double width, double height, const std::string& background)
    : head_(
          fmt::format("<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0:g}\" height=\"{1:g}\" "
                      "viewBox=\"0 0 {0:g} {1:g}\" font-family=\"Helvetica, Arial, sans-serif\">\n",
                      width, height)) {
  if (background != "none") rectangle(0, 0, width, height, {.fill = background});
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

void Svg::polyline(const Points& points, const Style& style) {
  body_ += "<polyline points=\"";
  for (const auto& [x, y] : points) body_ += fmt::format("{:.2f},{:.2f} ", x, y);
  body_ += fmt::format("\" {}/>\n", attributes(style));
}

void Svg::circle(double x, double y, double radius, const Style& style) {
  body_ += fmt::format("<circle cx=\"{:.2f}\" cy=\"{:.2f}\" r=\"{:.2f}\" {}/>\n", x, y, radius,
                       attributes(style));
}

void Svg::write(double x, double y, const std::string& words, const TextStyle& style) {
  body_ += fmt::format(
      "<text x=\"{:.2f}\" y=\"{:.2f}\" font-size=\"{:g}\" text-anchor=\"{}\" fill=\"{}\"", x, y,
      style.size, style.anchor, style.fill);
  if (style.angle != 0)
    body_ += fmt::format(" transform=\"rotate({:g} {:.2f} {:.2f})\"", style.angle, x, y);
  body_ += fmt::format(">{}</text>\n", xml_escaped(words));
}

void Svg::image(double x, double y, double width, double height, const Image& image) {
  body_ += fmt::format(
      "<image x=\"{:.2f}\" y=\"{:.2f}\" width=\"{:.2f}\" height=\"{:.2f}\" "
      "preserveAspectRatio=\"none\" href=\"{}\"/>\n",
      x, y, width, height, png_url(image));
}

std::string Svg::finish() const {
  return head_ + body_ + "</svg>\n";
}

}  // namespace lahar
