#include "runtime/report/map_picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <utility>

#include "io/base/atomic_file.h"
#include "physics/base/error.h"

namespace lahar {

namespace {

constexpr double margin_left = 76, margin_top = 14, margin_bottom = 44, title_height = 22,
                 bar_distance = 22, least_bar = 150;
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

MapPicture::MapPicture(const MapRaster& map, Options options)
    : options_(std::move(options)),
      scale_(options_.scale ? *options_.scale : scale_of(map.values)),
      image_(map.columns, map.rows) {
  for (int j = 0; j < map.rows; ++j)
    for (int i = 0; i < map.columns; ++i) {
      const double value =
          map.values[static_cast<std::size_t>(j) * static_cast<std::size_t>(map.columns) +
                     static_cast<std::size_t>(i)];
      // Where nothing ever was there is nothing to see.
      if (!std::isfinite(value) || (value == 0 && scale_.low == 0)) continue;
      image_.at(i, j) = scale_.colour(value);
      beyond_low_ |= value < scale_.low;
      beyond_high_ |= value > scale_.high;
    }
  view_.axes = {0, 1};
  view_.low = {map.left, map.bottom};
  view_.high = {map.left + map.columns * map.cell, map.bottom + map.rows * map.cell};
  view_.left = margin_left;
  view_.top = options_.title.empty() ? margin_top : margin_top + title_height;
  view_.fit({options_.largest_width, options_.largest_height}, 0.05);
  width_ = view_.left + view_.size[0] + bar_distance + colour_bar_width;
  height_ = view_.top + std::max(view_.size[1], least_bar) + margin_bottom;
}

void MapPicture::draw(Drawing& drawing) const {
  const Ink& ink = options_.ink;
  if (!options_.title.empty()) drawing.text(view_.left, 22, options_.title, 15, "start", ink.text);
  drawing.rectangle(view_.left, view_.top, view_.size[0], view_.size[1], {.fill = ink.ground});
  drawing.image(view_.left, view_.top, view_.size[0], view_.size[1], image_);
  view_.draw_axes(drawing, ink.text);
  draw_colour_bar(drawing,
                  {.scale = scale_,
                   .label = options_.name,
                   .unit = options_.unit,
                   .beyond_low = beyond_low_,
                   .beyond_high = beyond_high_},
                  view_.left + view_.size[0] + bar_distance, view_.top,
                  std::max(view_.size[1], least_bar), ink);
}

}  // namespace lahar
