/// \file Rasters that are written: for maps of what a run did.
#pragma once

#include <span>
#include <string>

#include "physics/base/types.h"

namespace lahar {

/// Square cells; values go row by row with ascending y, and x within a row. NaN: no data.
struct RasterGrid {
  Index columns = 0, rows = 0;
  Vec<2> low = Vec<2>::Zero();  ///< [m] least corner, on the map
  double cell = 1;              ///< [m]
};

/// What files have in place of NaN.
inline constexpr double no_data = -9999;

/// An ESRI ASCII grid; numbers read back to the same bits.
std::string ascii_grid_text(const RasterGrid& grid, std::span<const double> values);

/// A GeoTIFF of doubles. `reference`: WKT of the coordinate reference system, or empty. Throws
/// IoError, and InputError in a build without GDAL.
void write_geotiff(const std::string& path, const RasterGrid& grid, const std::string& reference,
                   std::span<const double> values);

}  // namespace lahar
