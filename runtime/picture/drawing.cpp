#include "runtime/picture/drawing.h"

#include <cmath>

namespace lahar {

void Drawing::arrow(double x, double y, double a, double b, double length, const Style& style) {
  constexpr double along = 9, beside = 5;  // of its head
  const double norm = std::hypot(a, b), u = a / norm, v = -b / norm;
  const double x1 = x + length * u, y1 = y + length * v;
  line(x, y, x1, y1, style);
  polyline({{x1 - along * u - beside * v, y1 - along * v + beside * u},
            {x1, y1},
            {x1 - along * u + beside * v, y1 - along * v - beside * u}},
           style);
}

double grid_step(double range, double lines) {
  const double unit = std::pow(10.0, std::floor(std::log10(range / lines)));
  for (const double factor : {1.0, 2.0, 5.0})
    if (range / (factor * unit) <= lines + 1) return factor * unit;
  return 10 * unit;
}

}  // namespace lahar
