/// \file Lines over an axis.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "runtime/picture/drawing.h"
#include "runtime/picture/frame_picture.h"

namespace lahar {

struct ChartLine {
  std::string name, colour;
  std::vector<double> x, y;
};

struct Chart {
  std::string title;
  std::string x_name = "time", x_unit = "s";
  std::string y_name, y_unit;
  bool from_zero = true;  ///< the vertical axis has zero on it
  bool whole = false;     ///< values are numbers of things
  std::vector<ChartLine> lines;
  std::vector<std::pair<double, std::string>> marks;  ///< vertical lines, as where stages begin
};

/// True if a line has points to draw.
bool has_points(const Chart& chart);

/// Where values are in a picture [px], and in which units.
struct ChartScale {
  double left = 0, top = 0, width = 0, height = 0;
  double x_low = 0, x_high = 1, y_low = 0, y_high = 1;  ///< in shown units
  std::string x_unit, y_unit;
};

/// Draw into a picture of this size; points that one cannot tell apart are left out. Names of lines
/// are for a legend beside it.
ChartScale draw_chart(Drawing& drawing, const Chart& chart, double width, double height,
                      const Ink& ink = {});

}  // namespace lahar
