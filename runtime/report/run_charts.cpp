#include "runtime/report/run_charts.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>
#include <span>
#include <string_view>

#include "runtime/report/html.h"

namespace lahar {

namespace {

/// A column over the time of all stages; nothing joins the stages.
ChartLine line_of(const RunResults& run, const char* column, const std::string& name,
                  std::size_t colour) {
  ChartLine line{.name = name, .colour = line_colour(colour), .x = {}, .y = {}};
  constexpr double gap = std::numeric_limits<double>::quiet_NaN();
  for (const RunPart& part : run.parts) {
    if (!part.history.find(column)) continue;
    if (!line.x.empty()) line.x.push_back(part.begin), line.y.push_back(gap);
    for (const double time : part.history.values("time")) line.x.push_back(part.begin + time);
    // Before the first step there is no time step.
    const bool positive = std::string_view(column) == "dt";
    for (const double value : part.history.values(column))
      line.y.push_back(positive && value == 0 ? gap : value);
  }
  return line;
}

bool varies(const ChartLine& line) {
  double low = std::numeric_limits<double>::max(), high = std::numeric_limits<double>::lowest();
  for (const double value : line.y)
    if (std::isfinite(value)) low = std::min(low, value), high = std::max(high, value);
  return high - low > 1e-12 * std::max(std::abs(low), std::abs(high));
}

bool any_value(const ChartLine& line) {
  return std::any_of(line.y.begin(), line.y.end(),
                     [](double v) { return std::isfinite(v) && v != 0; });
}

/// Where stages begin, of the only run.
std::vector<std::pair<double, std::string>> marks_of(const std::vector<RunResults>& runs) {
  std::vector<std::pair<double, std::string>> marks;
  if (runs.size() == 1 && runs[0].parts.size() > 1)
    for (const RunPart& part : runs[0].parts) marks.emplace_back(part.begin, part.name);
  return marks;
}

struct Quantity {
  const char *column, *title, *name, *unit;
  bool from_zero;
  bool always;  ///< also where it does not vary
};

/// A chart for each quantity, with a line of each run.
std::vector<Chart> by_quantity(const std::vector<RunResults>& runs,
                               std::span<const Quantity> quantities) {
  std::vector<Chart> list;
  for (const Quantity& q : quantities) {
    Chart chart{.title = q.title,
                .y_name = q.name,
                .y_unit = q.unit,
                .from_zero = q.from_zero,
                .whole = std::string_view(q.unit) == "-",
                .lines = {},
                .marks = marks_of(runs)};
    bool shown = false;
    for (std::size_t r = 0; r < runs.size(); ++r) {
      chart.lines.push_back(
          line_of(runs[r], q.column, runs.size() > 1 ? runs[r].label : q.name, r));
      shown |= varies(chart.lines.back()) || (q.always && any_value(chart.lines.back()));
    }
    if (shown) list.push_back(std::move(chart));
  }
  return list;
}

constexpr std::array energies{
    Quantity{"kinetic", "Kinetic energy", "kinetic", "J", true, false},
    Quantity{"internal", "Internal energy", "internal", "J", true, false},
    Quantity{"external", "External work", "external work", "J", true, false},
    Quantity{"damping", "Energy taken by damping", "damping", "J", true, false},
    Quantity{"friction", "Part of the damping: friction", "friction", "J", true, false}};

constexpr std::array others{
    Quantity{"balance", "Balance of energy (numerical drift)", "balance", "J", true, true},
    Quantity{"max_speed", "Largest speed of particles", "speed", "m/s", true, true},
    Quantity{"momentum_x", "Momentum along x", "momentum", "kg m/s", true, false},
    Quantity{"momentum_y", "Momentum along y", "momentum", "kg m/s", true, false},
    Quantity{"momentum_z", "Momentum along z", "momentum", "kg m/s", true, false},
    Quantity{"dt", "Time step", "time step", "s", true, true},
    Quantity{"mass", "Mass", "mass", "kg", false, false},
    Quantity{"particles", "Number of particles", "particles", "-", false, false},
    Quantity{"divided", "Increments of materials done in parts", "increments", "-", true, false},
};

/// Rows of a body, as a line.
ChartLine body_line(const RunResults& run, const std::string& body, const std::string& column,
                    const std::string& name, std::size_t colour) {
  ChartLine line{.name = name, .colour = line_colour(colour), .x = {}, .y = {}};
  for (const RunPart& part : run.parts) {
    const TableColumn* names = part.bodies.find("body");
    const TableColumn* values = part.bodies.find(column);
    if (!names || !values || names->texts.empty()) continue;
    const std::vector<double> time = part.bodies.values("time");
    for (std::size_t k = 0; k < time.size(); ++k)
      if (names->texts[k] == body) {
        line.x.push_back(part.begin + time[k]);
        line.y.push_back(values->values[k]);
      }
  }
  return line;
}

}  // namespace

std::vector<Chart> history_charts(const std::vector<RunResults>& runs) {
  std::vector<Chart> list;
  if (runs.size() == 1) {
    Chart chart{.title = "Energies",
                .y_name = "energy",
                .y_unit = "J",
                .from_zero = true,
                .whole = false,
                .lines = {},
                .marks = marks_of(runs)};
    for (std::size_t k = 0; k < energies.size(); ++k) {
      ChartLine line = line_of(runs[0], energies[k].column, energies[k].name, k);
      if (any_value(line)) chart.lines.push_back(std::move(line));
    }
    if (!chart.lines.empty()) list.push_back(std::move(chart));
  } else {
    list = by_quantity(runs, energies);
  }
  for (Chart& chart : by_quantity(runs, others)) list.push_back(std::move(chart));
  return list;
}

std::vector<Chart> body_charts(const std::vector<RunResults>& runs) {
  std::vector<std::string> bodies;
  for (const RunResults& run : runs)
    for (const RunPart& part : run.parts)
      if (const TableColumn* names = part.bodies.find("body"); names)
        for (const std::string& name : names->texts)
          if (std::find(bodies.begin(), bodies.end(), name) == bodies.end()) bodies.push_back(name);
  struct Group {
    const char *title, *prefix, *unit;
  };
  std::vector<Chart> list;
  for (const std::string& body : bodies)
    for (const auto& [title, prefix, unit] :
         {Group{"force of particles", "force", "N"}, Group{"velocity", "velocity", "m/s"},
          Group{"place", "", "m"}}) {
      Chart chart{.title = fmt::format("{}: {}", body, title),
                  .y_name = title,
                  .y_unit = unit,
                  .from_zero = *prefix != '\0',
                  .whole = false,
                  .lines = {},
                  .marks = marks_of(runs)};
      for (std::size_t r = 0; r < runs.size(); ++r)
        for (std::size_t d = 0; d < 3; ++d) {
          const std::string axis(1, "xyz"[d]);
          ChartLine line = body_line(
              runs[r], body, *prefix ? fmt::format("{}_{}", prefix, axis) : axis,
              runs.size() > 1 ? fmt::format("{} {}", runs[r].label, axis) : axis, 3 * r + d);
          if (varies(line)) chart.lines.push_back(std::move(line));
        }
      if (!chart.lines.empty()) list.push_back(std::move(chart));
    }
  return list;
}

namespace {

/// Lines of a gauge along a line, at a few times of its table, over the distance.
std::vector<ChartLine> profiles(const Table& table, const TableColumn& column,
                                const std::string& label) {
  constexpr std::size_t shown = 4;
  const std::vector<double> time = table.values("time"), distance = table.values("distance");
  std::vector<std::size_t> begins;  // rows with which a time begins
  for (std::size_t k = 0; k < time.size(); ++k)
    if (k == 0 || time[k] != time[k - 1]) begins.push_back(k);
  std::vector<ChartLine> lines;
  for (std::size_t i = 0; i < std::min(shown, begins.size()); ++i) {
    const std::size_t at = begins.size() <= shown ? i : i * (begins.size() - 1) / (shown - 1);
    const auto from = static_cast<std::ptrdiff_t>(begins[at]);
    const auto to =
        static_cast<std::ptrdiff_t>(at + 1 < begins.size() ? begins[at + 1] : time.size());
    lines.push_back({.name = fmt::format("{}{:.3g} s", label, time[begins[at]]),
                     .colour = {},
                     .x = {distance.begin() + from, distance.begin() + to},
                     .y = {column.values.begin() + from, column.values.begin() + to}});
  }
  return lines;
}

/// Charts of gauges along lines: a chart for each column that is not a place.
void add_profiles(std::vector<Chart>& list, const std::vector<RunResults>& runs,
                  const std::string& gauge, const TableColumn& column) {
  Chart chart{.title = fmt::format("{}: {}", gauge, column.name),
              .x_name = "distance",
              .x_unit = "m",
              .y_name = column.name,
              .y_unit = column.unit,
              .from_zero = true,
              .whole = false,
              .lines = {},
              .marks = {}};
  for (const RunResults& run : runs)
    for (const GaugeSeries& one : run.last().gauges)
      if (const TableColumn* found = one.table.find(column.name); found && one.name == gauge)
        for (ChartLine& line :
             profiles(one.table, *found, runs.size() > 1 ? run.label + " " : "")) {
          line.colour = line_colour(chart.lines.size());
          chart.lines.push_back(std::move(line));
        }
  for (std::string* text : {&chart.title, &chart.y_name}) *text = readable(*text);
  list.push_back(std::move(chart));
}

bool is_place(const std::string& column) {
  return column == "distance" || column == "x" || column == "y" || column == "z";
}

}  // namespace

std::vector<Chart> gauge_charts(const std::vector<RunResults>& runs) {
  std::vector<Chart> list;
  std::set<std::pair<std::string, std::string>> done;
  const auto lines_of = [&](const std::string& gauge, const std::string& column) {
    std::vector<ChartLine> lines;
    for (std::size_t r = 0; r < runs.size(); ++r) {
      ChartLine line{.name = runs.size() > 1 ? runs[r].label : column,
                     .colour = line_colour(r),
                     .x = {},
                     .y = {}};
      for (const RunPart& part : runs[r].parts)
        for (const GaugeSeries& one : part.gauges)
          if (const TableColumn* found = one.table.find(column); found && one.name == gauge) {
            for (const double time : one.table.values("time")) line.x.push_back(part.begin + time);
            line.y.insert(line.y.end(), found->values.begin(), found->values.end());
          }
      if (!line.x.empty()) lines.push_back(std::move(line));
    }
    return lines;
  };
  for (const RunResults& run : runs)
    for (const RunPart& part : run.parts)
      for (const GaugeSeries& gauge : part.gauges)
        for (const TableColumn& column : gauge.table.columns) {
          if (column.name == "step" || column.name == "time") continue;
          if (gauge.table.find("id")) continue;  // tracks of single particles
          if (!done.emplace(gauge.name, column.name).second) continue;
          if (gauge.table.find("distance")) {
            if (!is_place(column.name)) add_profiles(list, runs, gauge.name, column);
            continue;
          }
          const std::string name = readable(column.name);
          list.push_back({.title = fmt::format("{}: {}", gauge.name, name),
                          .y_name = name,
                          .y_unit = column.unit,
                          .from_zero = true,
                          .whole = false,
                          .lines = lines_of(gauge.name, column.name),
                          .marks = marks_of(runs)});
        }
  return list;
}

double balance_share(const RunResults& run) {
  double drift = 0, largest = 0;
  for (const RunPart& part : run.parts) {
    for (const double value : part.history.values("balance"))
      drift = std::max(drift, std::abs(value));
    for (const Quantity& q : energies)
      for (const double value : part.history.values(q.column))
        largest = std::max(largest, std::abs(value));
  }
  return largest > 0 ? drift / largest : 0;
}

}  // namespace lahar
