// Shapes from files that cannot be used, and what is then said.
#include <doctest/doctest.h>

#include <cmath>
#include <limits>

#include "io/geometry/map_files.h"
#include "tests/io/geometry/map_samples.h"
#include "tests/io/scenario/broken_case.h"

using namespace lahar;
using namespace lahar::broken;
using namespace lahar::test;

namespace {

constexpr double unknown = std::numeric_limits<double>::quiet_NaN();

struct Case {
  std::string name;
  std::vector<Edit> files;
  std::string geometry, region, expected;  ///< all of the problems' lines, without what is shown
  std::string generator = "";              ///< more keys of it
};

/// A box of 8 x 8 x 4 m of cells of 1 m.
Edit scenario(const Case& c, const std::string& mesh) {
  return write("mpm.json", R"({
"mesh": {"structured": {"origin": [0, 0, 0], "cell_size": 1, "counts": [8, 8, 4]})" +
                               mesh + R"(},
"geometry": {)" + c.geometry +
                               R"(},
"particles": [{"generator": {"type": "region", "region": )" +
                               c.region + R"(, "material": "soil")" + c.generator + R"(}}],
"materials": [{"name": "soil", "type": "LinearElastic3D", "density": 2000,
  "youngs_modulus": 1e6, "poisson_ratio": 0.3}],
"analysis": {"type": "MPMExplicit3D", "dt": 0.001, "nsteps": 1}}
)");
}

/// Messages and hints alone: no places, and no lines of the scenario.
std::string messages(const std::string& text) {
  std::string out;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    std::string line = text.substr(begin, end - begin);
    begin = end + 1;
    const bool hint = line.starts_with("  hint: ");
    const auto mark = line.find(": error: ");
    if (!hint && mark == std::string::npos && !line.starts_with("accepted")) continue;
    if (mark != std::string::npos) line = line.substr(mark + 9);
    if (const auto pointer = line.rfind(" [/"); !hint && pointer != std::string::npos)
      line.resize(pointer);
    out += (hint ? line.substr(2) : line) + '\n';
  }
  return out;
}

void check_cases(const std::vector<Case>& cases, const std::string& mesh = "") {
  for (const Case& c : cases)
    for (const int team : {1, 3}) {
      CAPTURE(c.name);
      CAPTURE(team);
      std::vector<Edit> edits = c.files;
      edits.push_back(scenario(c, mesh));
      CHECK(messages(read(edits, {}, team)) == c.expected);
    }
}

GridSample grid(double x = 0, double y = 0, int cells = 8) {
  return {cells, cells, x, y, 1, [](double at, double) { return 1 + 0.2 * at; }};
}

GridSample of_height(double height) {
  return {8, 8, 0, 0, 1, [=](double, double) { return height; }};
}

const std::string dem = R"("ground": {"raster": "dem.asc"})", below = R"({"below": "ground"})";
const std::vector<Edit> good = {write("dem.asc", ascii_grid(grid()))};
const std::string field = R"("field": {"polygons": "field.json"})";
const std::string under = R"({"intersection": [{"under": "field"}, {"box": {"max": [9, 9, 2]}}]})";
const std::string origin_hint =
    "hint: \"map_origin\": [x, y] in mesh is the place on the map where the model has x = 0 and y "
    "= "
    "0\n";

Edit polygons(const std::vector<std::vector<std::vector<Vec<2>>>>& shapes) {
  return write("field.json", geojson(shapes));
}

}  // namespace

