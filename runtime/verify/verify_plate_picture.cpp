// The picture of `lahar verify plate-with-hole`: three panels side by side.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "runtime/picture/colour_map.h"
#include "runtime/picture/svg.h"
#include "runtime/verify/verify_plate.h"

namespace lahar {

namespace {

constexpr double picture_width = 1320, picture_height = 430, top = 70, bottom = 360;
constexpr const char* ink = "#222222";
constexpr const char* faint = "#d9dde2";
constexpr const char* blue = "#1f6f9f";
constexpr const char* grey = "#9aa3ad";

struct Panel {
  double left, right, x0, x1, y0, y1;
  double x(double value) const { return left + (value - x0) / (x1 - x0) * (right - left); }
  double y(double value) const { return bottom - (value - y0) / (y1 - y0) * (bottom - top); }
};

void title(Svg& svg, double x, const char* head, const char* below) {
  svg.text(x, 28, head, 16);
  svg.text(x, 48, below, 12.5, "start", "#5b6570");
}

// --- stress field -------------------------------------------------------------------------------

void draw_field(Svg& svg, const Frame& frame) {
  constexpr double left = 50, right = 480, lowest = 0, highest = 3;
  const double scale = (right - left) / (plate_length / 2);
  const double base = top + 5 + scale * plate_width / 2;
  title(svg, left, "Stress along the load, σxx / σ0", "a quarter of the plate; load to the right");
  // Means of the particles of a cell: as fine as the stress that linear elements carry.
  std::map<std::pair<int, int>, std::pair<double, int>> cells;
  const FrameColumn& stress = *frame.find("stress");
  for (Index p = 0; p < frame.size(); ++p) {
    const auto i = static_cast<std::size_t>(p);
    auto& [sum, count] = cells[{static_cast<int>(frame.coordinates[2 * i] / plate_cell),
                                static_cast<int>(frame.coordinates[2 * i + 1] / plate_cell)}];
    sum += stress.values[6 * i] / plate_load;
    ++count;
  }
  const double edge = scale * plate_cell;
  for (const auto& [cell, value] : cells)
    svg.rectangle(
        left + cell.first * edge, base - (cell.second + 1) * edge, edge + 0.5, edge + 0.5,
        {.fill = hex_of(viridis((value.first / value.second - lowest) / (highest - lowest)))});
  // The hole over the cells that it cuts; what of it is not in this quarter is wiped off again.
  const double radius = scale * plate_radius;
  svg.circle(left, base, radius, {.fill = "#ffffff"});
  svg.rectangle(left - radius - 1, base - radius - 1, radius + 1, 2 * radius + 2,
                {.fill = "#ffffff"});
  svg.rectangle(left - 1, base, radius + 2, radius + 1, {.fill = "#ffffff"});
  svg.text(left + 0.35 * radius, base - 0.3 * radius, "hole", 12, "start", "#5b6570");
  svg.text(left - 8, base - radius + 4, "A", 14, "end");
  svg.text(left + radius, base + 17, "B", 14, "middle");

  constexpr double bar_top = bottom + 8, steps = 60;
  for (int k = 0; k < steps; ++k)
    svg.rectangle(left + k * (right - left) / steps, bar_top, (right - left) / steps + 0.5, 10,
                  {.fill = hex_of(viridis((k + 0.5) / steps))});
  for (int value = 0; value <= 3; ++value)
    svg.text(left + (right - left) * value / highest, bar_top + 26, fmt::format("{}", value), 12,
             value == 0   ? "start"
             : value == 3 ? "end"
                          : "middle");
}

// --- along the ligament -------------------------------------------------------------------------

void axes(Svg& svg, const Panel& panel, const char* below) {
  svg.line(panel.left, bottom, panel.right, bottom, {.stroke = ink, .width = 1});
  svg.text((panel.left + panel.right) / 2, bottom + 40, below, 13, "middle");
}

void grid_line(Svg& svg, const Panel& panel, double value, const std::string& label) {
  svg.line(panel.left, panel.y(value), panel.right, panel.y(value), {.stroke = faint, .width = 1});
  svg.text(panel.left - 8, panel.y(value) + 4, label, 12, "end");
}

void draw_ligament(Svg& svg, const Frame& frame, const HoleSeries& exact) {
  const Panel panel{550, 850, 0.4, 2.5, 0.8, 3.4};
  title(svg, panel.left, "Above the hole, x = 0", "σxx / σ0 from the hole's edge A to the side");
  for (const double value : {1.0, 1.5, 2.0, 2.5, 3.0})
    grid_line(svg, panel, value, fmt::format("{:.1f}", value));
  for (const double value : {0.5, 1.0, 1.5, 2.0, 2.5})
    svg.text(panel.x(value), bottom + 18, fmt::format("{:.1f}", value), 12, "middle");
  axes(svg, panel, "y [m]");
  svg.line(panel.x(plate_radius), top, panel.x(plate_radius), bottom,
           {.stroke = grey, .width = 1, .dash = "3 3"});

  std::vector<std::pair<double, double>> curve;
  for (double y = plate_radius; y <= plate_width / 2; y += 0.01)
    curve.emplace_back(panel.x(y), panel.y(exact.stress({0, y})[0]));
  svg.polyline(curve, {.stroke = ink, .width = 1.5});
  const FrameColumn& stress = *frame.find("stress");
  for (Index p = 0; p < frame.size(); ++p) {
    const auto i = static_cast<std::size_t>(p);
    if (frame.coordinates[2 * i] < plate_cell / 4)
      svg.circle(panel.x(frame.coordinates[2 * i + 1]), panel.y(stress.values[6 * i] / plate_load),
                 2, {.fill = blue});
  }
  svg.line(636, 90, 660, 90, {.stroke = ink});
  svg.text(668, 94, "elasticity (exact)", 12);
  svg.circle(648, 110, 2.5, {.fill = blue});
  svg.text(668, 114, "Lahar, particles at x = 8 mm", 12);
}

// --- time against threads -----------------------------------------------------------------------

void draw_times(Svg& svg, const std::vector<ThreadTime>& times) {
  // Published and measured ranges of CB-Geo MPM on this case, one thread, two-core test machine.
  constexpr double cbgeo_low = 900, cbgeo_high = 1250;
  double least = times.front().nanoseconds / times.back().threads;
  for (const ThreadTime& t : times) least = std::min(least, t.nanoseconds);
  const double lowest = std::floor(std::log10(least / 2));
  Panel panel{940, 1280, 0.4, static_cast<double>(times.size()) + 0.6, lowest, 3.4};
  title(svg, panel.left - 45, "Time against threads",
        "nanoseconds per particle and step, logarithmic");
  for (double decade = lowest; decade <= 3; ++decade)
    grid_line(svg, panel, decade, fmt::format("{:g}", std::pow(10, decade)));
  svg.rectangle(panel.left, panel.y(std::log10(cbgeo_high)), panel.right - panel.left,
                panel.y(std::log10(cbgeo_low)) - panel.y(std::log10(cbgeo_high)),
                {.fill = "#c9b79c", .opacity = 0.6});
  svg.text(panel.left + 6, panel.y(std::log10(cbgeo_low)) + 16,
           "CB-Geo MPM, one thread: 900 to 1,250 ns", 12);
  svg.text(panel.left + 6, panel.y(std::log10(cbgeo_low)) + 31, "(measured on a two-core machine)",
           11, "start", "#5b6570");

  const double slot = panel.x(1) - panel.x(0), wide = std::min(46.0, 0.55 * slot);
  std::vector<std::pair<double, double>> ideal;
  for (std::size_t i = 0; i < times.size(); ++i) {
    const ThreadTime& t = times[i];
    const double centre = panel.x(static_cast<double>(i) + 1),
                 height = panel.y(std::log10(t.nanoseconds));
    svg.rectangle(centre - wide / 2, height, wide, bottom - height, {.fill = blue});
    svg.text(centre, height - 7, fmt::format("{:.1f}", t.nanoseconds), 12, "middle");
    svg.text(centre, bottom + 18, fmt::format("{}", t.threads), 12, "middle");
    const double perfect = panel.y(std::log10(times.front().nanoseconds / t.threads));
    svg.line(centre - wide / 2 - 5, perfect, centre + wide / 2 + 5, perfect,
             {.stroke = "#e07b39", .width = 2.5});
  }
  axes(svg, panel, "threads of Lahar");
  const double legend = panel.y(std::log10(cbgeo_low)) + 49;
  svg.line(panel.left + 6, legend, panel.left + 30, legend, {.stroke = "#e07b39", .width = 2.5});
  svg.text(panel.left + 38, legend + 4, "one thread's time divided by threads", 12);
}

}  // namespace

std::string plate_picture(const Frame& frame, const HoleSeries& exact,
                          const std::vector<ThreadTime>& times) {
  Svg svg(picture_width, picture_height);
  draw_field(svg, frame);
  draw_ligament(svg, frame, exact);
  draw_times(svg, times);
  return svg.finish();
}

}  // namespace lahar
