// Rasters and polygons as GDAL reads them.
#include "io/geometry/map_files.h"

#include <doctest/doctest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>

#include "physics/base/error.h"
#include "tests/io/geometry/map_samples.h"
#include "tests/within.h"

namespace fs = std::filesystem;
using namespace lahar;
using namespace lahar::test;

namespace {

constexpr double unknown = std::numeric_limits<double>::quiet_NaN();

class Folder {
 public:
  Folder() : path_(fs::temp_directory_path() / ("lahar-maps-" + std::to_string(::getpid()))) {
    fs::remove_all(path_);
    fs::create_directories(path_);
  }
  ~Folder() { fs::remove_all(path_); }
  MapFile write(const std::string& name, const std::string& text) const {
    std::ofstream(path_ / name, std::ios::binary) << text;
    return {name, (path_ / name).string()};
  }

 private:
  fs::path path_;
};

double plane(double x, double y) {
  return 10 + 0.5 * x - 0.25 * y;
}

GridSample plane_grid(int columns, int rows, double x, double y, double cell) {
  return {columns, rows, x, y, cell, plane};
}

Surface<3> read_surface(const std::vector<MapFile>& files, const Vec<2>& low, const Vec<2>& high,
                        double finest) {
  const Raster raster(files);
  const Raster::Part part = raster.part(low, high, finest);
  return surface_of(part, raster.read(part, 0, part.rows), {0, 0});
}

/// What is said of a file, and its hint.
std::string complaint(const std::function<void()>& read) {
  try {
    read();
  } catch (const InputError& e) {
    return e.problems()[0].message + " (" + e.problems()[0].hint + ")";
  }
  return "accepted";
}

}  // namespace

TEST_CASE("an inclined plane is read exactly to the edges, from ASCII grids and GeoTIFFs") {
  if (!has_gdal()) return;
  const Folder folder;
  const GridSample grid = plane_grid(8, 6, 100, 200, 2.5);
  for (const MapFile& file :
       {folder.write("dem.asc", ascii_grid(grid)), folder.write("dem.tif", geotiff(grid, 32633))}) {
    CAPTURE(file.name);
    const auto surface = read_surface({file}, {100, 200}, {120, 215}, 1);
    for (const Vec<3>& x : {Vec<3>(100, 200, 0), Vec<3>(120, 215, 0), Vec<3>(107, 211.3, 0)})
      CHECK(surface.height(x) == within(1e-6, plane(x.x(), x.y())));
    CHECK(std::isnan(surface.height({99.9, 205, 0})));
    CHECK(std::isnan(surface.height({110, 215.1, 0})));
  }
}

TEST_CASE("a part of a raster that is finer than needed has the means of its cells") {
  if (!has_gdal()) return;
  const Folder folder;
  GridSample grid = plane_grid(90, 70, 0, 0, 1);
  grid.height = [](double x, double y) { return std::floor(x) * 2 + std::fmod(std::floor(y), 4); };
  const MapFile file = folder.write("dem.tif", geotiff(grid));
  const Raster raster({file});
  const Raster::Part part = raster.part({20, 30}, {50, 55}, 4.5);
  CHECK(part.factor == 4);
  const auto heights = raster.read(part, 0, part.rows);
  for (Index j = 0; j < part.rows; ++j)
    for (Index i = 0; i < part.columns; ++i) {
      const double x = part.first.x() + 4.0 * static_cast<double>(i);
      const double y0 = part.first.y() + 4.0 * static_cast<double>(j) - 2;
      double mean = 0;
      for (int k = 0; k < 4; ++k) mean += std::fmod(std::floor(y0 + k + 0.5), 4) / 4;
      // Cells around x lie at x - 1.5 to x + 1.5, and have the number of their left edge.
      CHECK(heights[static_cast<std::size_t>(j * part.columns + i)] ==
            within(1e-6, 2 * (x - 0.5) + mean));
    }
  // Read row by row it is the same, bit for bit.
  std::vector<float> rows;
  for (Index j = 0; j < part.rows; ++j) {
    const auto row = raster.read(part, j, j + 1);
    rows.insert(rows.end(), row.begin(), row.end());
  }
  CHECK(rows == heights);
}

TEST_CASE("a coarse part reaches to the edges of a raster, whatever its number of cells") {
  if (!has_gdal()) return;
  const Folder folder;
  for (const int columns : {10, 11, 12, 13}) {
    const MapFile file = folder.write("dem.tif", geotiff(plane_grid(columns, 9, 0, 0, 1)));
    const auto surface = read_surface({file}, {0, 0}, {columns * 1.0, 9}, 4);
    for (const Vec<3>& x : {Vec<3>(0, 0, 0), Vec<3>(columns, 9, 0), Vec<3>(columns, 0, 0)})
      CHECK(surface.height(x) == within(1e-6, plane(x.x(), x.y())));
  }
}