TEST_CASE("rasters that cannot be the ground of a model are refused") {
  if (!has_gdal()) return;
  check_cases({
      {"what is right is accepted", good, dem, below, "accepted\n"},
      {"a missing file",
       {},
       dem,
       below,
       "file 'dem.asc' does not exist\nhint: file names are relative to the scenario's folder\n"},
      {"an empty file", {write("dem.asc", "")}, dem, below, "file 'dem.asc' is empty\n"},
      {"a folder", {folder("dem.asc")}, dem, below, "file 'dem.asc' is a folder, not a file\n"},
      {"no raster",
       {write("dem.asc", "hello\n")},
       dem,
       below,
       "GDAL cannot read a raster from 'dem.asc': `dem.asc' not recognized as a supported file "
       "format.\nhint: ESRI ASCII grids and GeoTIFF are read; gdal_translate converts other "
       "formats\n"},
      {"elsewhere on the map",
       {write("dem.asc", ascii_grid(grid(430000, 5100000)))},
       dem,
       below,
       "the raster lies beside the mesh: it extends from (430000, 5100000) to (430008, 5100008), "
       "the mesh from (0, 0) to (8, 8)\n" +
           origin_hint},
      {"nothing but nodata",
       {write("dem.asc", ascii_grid(of_height(unknown)))},
       dem,
       below,
       "the raster has no value where the mesh is: all of it is nodata there\n"},
      {"below the mesh",
       {write("dem.asc", ascii_grid(of_height(-5)))},
       dem,
       below,
       "the region contains no particle\nhint: does it lie inside the mesh? per_cell may be too "
       "small for it\n"},
      {"in degrees",
       {write("dem.asc", geotiff(grid(), -4326))},
       dem,
       below,
       "'dem.asc' is in degrees: its coordinate reference system is WGS 84\nhint: transform it to "
       "one in metres, such as UTM: gdalwarp -t_srs for rasters, ogr2ogr -t_srs for polygons\n"},
      {"a list without files",
       {},
       R"("ground": {"raster": []})",
       below,
       "the list of files is empty\n"},
      {"a tile that is missing", good, R"("ground": {"raster": ["dem.asc", "east.asc"]})", below,
       "file 'east.asc' does not exist\nhint: file names are relative to the scenario's folder\n"},
      {"not a name",
       {},
       R"("ground": {"raster": 3})",
       below,
       "'raster' must be a file name or an array of texts, found number 3\n"},
      {"tiles in different reference systems",
       {write("a.tif", geotiff(grid(), 32633)), write("b.tif", geotiff(grid(8), 32632))},
       R"("ground": {"raster": ["a.tif", "b.tif"]})",
       below,
       "'a.tif' and 'b.tif' are in different coordinate reference systems: WGS 84 / UTM zone 33N "
       "and WGS 84 / UTM zone 32N\nhint: gdalwarp -t_srs transforms a raster\n"},
      {"surfaces in different reference systems",
       {write("dem.asc", geotiff(grid(), 32633)), write("bed.tif", geotiff(of_height(1), 32632))},
       dem + R"(, "bed": {"raster": "bed.tif"})",
       below,
       "'dem.asc' and 'bed.tif' are in different coordinate reference systems: WGS 84 / UTM zone "
       "33N "
       "and WGS 84 / UTM zone 32N\nhint: transform one of them: gdalwarp -t_srs for rasters, "
       "ogr2ogr "
       "-t_srs for polygons\n"},
      {"a thickness below zero",
       {good[0], write("t.asc", ascii_grid(of_height(-0.5)))},
       dem + R"(, "t": {"raster": "t.asc"}, "bed": {"surface": "ground", "lower_by": "t"})",
       R"({"between": ["bed", "ground"]})",
       "the thickness is -0.5 at x = 0.5, y = 0.5\nhint: a thickness must not be negative\n"},
      {"a thickness that is a polygon",
       {good[0], polygons({{{{1, 1}, {4, 1}, {4, 4}}}})},
       dem + ", " + field + R"(, "bed": {"surface": "ground", "lower_by": "field"})",
       below,
       "the geometry 'field' is polygons, not a surface\n"},
      {"two shapes", good, R"("ground": {"raster": "dem.asc", "points": [[0, 0, 1]]})", below,
       "the geometry 'ground' has several shapes: 'points', 'raster'\nhint: give one of 'points', "
       "'raster', 'surface', 'triangles', 'solid', 'polygons'\n"},
      {"a key of another shape", good, R"("ground": {"raster": "dem.asc", "where": "a = 1"})",
       below, "'where' needs 'polygons', whose features it selects\n"},
      {"a misspelt key", good, R"("ground": {"rastr": "dem.asc"})", below,
       "unknown key 'rastr' in a geometry\nhint: did you mean 'raster'?\n"},
      {"points that are no grid",
       {},
       R"("ground": {"points": [[0, 0, 1], [8, 0, 1], [0, 8, 1], [8, 7, 1]]})",
       below,
       "the points are no grid: 2 places in x and 3 in y make 6 points, found 4\nhint: give a "
       "point "
       "for each x and y that occur; other points are for files\n"},
      {"a point twice",
       {},
       R"("ground": {"points": [[0, 0, 1], [8, 0, 1], [0, 8, 1], [0, 0, 2]]})",
       below,
       "there is another point at this place in plan\n"},
  });
}

