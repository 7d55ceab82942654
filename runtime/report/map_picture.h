/// \file Maps of a run: rasters as pictures.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "runtime/picture/frame_picture.h"
#include "runtime/picture/view.h"

namespace lahar {

/// A raster of ESRI ASCII; rows from the north, NaN where there is no value.
struct MapRaster {
  int columns = 0, rows = 0;
  double left = 0, bottom = 0, cell = 0;  ///< [m] corner, and size of a cell
  std::vector<double> values;
};

/// Throws IoError where it is none.
MapRaster read_map(const std::filesystem::path& file);

/// Axes in coordinates of the map, colours with a bar.
class MapPicture {
 public:
  struct Options {
    std::string name, unit;
    std::string title;
    Ink ink;
    std::optional<ColourScale> scale;                  ///< default: scale_of() the map
    double largest_width = 470, largest_height = 420;  ///< [px] of the raster
  };
  MapPicture(const MapRaster& map, Options options);

  double width() const { return width_; }
  double height() const { return height_; }
  void draw(Drawing& drawing) const;

 private:
  Options options_;
  ColourScale scale_;
  Image image_;
  View view_{};
  double width_ = 0, height_ = 0;                  ///< [px]
  bool beyond_low_ = false, beyond_high_ = false;  ///< there are values beyond the scale
};

}  // namespace lahar
