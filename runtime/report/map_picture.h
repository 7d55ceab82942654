/// \file Maps of a run: rasters as pictures.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace lahar {

/// A raster of ESRI ASCII; rows from the north, NaN where there is no value.
struct MapRaster {
  int columns = 0, rows = 0;
  double left = 0, bottom = 0, cell = 0;  ///< [m] corner, and size of a cell
  std::vector<double> values;
};

/// Throws IoError where it is none.
MapRaster read_map(const std::filesystem::path& file);

/// As SVG for the page: axes in coordinates of the map, colours with a bar.
std::string map_picture(const MapRaster& map, const std::string& name, const std::string& unit);

}  // namespace lahar