TEST_CASE("polygons and regions that name them wrongly are refused") {
  if (!has_gdal()) return;
  const Edit square = polygons({{{{1, 1}, {4, 1}, {4, 4}, {1, 4}}}});
  check_cases({
      {"what is right is accepted", {square}, field, under, "accepted\n"},
      {"a missing file",
       {},
       field,
       under,
       "file 'field.json' does not exist\nhint: file names are relative to the scenario's "
       "folder\n"},
      {"a file cut short",
       {write("field.json", geojson({{{{1, 1}, {4, 1}, {4, 4}}}}).substr(0, 80))},
       field,
       under,
       "GDAL cannot read polygons from 'field.json': Failed to read GeoJSON data\nhint: "
       "GeoJSON and shapefiles are read; ogr2ogr converts other formats\n"},
      {"an outline that crosses itself",
       {polygons({{{{1, 1}, {4, 4}, {4, 1}, {1, 4}}}})},
       field,
       under,
       "the polygon of feature 0 of 'field.json' is not simple: Self-intersection at or near point "
       "2.5 2.5\nhint: the outline must not cross or touch itself; ogr2ogr -makevalid mends "
       "many\n"},
      {"a hole outside",
       {polygons({{{{1, 1}, {4, 1}, {4, 4}}, {{6, 6}, {7, 6}, {7, 7}}}})},
       field,
       under,
       "the polygon of feature 0 of 'field.json' is not simple: Hole lies outside shell at or near "
       "point 6 6\nhint: the outline must not cross or touch itself; ogr2ogr -makevalid mends "
       "many\n"},
      {"no features", {polygons({})}, field, under, "'field.json' has no polygons\n"},
      {"a filter that nothing fits",
       {square},
       R"("field": {"polygons": "field.json", "where": "zone = 'upper'"})",
       under,
       "'field.json' has no polygons where zone = 'upper'\n"},
      {"elsewhere",
       {polygons({{{{1001, 1}, {1004, 1}, {1004, 4}}}})},
       field,
       under,
       "the polygons lie beside the mesh: they extend from (1001, 1) to (1004, 4), the mesh from "
       "(0, "
       "0) to (8, 8)\n" +
           origin_hint},
      {"below polygons",
       {square},
       field,
       R"({"below": "field"})",
       "'below' needs a surface, but the geometry 'field' is polygons\nhint: write \"under\"\n"},
      {"under a surface", good, dem, R"({"under": "ground"})",
       "'under' needs polygons, but the geometry 'ground' is a surface\nhint: write \"below\", "
       "\"above\" or \"between\"\n"},
      {"inside polygons",
       {square},
       field,
       R"({"inside": "field"})",
       "'inside' needs a solid, but the geometry 'field' is polygons\nhint: write \"under\"\n"},
      {"between three", good, dem, R"({"between": ["ground", "ground", "ground"]})",
       "'between' needs the names of two surfaces, found 3\nhint: [lower, upper]\n"},
      {"no name", good, R"("": {"raster": "dem.asc"})", R"({"all": true})",
       "a geometry needs a name\n"},
      {"no geometry at all",
       {},
       "",
       below,
       "there is no geometry named 'ground'\nhint: name surfaces, solids and polygons under "
       "\"geometry\"\n"},
  });
}

TEST_CASE("layers, spacings and cut cells that contradict each other are refused") {
  if (!has_gdal()) return;
  const std::string two = dem + R"(, "bed": {"surface": "ground", "lower_by": 0.5})";
  const std::string all = R"({"all": true})";
  check_cases({
      {"a spacing and a number", good, dem, below,
       "'spacing' and 'per_cell' both say how many particles a cell has\nhint: give one of them\n",
       R"(, "spacing": 0.5, "per_cell": 2)"},
      {"a spacing in other units", good, dem, below,
       "a spacing of 0.005 makes 200 particles along each edge of a cell, which is 1 wide; at most "
       "64 are possible\nhint: spacing is in metres\n",
       R"(, "spacing": 0.005)"},
      {"an unknown way to cut", good, dem, below,
       "'cut_cells' must be one of \"exact\", \"centres\", found \"exakt\"\nhint: did you mean "
       "\"exact\"?\n",
       R"(, "cut_cells": "exakt")"},
      {"a material besides those of layers", good, two, all,
       "each of the layers has its material\nhint: leave this one out\n",
       R"(, "layers": [{"below": "ground", "material": "soil"}])"},
  });
}

TEST_CASE("a model has its place on the map, or it is refused") {
  if (!has_gdal()) return;
  const std::vector<Edit> far = {write("dem.asc", ascii_grid(grid(430000, 5100000)))};
  check_cases({{"moved to the origin", far, dem, below,
                "accepted\nhint: the mesh extends from (0, 0, 0) to (8, 8, 4), the region from (0, "
                "0, 0) to (8, 8, 86002.6): move one of them, or make the mesh larger\n"}},
              R"(, "map_origin": [430000, 5100000])");
  check_cases({{"a number too many", far, dem, below,
                "'map_origin' must be [x, y], found 3 numbers\nthe raster lies beside the mesh: it "
                "extends from (430000, 5100000) to (430008, 5100008), the mesh from (0, 0) to (8, "
                "8)\n" +
                    origin_hint}},
              R"(, "map_origin": [430000, 5100000, 0])");
}
