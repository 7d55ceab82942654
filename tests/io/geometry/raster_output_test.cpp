// Rasters that are written: their text, and what reading them gives.
#include "io/geometry/raster_output.h"

#include <doctest/doctest.h>

#include <cmath>
#include <iterator>
#include <limits>
#include <sstream>
#include <vector>

#include "io/geometry/map_files.h"
#include "tests/io/base/team_folder.h"
#include "tests/io/geometry/map_samples.h"

using namespace lahar;
using namespace lahar::test;

namespace {

constexpr double unknown = std::numeric_limits<double>::quiet_NaN();

/// Three columns and two rows; the second of the first row is not known.
const RasterGrid grid{.columns = 3, .rows = 2, .low = {652000.5, 5163001.25}, .cell = 2.5};
const std::vector<double> values{0.1, unknown, 2.5, 1e-5 / 3, 11.0 / 3, 4e6 / 7};

}  // namespace

TEST_CASE("the text of an ASCII grid has its least corner and begins in the north-west") {
  CHECK(ascii_grid_text(grid, std::vector{0.1, unknown, 2.5, -3.0, 4.5, 1e-5}) ==
        "ncols 3\nnrows 2\nxllcorner 652000.5\nyllcorner 5163001.25\ncellsize 2.5\n"
        "NODATA_value -9999\n-3 4.5 1e-05\n0.1 -9999 2.5\n");
}

TEST_CASE("numbers of an ASCII grid read back to the same bits") {
  std::istringstream text(ascii_grid_text(grid, values));
  std::string line;
  for (int k = 0; k < 6; ++k) std::getline(text, line);
  const std::vector<double> read{std::istream_iterator<double>(text), {}};
  CHECK(read == std::vector{values[3], values[4], values[5], values[0], no_data, values[2]});
}

TEST_CASE("rasters that are written are read where they were, without data where there was none") {
  if (!has_gdal()) return;
  const Folder folder;
  const auto path = [&](const std::string& name) { return (folder.path / name).string(); };
  folder.write("map.asc", ascii_grid_text(grid, values));
  write_geotiff(path("map.tif"), grid, utm_wkt(33), values);
  write_geotiff(path("nowhere.tif"), grid, "", values);
  for (const std::string name : {"map.asc", "map.tif", "nowhere.tif"}) {
    CAPTURE(name);
    const Raster raster({{name, path(name)}});
    CHECK(raster.bounds().first == Vec<2>(652000.5, 5163001.25));
    CHECK(raster.bounds().second == Vec<2>(652008, 5163006.25));
    if (name == "map.tif") CHECK(raster.reference().empty() == (name != "map.tif"));
    if (name == "map.tif") CHECK(same_reference(raster.reference(), utm_wkt(33)));
    const auto part = raster.part(raster.bounds().first, raster.bounds().second, 1);
    CHECK(part.first == Vec<2>(652001.75, 5163002.5));
    REQUIRE(part.columns == 3);
    REQUIRE(part.rows == 2);
    const std::vector<float> read = raster.read(part, 0, 2);
    for (std::size_t k = 0; k < values.size(); ++k)
      if (std::isnan(values[k]))
        CHECK(std::isnan(read[k]));
      else
        CHECK(read[k] == static_cast<float>(values[k]));
  }
}
