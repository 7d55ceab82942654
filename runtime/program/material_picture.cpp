// The plot of `lahar material`: three panels.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "runtime/picture/svg.h"
#include "runtime/program/material_command.h"
#include "runtime/program/material_point.h"

namespace lahar {

namespace {

constexpr double picture_width = 1200, picture_height = 420, top = 70, bottom = 350,
                 panel_width = 290, first_left = 90, panel_distance = 385;
constexpr const char* component_names[6] = {"xx", "yy", "zz", "xy", "yz", "xz"};

using Curve = std::vector<std::pair<double, double>>;

struct Range {
  double low = 0, high = 0;  ///< with zero
  void add(double value) { low = std::min(low, value), high = std::max(high, value); }
  double share(double value) const { return (value - low) / (high - low); }
};

void draw(Svg& svg, int number, const Curve& curve, const std::string& head,
          const std::string& below) {
  const double left = first_left + number * panel_distance, right = left + panel_width;
  Range x, y;
  for (const auto& [a, b] : curve) x.add(a), y.add(b);
  for (Range* range : {&x, &y})
    if (!(range->high > range->low)) range->high = range->low + 1;
  const auto place = [&](double a, double b) {
    return std::pair(left + x.share(a) * (right - left), bottom - y.share(b) * (bottom - top));
  };
  svg.text(left - 40, 40, head, 15);
  const double dy = grid_step(y.high - y.low), dx = grid_step(x.high - x.low);
  for (double k = std::ceil(y.low / dy); k * dy <= y.high * (1 + 1e-12); ++k) {
    const double at = place(x.low, k * dy).second;
    svg.line(left, at, right, at, {.stroke = "#d9dde2", .width = 1});
    svg.text(left - 8, at + 4, fmt::format("{:g}", k * dy), 12, "end");
  }
  for (double k = std::ceil(x.low / dx); k * dx <= x.high * (1 + 1e-12); ++k) {
    const double at = place(k * dx, y.low).first;
    svg.line(at, bottom, at, bottom + 5, {.stroke = "#222222", .width = 1});
    svg.text(at, bottom + 20, fmt::format("{:g}", k * dx), 12, "middle");
  }
  svg.line(left, bottom, right, bottom, {.stroke = "#222222", .width = 1});
  svg.text((left + right) / 2, bottom + 44, below, 13, "middle");
  Curve points;
  for (const auto& [a, b] : curve) points.push_back(place(a, b));
  svg.polyline(points, {.stroke = "#1f6f9f", .width = 2});
}

}  // namespace

std::string path_picture(const MaterialDriver& driver, const std::vector<PathPoint>& points) {
  std::size_t main = 2;  // the strain that changes most
  double most = 0;
  for (std::size_t k = 0; k < 6; ++k)
    for (const PathPoint& point : points)
      if (std::abs(point.strain[k]) > 1.0001 * most) most = std::abs(point.strain[k]), main = k;
  double sign = 1;
  for (const PathPoint& point : points)
    if (std::abs(point.strain[main]) == most) sign = point.strain[main] < 0 ? -1 : 1;
  Curve shear, volume, path;
  for (const PathPoint& point : points) {
    const double strain = sign * point.strain[main], p = mean_pressure(point.stress),
                 q = deviatoric_stress(point.stress);
    shear.emplace_back(strain, q);
    volume.emplace_back(strain, point.strain[0] + point.strain[1] + point.strain[2]);
    path.emplace_back(p, q);
  }
  const std::string below =
      fmt::format("{}strain_{} [-]", sign < 0 ? "-" : "", component_names[main]);
  Svg svg(picture_width, picture_height);
  svg.text(first_left - 40, 20, driver.title.empty() ? driver.material.name : driver.title, 13,
           "start", "#5b6570");
  draw(svg, 0, shear, "Deviatoric stress q [Pa]", below);
  draw(svg, 1, path, "Stress path, q [Pa] over p", "p [Pa], positive in compression");
  draw(svg, 2, volume, "Volumetric strain [-]", below);
  return svg.finish();
}

}  // namespace lahar