TEST_CASE("cells without data are not known, and do not count in means") {
  if (!has_gdal()) return;
  const Folder folder;
  GridSample grid = plane_grid(8, 8, 0, 0, 1);
  grid.height = [](double x, double y) {
    return x < 2 && y < 2 ? unknown : x > 4 && x < 5 ? unknown : 7;
  };
  const MapFile file = folder.write("dem.asc", ascii_grid(grid, -32768));
  const Raster raster({file});
  const Raster::Part fine = raster.part({0, 0}, {8, 8}, 1), coarse = raster.part({0, 0}, {8, 8}, 2);
  const auto a = raster.read(fine, 0, fine.rows), b = raster.read(coarse, 0, coarse.rows);
  CHECK(std::isnan(a[0]));
  CHECK(std::isnan(a[4]));
  CHECK(a[2] == 7);
  CHECK(std::isnan(b[0]));
  for (std::size_t i = 1; i < b.size(); ++i) CHECK(b[i] == 7);
}

TEST_CASE("a second value for unknown cells is refused where it is far from all others") {
  if (!has_gdal()) return;
  const Folder folder;
  const auto said = [&](double value, double declared, double finest, double others = 0.0) {
    GridSample grid = plane_grid(8, 8, 100, 0, 1);
    grid.height = [=](double x, double y) {
      return x > 104 && x < 105 && y < 1 ? value : x < 101 ? unknown : plane(x, y) + others;
    };
    const MapFile file = folder.write("dem.asc", ascii_grid(grid, declared));
    return complaint([&] { read_surface({file}, {100, 0}, {108, 8}, finest); });
  };
  for (const double finest : {1.0, 4.0}) {  // means of cells do not hide it
    CHECK(said(-9999, -32768, finest)
              .find("'dem.asc' has the value -9999 in 1 cells, the first at "
                    "(104.5, 0.5), and else from 58.") == 0);
    for (const double value : {-32768.0, -32767.0, -99999.0, -999.0, 9999.0, 1e20})
      CHECK(said(value, -9999, finest).find("looks like a second value") != std::string::npos);
  }
  CHECK(said(-9999, -32768, 1).find("gdalwarp -srcnodata -9999 -dstnodata -32768") !=
        std::string::npos);
  CHECK(said(-9999, -9999, 1) == "accepted");          // the declared one
  CHECK(said(-9999, -32768, 1, -9990) == "accepted");  // a depth among others
  CHECK(said(-80, -9999, 1) == "accepted");
}

TEST_CASE("tiles are one raster, with unknown heights where none lies") {
  if (!has_gdal()) return;
  const Folder folder;
  const std::vector<MapFile> tiles = {
      folder.write("a.tif", geotiff(plane_grid(8, 8, 0, 0, 1), 32633)),
      folder.write("b.asc", ascii_grid(plane_grid(8, 8, 8, 0, 1))),
      folder.write("c.asc", ascii_grid(plane_grid(8, 8, 8, 8, 1)))};
  folder.write("b.prj", utm_wkt(33));
  folder.write("c.prj", utm_wkt(33));
  for (const double finest : {1.0, 2.0}) {
    const auto surface = read_surface(tiles, {0, 0}, {16, 16}, finest);
    for (const Vec<3>& x : {Vec<3>(1, 1, 0), Vec<3>(8, 3, 0), Vec<3>(7.6, 5, 0), Vec<3>(12, 12, 0)})
      CHECK(surface.height(x) == within(1e-6, plane(x.x(), x.y())));
    CHECK(std::isnan(surface.height({3, 12, 0})));
  }
}

