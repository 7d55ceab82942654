// What a build without GDAL says.
#ifndef LAHAR_GDAL_LIBRARY
#include "io/geometry/map_files.h"
#include "io/geometry/raster_output.h"
#include "physics/base/error.h"

namespace lahar {

namespace {

[[noreturn]] void refuse() {
  throw InputError({Problem{.message = "rasters and polygons need GDAL, which this build lacks",
                            .hint = "install the package libgdal-dev, configure with "
                                    "-DLAHAR_GDAL=ON and build again"}});
}

}  // namespace

bool has_gdal() {
  return false;
}
struct Raster::Source {};
Raster::Raster(const std::vector<MapFile>&, std::string_view) {
  refuse();
}
Raster::~Raster() = default;
Raster::Part Raster::part(const Vec<2>&, const Vec<2>&, double) const {
  refuse();
}
Index Raster::rows_at_once(const Part&) const {
  refuse();
}
double Raster::bytes_at_once(const Part&) const {
  refuse();
}
std::vector<float> Raster::read(const Part&, Index, Index) const {
  refuse();
}
std::optional<TileDifference> difference_of_tiles(const std::vector<MapFile>&, const Vec<2>&,
                                                  const Vec<2>&, bool, double) {
  refuse();
}
std::string reference_name(const std::string&) {
  refuse();
}
bool same_reference(const std::string&, const std::string&) {
  refuse();
}
void write_geotiff(const std::string&, const RasterGrid&, const std::string&,
                   std::span<const double>) {
  refuse();
}
PolygonFile read_polygons(const MapFile&, const std::string&) {
  refuse();
}

}  // namespace lahar
#endif
