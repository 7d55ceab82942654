/// \file What pictures are drawn on: the few shapes that they need. Coordinates in pixels, y
/// downward.
#pragma once

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "runtime/picture/image.h"

namespace lahar {

/// A drawing as SVG text (svg.h) or as pixels (canvas.h).
class Drawing {
 public:
  virtual ~Drawing() = default;

  /// Colours are `#rrggbb` or none.
  struct Style {
    std::string fill = "none", stroke = "none";
    double width = 1.5;
    std::string dash = {};  ///< lengths of lines and gaps, as "7 4"
    double opacity = 1;
  };
  using Points = std::vector<std::pair<double, double>>;

  virtual void rectangle(double x, double y, double width, double height, const Style& style) = 0;
  virtual void line(double x1, double y1, double x2, double y2, const Style& style) = 0;
  virtual void polyline(const Points& points, const Style& style) = 0;
  virtual void circle(double x, double y, double radius, const Style& style) = 0;
  /// Pixels that fill a rectangle.
  virtual void image(double x, double y, double width, double height, const Image& image) = 0;

  /// From (x, y) along (a, b), b upwards.
  void arrow(double x, double y, double a, double b, double length, const Style& style);
  /// `anchor`: start, middle or end; `angle` in degrees around (x, y).
  void text(double x, double y, const std::string& words, double size = 13,
            const char* anchor = "start", const char* fill = "#222222", double angle = 0) {
    write(x, y, words, {.size = size, .anchor = anchor, .fill = fill, .angle = angle});
  }

 protected:
  struct TextStyle {
    double size;
    std::string anchor, fill;
    double angle;
  };
  virtual void write(double x, double y, const std::string& words, const TextStyle& style) = 0;
};

/// A round step for so many grid lines, or one more.
double grid_step(double range, double lines = 4);

/// each(k * step) for the grid lines between two values, with those on the ends.
template <class Each>
void for_grid_lines(double low, double high, double step, Each&& each) {
  for (double k = std::ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; ++k) each(k * step);
}

}  // namespace lahar
