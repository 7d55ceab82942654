#include "runtime/report/map_picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include "io/base/atomic_file.h"
#include "physics/base/error.h"
#include "runtime/picture/frame_picture.h"
#include "runtime/picture/svg.h"
#include "runtime/picture/view.h"
#include "runtime/report/html.h"

namespace lahar {

namespace {

constexpr double margin_left = 76, margin_top = 14, margin_bottom = 44;
constexpr int most_cells = 1 << 26;

}  // namespace

MapRaster read_map(const std::filesystem::path& file) {
  std::istringstream in(read_text_file(file));
  MapRaster map;
  double no_data = std::numeric_limits<double>::quiet_NaN();
  bool middle = false;
  std::string word;
  while (in >> word && std::isalpha(static_cast<unsigned char>(word[0])) != 0) {
    std::string text;
    in >> text;
    std::transform(word.begin(), word.end(), word.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    const double value = std::strtod(text.c_str(), nullptr);
    if (word == "ncols") map.columns = static_cast<int>(value);
    if (word == "nrows") map.rows = static_cast<int>(value);
    if (word.starts_with("xll")) map.left = value, middle = word.ends_with("center");
    if (word.starts_with("yll")) map.bottom = value;
    if (word == "cellsize") map.cell = value;
    if (word == "nodata_value") no_data = value;
  }
  if (middle) map.left -= 0.5 * map.cell, map.bottom -= 0.5 * map.cell;
  if (map.columns < 1 || map.rows < 1 || map.columns > most_cells / map.rows || !(map.cell > 0))
    throw IoError(fmt::format("cannot read {}: it is no raster of ESRI ASCII", file.string()));
  const auto cells = static_cast<std::size_t>(map.columns) * static_cast<std::size_t>(map.rows);
  do {
    const double value = std::strtod(word.c_str(), nullptr);
    map.values.push_back(value == no_data ? std::numeric_limits<double>::quiet_NaN() : value);
  } while (map.values.size() < cells && in >> word);
  if (map.values.size() < cells)
    throw IoError(fmt::format("cannot read {}: it has {} of {} values", file.string(),
                              map.values.size(), cells));
  return map;
}

std::string map_picture(const MapRaster& map, const std::string& name, const std::string& unit) {
  const ColourScale scale = scale_of(map.values);
  Image image(map.columns, map.rows);
  bool below = false, above = false;
  for (int j = 0; j < map.rows; ++j)
    for (int i = 0; i < map.columns; ++i) {
      const double value =
          map.values[static_cast<std::size_t>(j) * static_cast<std::size_t>(map.columns) +
                     static_cast<std::size_t>(i)];
      // Where nothing ever was there is nothing to see.
      if (!std::isfinite(value) || (value == 0 && scale.low == 0)) continue;
      image.at(i, j) = scale.colour(value);
      below |= value < scale.low;
      above |= value > scale.high;
    }
  View view{.name = {},
            .axes = {0, 1},
            .low = {map.left, map.bottom},
            .high = {map.left + map.columns * map.cell, map.bottom + map.rows * map.cell},
            .left = margin_left,
            .top = margin_top};
  view.fit({470, 420}, 0.05);
  const double bar = view.left + view.size[0] + 22;
  Svg svg(bar + colour_bar_width, view.top + std::max(view.size[1], 150.0) + margin_bottom, "none");
  svg.rectangle(view.left, view.top, view.size[0], view.size[1], {.fill = page_ink.ground});
  svg.image(view.left, view.top, view.size[0], view.size[1], image);
  view.draw_axes(svg, page_ink.text);
  draw_colour_bar(
      svg, {.scale = scale, .label = name, .unit = unit, .beyond_low = below, .beyond_high = above},
      bar, view.top, std::max(view.size[1], 150.0), page_ink);
  return svg.finish();
}

}  // namespace lahar
