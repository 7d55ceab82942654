#include "runtime/picture/chart.h"

#include <algorithm>
#include <cmath>

#include "runtime/picture/quantity.h"

namespace lahar {

namespace {

constexpr double margin_left = 62, margin_right = 14, margin_top = 26, margin_bottom = 40;

struct Range {
  double low = std::numeric_limits<double>::max(), high = std::numeric_limits<double>::lowest();
  void add(double value) {
    if (!std::isfinite(value)) return;
    low = std::min(low, value), high = std::max(high, value);
  }
  bool empty() const { return low > high; }
  double largest() const { return std::max(std::abs(low), std::abs(high)); }
};

/// Keeps the first, lowest, highest and last point of each column of pixels.
Drawing::Points thinned(const Drawing::Points& points) {
  Drawing::Points kept;
  for (std::size_t from = 0; from < points.size();) {
    std::size_t to = from, low = from, high = from;
    while (to < points.size() && std::floor(points[to].first) == std::floor(points[from].first)) {
      if (points[to].second < points[low].second) low = to;
      if (points[to].second > points[high].second) high = to;
      ++to;
    }
    std::vector<std::size_t> those{from, std::min(low, high), std::max(low, high), to - 1};
    those.erase(std::unique(those.begin(), those.end()), those.end());
    for (const std::size_t k : those) kept.push_back(points[k]);
    from = to;
  }
  return kept;
}

void draw_grid(Drawing& drawing, const ChartScale& s, bool whole, const Ink& ink) {
  const double dx = grid_step(s.x_high - s.x_low, 6);
  double dy = grid_step(s.y_high - s.y_low, 5);
  if (whole) dy = std::max(dy, 1.0);
  for_grid_lines(s.y_low, s.y_high, dy, [&](double value) {
    const double y = s.top + s.height * (s.y_high - value) / (s.y_high - s.y_low);
    const bool zero = std::abs(value) < 0.5 * dy;
    drawing.line(s.left, y, s.left + s.width, y,
                 {.stroke = zero ? ink.soft : ink.grid, .width = 1});
    drawing.text(s.left - 8, y + 4, tick_label(value, dy), 11.5, "end", ink.soft);
  });
  const double bottom = s.top + s.height;
  for_grid_lines(s.x_low, s.x_high, dx, [&](double value) {
    const double x = s.left + s.width * (value - s.x_low) / (s.x_high - s.x_low);
    drawing.line(x, bottom, x, bottom + 4, {.stroke = ink.soft, .width = 1});
    drawing.text(x, bottom + 17, tick_label(value, dx), 11.5, "middle", ink.soft);
  });
}

}  // namespace

bool has_points(const Chart& chart) {
  return std::any_of(chart.lines.begin(), chart.lines.end(), [](const ChartLine& line) {
    for (std::size_t k = 0; k < line.x.size(); ++k)
      if (std::isfinite(line.x[k]) && std::isfinite(line.y[k])) return true;
    return false;
  });
}

ChartScale draw_chart(Drawing& drawing, const Chart& chart, double width, double height,
                      const Ink& ink) {
  Range x, y;
  for (const ChartLine& line : chart.lines) {
    for (const double value : line.x) x.add(value);
    for (const double value : line.y) y.add(value);
  }
  if (x.empty() || y.empty()) return {};
  if (chart.from_zero) y.add(0);
  const UnitScale across = unit_scale(x.largest(), chart.x_unit),
                  up = unit_scale(y.largest(), chart.y_unit);
  ChartScale s{.left = margin_left,
               .top = margin_top,
               .width = width - margin_left - margin_right,
               .height = height - margin_top - margin_bottom,
               .x_low = x.low * across.factor,
               .x_high = x.high * across.factor,
               .y_low = y.low * up.factor,
               .y_high = y.high * up.factor,
               .x_unit = across.unit,
               .y_unit = up.unit};
  const auto widen = [](double& low, double& high, double share) {
    if (low == 0 && high == 0) {
      high = 1;  // nothing but zeros
      return;
    }
    const double size = std::max(std::abs(low), std::abs(high)), length = high - low;
    const double more = length > 1e-9 * size ? share * length : 0.05 * size;
    // An end that is zero stays.
    if (low != 0 || length <= 1e-9 * size) low -= more;
    if (high != 0 || length <= 1e-9 * size) high += more;
  };
  widen(s.y_low, s.y_high, 0.05);
  if (s.x_high - s.x_low <= 0) widen(s.x_low, s.x_high, 0);
  draw_grid(drawing, s, chart.whole, ink);
  const auto place = [&](double a, double b) {
    return std::pair{s.left + s.width * (a * across.factor - s.x_low) / (s.x_high - s.x_low),
                     s.top + s.height * (s.y_high - b * up.factor) / (s.y_high - s.y_low)};
  };
  for (const auto& [at, name] : chart.marks) {
    const double left = place(at, 0).first;
    drawing.line(left, s.top, left, s.top + s.height,
                 {.stroke = ink.soft, .width = 1, .dash = "4 4"});
    drawing.text(left + 5, s.top + 12, name, 11.5, "start", ink.soft);
  }
  for (const ChartLine& line : chart.lines) {
    Drawing::Points points;
    const auto finish = [&] {
      if (points.size() > 1)
        drawing.polyline(thinned(points), {.stroke = line.colour, .width = 2});
      else if (points.size() == 1)
        drawing.circle(points[0].first, points[0].second, 2.5, {.fill = line.colour});
      points.clear();
    };
    for (std::size_t k = 0; k < line.x.size(); ++k) {
      if (std::isfinite(line.x[k]) && std::isfinite(line.y[k]))
        points.push_back(place(line.x[k], line.y[k]));
      else
        finish();
    }
    finish();
  }
  drawing.text(s.left, 14, with_unit(chart.y_name, up.unit), 12.5, "start", ink.text);
  drawing.text(s.left + s.width, height - 6, with_unit(chart.x_name, across.unit), 12.5, "end",
               ink.text);
  return s;
}

}  // namespace lahar