TEST_CASE("tiles that differ where they overlap are found, with the place") {
  if (!has_gdal()) return;
  const Folder folder;
  const auto gap = [&](double step, double shift) {
    GridSample east = plane_grid(8, 8, 6 + shift, 0, 1);
    east.height = [=](double x, double y) {
      return plane(x, y) + (x < 7 + shift && y > 3 && y < 4 ? step : 0);
    };
    return difference_of_tiles({folder.write("west.asc", ascii_grid(plane_grid(8, 8, 0, 0, 1))),
                                folder.write("east.asc", ascii_grid(east))},
                               {0, 0}, {14, 8}, true);
  };
  CHECK_FALSE(gap(0, 0));
  CHECK_FALSE(gap(0.05, 0));
  CHECK_FALSE(gap(0, 0.5));  // cells between those of the other
  CHECK_FALSE(gap(5, 2));    // beside each other
  const auto found = gap(-5, 0);
  REQUIRE(found);
  CHECK(found->difference == within(1e-5, 5));
  CHECK(found->x.isApprox(Vec<2>(6.5, 3.5)));
  CHECK(found->below == "west.asc");
  CHECK(found->above == "east.asc");
  CHECK(gap(5, 0.5));
  // No difference outside of the window, and none where a tile has no data.
  const MapFile west = folder.write("west.asc", ascii_grid(plane_grid(8, 8, 0, 0, 1)));
  GridSample high = plane_grid(8, 8, 6, 0, 1);
  high.height = [](double x, double y) { return plane(x, y) + 5; };
  const MapFile east = folder.write("east.asc", ascii_grid(high));
  CHECK(difference_of_tiles({west, east}, {0, 0}, {14, 8}, true));
  CHECK_FALSE(difference_of_tiles({west, east}, {0, 0}, {5, 8}, true));
  high.height = [](double x, double y) { return x < 8 ? unknown : plane(x, y) + 5; };
  folder.write("east.asc", ascii_grid(high));
  CHECK_FALSE(difference_of_tiles({west, east}, {0, 0}, {14, 8}, true));
}

TEST_CASE("rasters that are no heights of ground in metres are refused") {
  if (!has_gdal()) return;
  const Folder folder;
  const GridSample grid = plane_grid(4, 3, 10, 40, 0.1);
  const auto said = [&](const std::vector<MapFile>& files) {
    return complaint([&] { const Raster raster(files); });
  };
  CHECK(
      said({folder.write("degrees.tif", geotiff(grid, -4326))}) ==
      "'degrees.tif' is in degrees: its coordinate reference system is WGS 84 (transform it to one "
      "in metres, such as UTM: gdalwarp -t_srs for rasters, ogr2ogr -t_srs for polygons)");
  CHECK(said({folder.write("feet.tif", geotiff(grid, 2263))}).find("is not in metres") !=
        std::string::npos);
  CHECK(said({folder.write("text.asc", "no raster\n")})
            .find("GDAL cannot read a raster from 'text.asc': ") == 0);
  CHECK(said({folder.write("a.tif", geotiff(grid, 32633)),
              folder.write("b.tif", geotiff(grid, 32632))}) ==
        "'a.tif' and 'b.tif' are in different coordinate reference systems: WGS 84 / UTM zone 33N "
        "and WGS 84 / UTM zone 32N (gdalwarp -t_srs transforms a raster)");
  CHECK(said({folder.write("a.tif", geotiff(grid, 32633)), folder.write("c.tif", geotiff(grid))})
            .find("only one of 'a.tif' and 'c.tif' says its coordinate reference system") == 0);
  // Cut short: what is there may be read, what is not is refused.
  const std::string whole = geotiff(grid);
  CHECK(said({folder.write("head.tif", whole.substr(0, 40))})
            .find("GDAL cannot read a raster from 'head.tif'") == 0);
  std::string text = ascii_grid(grid);
  const MapFile cut = folder.write("cut.asc", text.substr(0, text.size() - 30));
  CHECK(complaint([&] {
          read_surface({cut}, {10, 40}, {10.4, 40.3}, 1);
        }).find("the raster cannot be read") == 0);
  CHECK(said({folder.write("garbled.asc", text.replace(text.find("ncols"), 7, "ncols x"))})
            .find("GDAL cannot read a raster from 'garbled.asc'") == 0);
}

TEST_CASE("polygons are read with holes and parts, from GeoJSON and shapefiles") {
  if (!has_gdal()) return;
  const Folder folder;
  const std::vector<std::vector<std::vector<Vec<2>>>> shapes = {
      {{{0, 0}, {0, 8}, {8, 8}, {8, 0}}, {{2, 2}, {4, 2}, {4, 4}, {2, 4}}},
      {{{10, 0}, {10, 3}, {14, 0}}}};
  const MapFile json = folder.write("release.geojson", geojson(shapes));
  const Shapefile files = shapefile(shapes);
  folder.write("release.shx", files.shx);
  folder.write("release.dbf", files.dbf);
  folder.write("release.prj", utm_wkt(33));
  const MapFile shape = folder.write("release.shp", files.shp);
  for (const MapFile& file : {json, shape}) {
    CAPTURE(file.name);
    const PolygonFile read = read_polygons(file, "");
    CHECK(read.polygons.size() == 2);
    const Outlines outlines(read.polygons);
    CHECK(outlines.contains({1, 1}, 0));
    CHECK(!outlines.contains({3, 3}, 0));
    CHECK(outlines.contains({11, 1}, 0));
    CHECK(read.reference.empty() == (file.name == json.name));
  }
  CHECK(read_polygons(json, "zone = '1'").polygons.size() == 1);
  CHECK(read_polygons(shape, "zone = 'a'").polygons[0].size() == 2);
  CHECK(reference_name(read_polygons(shape, "").reference).find("UTM") != std::string::npos);
}

