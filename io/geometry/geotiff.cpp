#ifdef LAHAR_GDAL_LIBRARY
#include <fmt/format.h>

#include <cmath>
#include <vector>

#include "io/geometry/gdal_library.h"
#include "io/geometry/raster_output.h"
#include "physics/base/error.h"

namespace lahar {

void write_geotiff(const std::string& path, const RasterGrid& grid, const std::string& reference,
                   std::span<const double> values) {
  const Gdal& functions = gdal();
  const QuietGdal quiet;
  const auto fail = [&] {
    throw IoError(fmt::format("GDAL cannot write '{}': {}", path, QuietGdal::said()));
  };
  const auto columns = static_cast<int>(grid.columns), rows = static_cast<int>(grid.rows);
  GDALDriverH driver = functions.GDALGetDriverByName("GTiff");
  if (!driver) fail();
  const Dataset file(
      functions.GDALCreate(driver, path.c_str(), columns, rows, 1, GDT_Float64, nullptr));
  if (!file) fail();
  double transform[] = {grid.low.x(), grid.cell, 0, grid.low.y() + grid.cell * rows, 0, -grid.cell};
  functions.GDALSetGeoTransform(file.get(), transform);
  if (!reference.empty()) functions.GDALSetProjection(file.get(), reference.c_str());
  GDALRasterBandH band = functions.GDALGetRasterBand(file.get(), 1);
  functions.GDALSetRasterNoDataValue(band, no_data);
  for (int row = 0; row < rows; ++row) {  // the first is the northernmost
    const auto from = values.subspan(static_cast<std::size_t>((rows - 1 - row) * grid.columns),
                                     static_cast<std::size_t>(columns));
    std::vector<double> line(from.begin(), from.end());
    for (double& value : line)
      if (std::isnan(value)) value = no_data;
    if (functions.GDALRasterIOEx(band, GF_Write, 0, row, columns, 1, line.data(), columns, 1,
                                 GDT_Float64, 0, 0, nullptr) != CE_None)
      fail();
  }
}

}  // namespace lahar
#endif
