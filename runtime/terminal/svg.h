/// \file A drawing as SVG text: the few shapes that charts need. Coordinates in pixels, y downward.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace lahar {

class Svg {
 public:
  Svg(double width, double height);

  struct Style {
    std::string fill = "none", stroke = "none";
    double width = 1.5;
    std::string dash = {};
    double opacity = 1;
  };
  void rectangle(double x, double y, double width, double height, const Style& style);
  void line(double x1, double y1, double x2, double y2, const Style& style);
  void polyline(const std::vector<std::pair<double, double>>& points, const Style& style);
  /// From (x, y) along (a, b), b upwards.
  void arrow(double x, double y, double a, double b, double length, const Style& style);
  void circle(double x, double y, double radius, const Style& style);
  /// `anchor`: start, middle or end; `angle` in degrees around (x, y).
  void text(double x, double y, const std::string& words, double size = 13,
            const char* anchor = "start", const char* fill = "#222", double angle = 0);

  std::string finish() const;

 private:
  std::string head_, body_;
};

/// A round step for so many grid lines, or one more.
double grid_step(double range, double lines = 4);

/// A colour of the map "viridis" for a value from 0 to 1, as `#rrggbb`.
std::string viridis(double value);

}  // namespace lahar