TEST_CASE("files that have no simple polygons in metres are refused") {
  if (!has_gdal()) return;
  const Folder folder;
  const auto said = [&](const MapFile& file, const std::string& where = "") {
    return complaint([&] { read_polygons(file, where); });
  };
  const MapFile good = folder.write("good.geojson", geojson({{{{0, 0}, {9, 0}, {9, 9}}}}));
  CHECK(said(folder.write("bow.geojson", geojson({{{{0, 0}, {4, 4}, {4, 0}, {0, 4}}}}))) ==
        "the polygon of feature 0 of 'bow.geojson' is not simple: Self-intersection at or near "
        "point 2 2 (the outline must not cross or touch itself; ogr2ogr -makevalid mends many)");
  CHECK(said(folder.write("degrees.geojson", geojson({{{{10, 46}, {11, 46}, {11, 47}}}}, "")))
            .find("'degrees.geojson' is in degrees") == 0);
  CHECK(said(folder.write("metres.geojson",
                          geojson({{{{1000, 460}, {1100, 460}, {1100, 470}}}}, ""))) == "accepted");
  CHECK(said(folder.write("none.geojson", geojson({}))).find("'none.geojson' has no polygons") ==
        0);
  CHECK(said(good, "zone = 'upper'") == "'good.geojson' has no polygons where zone = 'upper' ()");
  CHECK(said(good, "depth > 2").find("'where' does not fit 'good.geojson'") == 0);
  CHECK(said(folder.write("text.geojson", "not JSON"))
            .find("GDAL cannot read polygons from 'text.geojson': ") == 0);
  std::string line = geojson({{{{0, 0}, {9, 0}, {9, 9}}}});
  line.replace(line.find("\"Polygon\""), 9, "\"MultiLineString\"");
  CHECK(said(folder.write("line.geojson", line)) ==
        "feature 0 of 'line.geojson' is a MULTILINESTRING, not a polygon ()");
  const std::string cut = geojson({{{{0, 0}, {9, 0}, {9, 9}}}});
  CHECK(said(folder.write("cut.geojson", cut.substr(0, cut.size() - 20))) != "accepted");
}

TEST_CASE("maps do not lead to other files or into the net") {
  if (!has_gdal()) return;
  const Folder folder;
  folder.write("dem.tif", geotiff(plane_grid(4, 3, 10, 40, 0.1)));
  const std::string virtual_raster =
      R"(<VRTDataset rasterXSize="4" rasterYSize="3"><GeoTransform>10,0.1,0,40.3,0,-0.1</GeoTransform>
<VRTRasterBand dataType="Float32" band="1"><SimpleSource>
<SourceFilename relativeToVRT="1">dem.tif</SourceFilename></SimpleSource></VRTRasterBand></VRTDataset>)";
  const std::string service =
      R"(<GDAL_WMS><Service name="TMS"><ServerUrl>http://127.0.0.1:9/${z}/${x}/${y}.png</ServerUrl>
</Service><DataWindow><UpperLeftX>0</UpperLeftX><UpperLeftY>4</UpperLeftY><LowerRightX>4</LowerRightX>
<LowerRightY>0</LowerRightY><TileLevel>2</TileLevel></DataWindow><BandsCount>1</BandsCount></GDAL_WMS>)";
  for (const std::string& text : {virtual_raster, service})
    CHECK(complaint([&] {
            const Raster raster({folder.write("other.tif", text)});
          }).find("GDAL cannot read a raster from 'other.tif'") == 0);
  const std::string layer = R"(<OGRVRTDataSource><OGRVRTLayer name="a">
<SrcDataSource>/etc/hosts</SrcDataSource></OGRVRTLayer></OGRVRTDataSource>)";
  CHECK(complaint([&] {
          read_polygons(folder.write("other.geojson", layer), "");
        }).find("GDAL cannot read polygons from 'other.geojson'") == 0);
}

