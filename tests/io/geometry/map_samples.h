/// \file Small maps as files: ESRI ASCII grids, GeoTIFFs, GeoJSON and shapefiles, byte by byte.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "physics/base/types.h"

namespace lahar::test {

/// Heights of cells [m]; the first row is in the north.
struct GridSample {
  int columns = 4, rows = 3;
  double x = 0, y = 0, cell = 1;                     ///< lower left corner and size of cells [m]
  std::function<double(double x, double y)> height;  ///< of the centre of a cell; NaN: not known
};

/// Text of an ESRI ASCII grid.
std::string ascii_grid(const GridSample& grid, double no_data = -9999);

/// A GeoTIFF of floats. `epsg`: its coordinate reference system; 0 = none, below 0: geographic.
std::string geotiff(const GridSample& grid, int epsg = 0);

/// GeoJSON of rings, each list one polygon with holes; `members` is added to the collection, such
/// as
/// "\"crs\": null, ". Feature i has the property zone = "i".
std::string geojson(const std::vector<std::vector<std::vector<Vec<2>>>>& polygons,
                    const std::string& members = R"("crs": null, )");

/// The files .shp, .shx and .dbf of polygons (with the field `zone`, one letter: a, b, ...).
struct Shapefile {
  std::string shp, shx, dbf;
};
Shapefile shapefile(const std::vector<std::vector<std::vector<Vec<2>>>>& polygons);

/// WKT of UTM zones, for files .prj.
std::string utm_wkt(int zone);

}  // namespace lahar::test
