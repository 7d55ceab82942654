#include "runtime/picture/canvas.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <sstream>

#include "runtime/picture/glyphs.h"

namespace lahar {

namespace {

/// How much of each pixel of a rectangle an outline covers. It stores, for each pixel, how much the
/// covered share differs from that of the pixel to its left.
class Coverage {
 public:
  Coverage(int left, int top, int width, int height)
      : left_(left), top_(top), width_(width), height_(height) {
    change_.resize(static_cast<std::size_t>(width + 2) * static_cast<std::size_t>(height));
  }

  void add_edge(std::pair<double, double> a, std::pair<double, double> b) {
    if (a.second == b.second) return;
    const double sign = a.second < b.second ? 1 : -1;
    if (sign < 0) std::swap(a, b);
    const double slope = (b.first - a.first) / (b.second - a.second);
    const int first = std::max(0, static_cast<int>(std::floor(a.second)) - top_),
              last = std::min(height_ - 1, static_cast<int>(std::ceil(b.second)) - 1 - top_);
    for (int row = first; row <= last; ++row) {
      const double y0 = std::max(a.second, static_cast<double>(row + top_)),
                   y1 = std::min(b.second, static_cast<double>(row + top_ + 1));
      if (y1 <= y0) continue;
      const double x0 = a.first + (y0 - a.second) * slope - left_,
                   x1 = a.first + (y1 - a.second) * slope - left_;
      add_in_row(row, std::min(x0, x1), std::max(x0, x1), sign * (y1 - y0));
    }
  }

  /// each(i, j, share) for all pixels that are covered.
  template <class Each>
  void for_each(const Each& each) const {
    for (int j = 0; j < height_; ++j) {
      double sum = 0;
      for (int i = 0; i < width_; ++i) {
        sum += change_[index(i, j)];
        const double share = std::min(1.0, std::abs(sum));
        if (share > 1e-3) each(left_ + i, top_ + j, share);
      }
    }
  }

 private:
  std::size_t index(int i, int j) const {
    return static_cast<std::size_t>(j) * static_cast<std::size_t>(width_ + 2) +
           static_cast<std::size_t>(i);
  }

  /// A piece of an edge, from x0 to x1 in a row, of the signed height `height`.
  void add_in_row(int row, double x0, double x1, double height) {
    x0 = std::clamp(x0, 0.0, static_cast<double>(width_));
    x1 = std::clamp(x1, 0.0, static_cast<double>(width_));
    const int first = static_cast<int>(x0), last = static_cast<int>(x1);
    const double length = x1 - x0;
    for (int i = first; i <= last; ++i) {
      const double from = std::max(x0, static_cast<double>(i)),
                   to = std::min(x1, static_cast<double>(i + 1));
      const double part = length > 0 ? height * (to - from) / length : height;
      const double right =
          i + 1 - 0.5 * (from + to);  // share of the pixel, to the right of the edge
      change_[index(i, row)] += part * right;
      change_[index(i + 1, row)] += part * (1 - right);
      if (length == 0) break;
    }
  }