TEST_CASE("files beside a map that may have no end are refused before GDAL waits for them") {
  if (!has_gdal()) return;
  const Folder folder;
  const MapFile grid = folder.write("dem.asc", ascii_grid(plane_grid(4, 3, 10, 40, 0.1)));
  const Shapefile files = shapefile({{{{0, 0}, {0, 8}, {8, 8}}}});
  const MapFile shape = folder.write("area.shp", files.shp);
  folder.write("area.shx", files.shx);
  const fs::path beside = fs::path(grid.path).parent_path();
  REQUIRE(::mkfifo((beside / "dem.prj").c_str(), 0600) == 0);
  REQUIRE(::mkfifo((beside / "area.dbf").c_str(), 0600) == 0);
  CHECK(complaint([&] { const Raster raster({grid}); }) ==
        "'dem.prj' beside 'dem.asc' is not a regular file (GDAL reads it together with the map; "
        "remove it)");
  CHECK(complaint([&] { read_polygons(shape, ""); }).find("'area.dbf' beside 'area.shp' is not") ==
        0);
  fs::remove(beside / "dem.prj");
  folder.write("dem.prj", std::string((1 << 20) + 1, ' '));
  CHECK(complaint([&] {
          const Raster raster({grid});
        }).find("'dem.prj' beside 'dem.asc' has 1.0 MiB; at most 1.0 MiB are read") == 0);
}

TEST_CASE("rasters and polygons have finite places, and rasters finite values") {
  if (!has_gdal()) return;
  const Folder folder;
  const auto said = [&](const GridSample& grid) {
    return complaint([&] { const Raster raster({folder.write("dem.tif", geotiff(grid))}); });
  };
  CHECK(said(plane_grid(4, 3, 0, 0, 1)) == "accepted");
  for (const GridSample& grid : {plane_grid(4, 3, unknown, 0, 1), plane_grid(4, 3, 0, 0, 1e308),
                                 plane_grid(4, 3, 1e300, 0, 1), plane_grid(4, 3, 1, 1, 1e-300)})
    CHECK(said(grid).find("'dem.tif' has cells of ") == 0);
  std::string far = geojson({{{{0, 0}, {9, 0}, {9, 9}}}});
  far.replace(far.find("[9, 0]"), 6, "[1e308, -1e308]");
  CHECK(complaint([&] { read_polygons(folder.write("far.geojson", far), ""); }) ==
        "feature 0 of 'far.geojson' has a corner at (1e+308, -1e+308) (coordinates are finite "
        "numbers of metres)");
  const auto moved = [&](const std::string& offset) {
    return complaint([&] {
      const MapFile file = folder.write("dem.tif", geotiff(plane_grid(4, 3, 0, 0, 1)));
      folder.write("dem.tif.aux.xml", "<PAMDataset><PAMRasterBand band=\"1\"><Offset>" + offset +
                                          "</Offset></PAMRasterBand></PAMDataset>");
      read_surface({file}, {0, 0}, {4, 3}, 1);
    });
  };
  CHECK(moved("100") == "accepted");
  CHECK(moved("inf").find("'dem.tif' has values that are numbers of the file times 1 plus inf") ==
        0);
  CHECK(moved("1e300") == "'dem.tif' has the value 1e+300 (is its scale or offset right?)");
}

TEST_CASE("cells that a file cannot have, and their memory, are known before they are read") {
  if (!has_gdal()) return;
  const Folder folder;
  std::string text = geotiff(plane_grid(4, 3, 0, 0, 1));
  // Columns, rows, and rows of a strip. The only strip has no data.
  const std::uint32_t many = 100000, none = 0;
  std::uint32_t head = 0;
  std::memcpy(&head, text.data() + 4, sizeof head);
  for (const std::size_t entry : {0, 1, 7})
    std::memcpy(text.data() + head + 2 + 12 * entry + 8, &many, sizeof many);
  for (const std::size_t entry : {5, 8})
    std::memcpy(text.data() + head + 2 + 12 * entry + 8, &none, sizeof none);
  const Raster raster({folder.write("sparse.tif", text)});
  const auto& [low, high] = raster.bounds();
  CHECK(complaint([&] {
          static_cast<void>(raster.part(low, high, 10));
        }).find("'sparse.tif' has 1e+10 cells where the mesh is, but only ") == 0);
  // Points that are means of 10,000 x 10,000 cells take all of these at once.
  const Raster::Part part = raster.part(high - Vec<2>(10, 10), high, 1e4);
  CHECK(part.factor == 10000);
  CHECK(raster.bytes_at_once(part) > 8e8);
}