  int left_, top_, width_, height_;
  std::vector<double> change_;
};

Rgba colour_of(const std::string& text) {
  Rgba colour{0, 0, 0, 255};
  for (std::size_t k = 0; k < 3; ++k)
    colour[k] = static_cast<std::uint8_t>(std::stoi(text.substr(1 + 2 * k, 2), nullptr, 16));
  return colour;
}

void blend(Rgba& to, const Rgba& colour, double share) {
  for (std::size_t k = 0; k < 3; ++k)
    to[k] = static_cast<std::uint8_t>(std::lround((1 - share) * to[k] + share * colour[k]));
}

/// Pieces of a line that are drawn where it is dashed.
std::vector<Drawing::Points> dashes(const Drawing::Points& points, const std::string& lengths,
                                    double scale) {
  std::vector<double> pattern;
  std::istringstream in(lengths);
  for (double length; in >> length;) pattern.push_back(length * scale);
  if (pattern.empty()) return {points};
  std::vector<Drawing::Points> pieces{{points.front()}};
  std::size_t k = 0;
  double left = pattern[0];
  for (std::size_t p = 1; p < points.size(); ++p) {
    auto [x, y] = points[p - 1];
    double length = std::hypot(points[p].first - x, points[p].second - y);
    while (length > 0) {
      const double step = std::min(left, length), share = step / length;
      x += share * (points[p].first - x), y += share * (points[p].second - y);
      length -= step, left -= step;
      if (k % 2 == 0) pieces.back().emplace_back(x, y);
      if (left > 0) continue;
      left = pattern[++k % pattern.size()];
      if (k % 2 == 0) pieces.push_back({{x, y}});
    }
  }
  return pieces;
}

}  // namespace

Canvas::Canvas(double width, double height, double scale)
    : scale_(scale),
      image_(static_cast<int>(std::lround(width * scale)),
             static_cast<int>(std::lround(height * scale)), {255, 255, 255, 255}) {}

void Canvas::fill(const Outline& outline, const std::string& colour, double opacity) {
  double low_x = image_.width, low_y = image_.height, high_x = 0, high_y = 0;
  for (const Points& points : outline)
    for (const auto& [x, y] : points) {
      if (!std::isfinite(x) || !std::isfinite(y)) return;
      low_x = std::min(low_x, x), high_x = std::max(high_x, x);
      low_y = std::min(low_y, y), high_y = std::max(high_y, y);
    }
  const int left = std::max(0, static_cast<int>(std::floor(low_x))),
            top = std::max(0, static_cast<int>(std::floor(low_y))),
            right = std::min(image_.width, static_cast<int>(std::ceil(high_x))),
            bottom = std::min(image_.height, static_cast<int>(std::ceil(high_y)));
  if (right <= left || bottom <= top) return;
  Coverage coverage(left, top, right - left, bottom - top);
  for (const Points& points : outline)
    for (std::size_t k = 0; k < points.size(); ++k)
      coverage.add_edge(points[k], points[(k + 1) % points.size()]);
  const Rgba to = colour_of(colour);
  coverage.for_each(
      [&](int i, int j, double share) { blend(image_.at(i, j), to, share * opacity); });
}

void Canvas::stroke(const Points& points, const Style& style) {
  if (points.size() < 2) return;
  const double half = 0.5 * style.width * scale_;
  Points scaled;
  for (const auto& [x, y] : points) scaled.emplace_back(x * scale_, y * scale_);
  Outline outline;
  for (const Points& piece : dashes(scaled, style.dash, scale_))
    for (std::size_t k = 1; k < piece.size(); ++k) {
      const auto [x0, y0] = piece[k - 1];
      const auto [x1, y1] = piece[k];
      const double length = std::hypot(x1 - x0, y1 - y0);
      if (length == 0) continue;
      const double u = half * (x1 - x0) / length, v = half * (y1 - y0) / length;
      // Corners of a bent line are closed by going on a little.
      const double more = piece.size() > 2 ? 0.4 : 0.0;
      const double ax = x0 - more * u, ay = y0 - more * v, bx = x1 + more * u, by = y1 + more * v;
      outline.push_back({{ax - v, ay + u}, {bx - v, by + u}, {bx + v, by - u}, {ax + v, ay - u}});
    }
  fill(outline, style.stroke, style.opacity);
}

void Canvas::rectangle(double x, double y, double width, double height, const Style& style) {
  const double right = x + width, bottom = y + height;
  if (style.fill != "none") {
    // On whole pixels: what lies beside each other has no seams.
    const auto whole = [&](double at) { return std::round(at * scale_); };
    fill({{{whole(x), whole(y)},
           {whole(right), whole(y)},
           {whole(right), whole(bottom)},
           {whole(x), whole(bottom)}}},
         style.fill, style.opacity);
  }
  if (style.stroke == "none") return;
  line(x, y, right, y, style);
  line(x, bottom, right, bottom, style);
  line(x, y, x, bottom, style);
  line(right, y, right, bottom, style);
}

void Canvas::line(double x1, double y1, double x2, double y2, const Style& style) {
  stroke({{x1, y1}, {x2, y2}}, style);
}

void Canvas::polyline(const Points& points, const Style& style) {
  if (style.fill != "none") {
    Points scaled;
    for (const auto& [x, y] : points) scaled.emplace_back(x * scale_, y * scale_);
    fill({scaled}, style.fill, style.opacity);
  }
  if (style.stroke != "none") stroke(points, style);
}

void Canvas::circle(double x, double y, double radius, const Style& style) {
  constexpr int corners = 48;
  const auto around = [&](double r) {
    Points points;
    for (int k = 0; k < corners; ++k) {
      const double angle = 2 * std::numbers::pi * k / corners;
      points.emplace_back(scale_ * (x + r * std::cos(angle)), scale_ * (y + r * std::sin(angle)));
    }
    return points;
  };
  if (style.fill != "none") fill({around(radius)}, style.fill, style.opacity);
  if (style.stroke == "none") return;
  Points inside = around(radius - 0.5 * style.width);
  std::reverse(inside.begin(), inside.end());
  fill({around(radius + 0.5 * style.width), inside}, style.stroke, style.opacity);
}

void Canvas::image(double x, double y, double width, double height, const Image& image) {
  const int left = static_cast<int>(std::lround(x * scale_)),
            top = static_cast<int>(std::lround(y * scale_)),
            columns = static_cast<int>(std::lround((x + width) * scale_)) - left,
            rows = static_cast<int>(std::lround((y + height) * scale_)) - top;
  for (int j = std::max(0, -top); j < rows && top + j < image_.height; ++j)
    for (int i = std::max(0, -left); i < columns && left + i < image_.width; ++i) {
      const Rgba& from =
          image.at(std::min(image.width - 1, (2 * i + 1) * image.width / (2 * columns)),
                   std::min(image.height - 1, (2 * j + 1) * image.height / (2 * rows)));
      blend(image_.at(left + i, top + j), from, from[3] / 255.0);
    }
}

void Canvas::write(double x, double y, const std::string& words, const TextStyle& style) {
  const double size = style.size * scale_, angle = style.angle * std::numbers::pi / 180;
  double from = 0;
  if (style.anchor == "middle") from = -0.5 * text_length(words, size);
  if (style.anchor == "end") from = -text_length(words, size);
  Outline outline;
  for (const Points& points : text_outline(words, size)) {
    Points turned;
    for (const auto& [a, b] : points)
      turned.emplace_back(x * scale_ + std::cos(angle) * (a + from) - std::sin(angle) * b,
                          y * scale_ + std::sin(angle) * (a + from) + std::cos(angle) * b);
    outline.push_back(std::move(turned));
  }
  fill(outline, style.fill, 1);
}

}  // namespace lahar
