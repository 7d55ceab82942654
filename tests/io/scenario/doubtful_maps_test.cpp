// Warnings of terrain with holes and of polygons that the mesh's border cuts, of loads on more than
// a surface, of particles that are further apart than cells; and silence where all is well.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <string>

#include "io/geometry/map_files.h"
#include "io/scenario/scenario.h"
#include "tests/io/base/team_folder.h"
#include "tests/io/base/thread_team.h"
#include "tests/io/geometry/map_samples.h"
#include "tests/io/scenario/said.h"

using namespace lahar;
using namespace lahar::test;

namespace {

constexpr double unknown = std::numeric_limits<double>::quiet_NaN();

/// Soil of 8 x 8 m under polygons, on a rigid bed.
std::string on_bed(const std::string& area = "field") {
  return fmt::format(R"({{"mesh": {{"structured": {{"cell_size": 1, "counts": [8, 8, 5]}}}},
    "geometry": {{"bed": {{"raster": "bed.asc"}}, "field": {{"polygons": "field.json"}}}},
    "materials": [{{"name": "clay", "type": "LinearElastic3D", "density": 2000,
                    "youngs_modulus": 1e7, "poisson_ratio": 0.3}}],
    "rigid_bodies": [{{"name": "hill", "region": {{"below": "bed"}}, "friction": 0.4}}],
    "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": "clay",
       "region": {{"intersection": [{{"above": "bed"}}, {{"under": "{}"}},
                                    {{"box": {{"min": [-9, -9, 0], "max": [99, 99, 3]}}}}]}}}}}}],
    "external_loading_conditions": {{"gravity": [0, 0, -9.81]}},
    "analysis": {{"nsteps": 1}}}})",
                     area);
}

std::string said_of(const Folder& folder, const std::string& text) {
  folder.write("case.json", text);
  return warnings_of(read_scenario(folder.path / "case.json"));
}

GridSample bed_of(const std::function<double(double, double)>& height) {
  return {10, 10, -1, -1, 1, height};
}

std::string square(double from, double to) {
  return geojson({{{{from, 2}, {to, 2}, {to, 6}, {from, 6}}}});
}

/// A block of 2 x 2 m of cells of 0.5 m that is pulled at its rows above a height.
std::string pulled(double above, const std::string& fineness = R"("per_cell": 2)") {
  return fmt::format(R"({{"mesh": {{"structured": {{"cell_size": 0.5, "counts": [8, 8]}}}},
    "sets": {{"particles": {{"loaded": {{"half_space": {{"point": [0, {}], "normal": [0, -1]}}}}}}}},
    "materials": [{{"name": "clay", "type": "LinearElastic2D", "density": 2000,
                    "youngs_modulus": 1e7, "poisson_ratio": 0.3}}],
    "particles": [{{"generator": {{"type": "region", {}, "material": "clay",
       "region": {{"box": {{"min": [1, 0], "max": [3, 2]}}}}}}}}],
    "external_loading_conditions": {{"particle_surface_traction":
        [{{"pset": "loaded", "dir": "x", "traction": 100}}]}},
    "analysis": {{"nsteps": 1}}}})",
                     above, fineness);
}

}  // namespace

TEST_CASE("terrain without heights in a part of the mesh is warned of, with where") {
  if (!has_gdal()) return;
  const Folder folder;
  folder.write("field.json", square(2, 6));
  folder.write("bed.asc", ascii_grid(bed_of([](double, double) { return 1.0; })));
  CHECK(said_of(folder, on_bed()) == "");
  folder.write("bed.asc", ascii_grid(bed_of([](double x, double y) {
                 return x > 4 && x < 6 && y > 3 && y < 4 ? unknown : 1.0;
               })));
  const std::string said = said_of(folder, on_bed());
  CHECK(says(said,
             "the surface 'bed' has no height at 2 of its 64 places over the mesh, "
             "the first at x = 4.5, y = 3.5: the rigid body has holes there"));
}

TEST_CASE("values that usually mean no data, but are not declared, are refused") {
  if (!has_gdal()) return;
  const Folder folder;
  folder.write("field.json", square(2, 6));
  const auto grid = bed_of([](double x, double) { return x > 7 ? -9999 : 1.0; });
  std::string text = ascii_grid(grid);
  const auto line = text.find("NODATA_value");
  text.erase(line, text.find('\n', line) + 1 - line);
  folder.write("bed.asc", text);
  const auto refusal = [&](const std::string& scenario) {
    return refusal_of([&] { said_of(folder, scenario); });
  };
  CHECK(says(refusal(on_bed()), "'bed.asc' has the value -9999, which means in most rasters"));
  // Where means over cells are taken, too.
  std::string coarse = on_bed();
  coarse.replace(coarse.find("\"cell_size\": 1"), 14, "\"cell_size\": 6");
  CHECK(says(refusal(coarse), "'bed.asc' has the value -9999"));
  folder.write("bed.tif", geotiff(grid));
  std::string other = on_bed();
  other.replace(other.find("bed.asc"), 7, "bed.tif");
  CHECK(says(refusal(other), "'bed.tif' has the value -9999"));
}

TEST_CASE("polygons of particles that reach beyond the mesh are warned of, with how far") {
  if (!has_gdal()) return;
  const Folder folder;
  folder.write("bed.asc", ascii_grid(bed_of([](double, double) { return 1.0; })));
  folder.write("field.json", square(2, 12));
  CHECK(says(said_of(folder, on_bed()),
             "the polygons 'field' reach beyond the mesh, over 4 m of "
             "its side x = 8: what lies outside gets no particles"));
  folder.write("field.json", square(2, 8));
  CHECK(said_of(folder, on_bed()) == "");
  folder.write("field.json", square(-20, 40));  // all of the mesh is meant
  CHECK(said_of(folder, on_bed()) == "");
}

TEST_CASE("tractions on particles behind each other are warned of, on any ranks") {
  const Folder folder;
  CHECK(said_of(folder, pulled(1.75)) == "");
  const std::string said = said_of(folder, pulled(1.4));
  CHECK(says(said,
             "on particles that lie behind each other, 2 in the mean: each gets it, so the "
             "load is as many times that of a surface"));
  run_team(3, [&](const Team& team) {
    CHECK(warnings_of(read_scenario(folder.path / "case.json", {{}, false, &team})) == said);
  });
}

TEST_CASE("particles further apart than cells are warned of") {
  const Folder folder;
  CHECK(says(said_of(folder, pulled(1.75, R"("spacing": 1)")),
             "a spacing of 1 is wider than a cell, 0.5: each cell gets a particle"));
  CHECK_FALSE(says(said_of(folder, pulled(1.75, R"("spacing": 0.5)")), "wider than a cell"));
}

TEST_CASE("a yield stress whose viscosity at rest makes steps short is warned of") {
  const Folder folder;
  const auto with_rate = [&](const char* rate) {
    std::string text = pulled(1.75);
    const auto from = text.find("\"type\": \"LinearElastic2D\"");
    text.replace(
        from, 25,
        fmt::format(R"("type": "Bingham", "tau0": 100, "mu": 1, "critical_shear_rate": {})", rate));
    return said_of(folder, text);
  };
  CHECK(says(with_rate("1e-4"),
             "below this shear rate 'clay' has a viscosity of 1e+06 Pa s, which "
             "makes time steps 82.6 times shorter than its waves need"));
  CHECK_FALSE(says(with_rate("0.05"), "shear rate"));
}

namespace {

/// Soil in a mesh of 10 x 3 m, below a line that rises from 2 m.
std::string below_line(double right, const std::string& more = R"(, "material": "clay")") {
  return fmt::format(R"({{"mesh": {{"structured": {{"cell_size": 0.5, "extent": [10, 3]}}}},
    "geometry": {{"top": {{"points": [[0, 2], [10, {}]]}},
                  "rock": {{"points": [[0, 1], [10, 1]]}}}},
    "materials": [{{"name": "clay", "type": "LinearElastic", "density": 2000,
                    "youngs_modulus": 1e7, "poisson_ratio": 0.3}}],
    "particles": [{{"generator": {{"type": "region", "per_cell": 2,
                                   "region": {{"below": "top"}}{}}}}}],
    "analysis": {{"nsteps": 1}}}})",
                     right, more);
}

/// Soil below a raster in a mesh of 8 x 8 x 5 m, with `maps`.
std::string below_raster(const std::string& maps) {
  return fmt::format(R"({{"mesh": {{"structured": {{"cell_size": 1, "counts": [8, 8, 5]}}}},
    "geometry": {{"top": {{"raster": "bed.asc"}}}},
    "materials": [{{"name": "clay", "type": "LinearElastic", "density": 2000,
                    "youngs_modulus": 1e7, "poisson_ratio": 0.3}}],
    "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": "clay",
                                   "region": {{"below": "top"}}}}}}],
    "post_processing": {{"maps": {}}},
    "analysis": {{"nsteps": 1}}}})",
                     maps);
}

}  // namespace

TEST_CASE("soil whose surface rises above the mesh is warned of, with how much is missing") {
  const Folder folder;
  const char* const lost = "% of the region lies outside of the mesh and gets no particles";
  CHECK_FALSE(says(said_of(folder, below_line(3)), lost));
  CHECK(says(said_of(folder, below_line(6)), std::string("28 ") + lost));
  CHECK(says(said_of(folder, below_line(600)), lost));  // all of the mesh, and much more
}

TEST_CASE("a first layer below the top of its region is warned of") {
  const Folder folder;
  const auto said = [&](const std::string& first) {
    return said_of(
        folder,
        below_line(
            2.5, fmt::format(R"(, "layers": [{}{{"below": "rock", "material": "clay"}}])", first)));
  };
  CHECK(
      says(said(""), "% of the region lies above the first layer and gets no particles: about 12"));
  CHECK_FALSE(says(said(R"({"below": "top", "material": "clay"}, )"), "above the first layer"));
}

TEST_CASE("soil below a surface with a gap is warned of, and not where the surface ends") {
  if (!has_gdal()) return;
  const Folder folder;
  const auto with = [&](const std::function<bool(double)>& known) {
    folder.write("bed.asc",
                 ascii_grid(bed_of([&](double x, double) { return known(x) ? 2.0 : unknown; })));
    return says(said_of(folder, below_raster("{}")), "below them are no particles");
  };
  CHECK(with([](double x) { return x < 3 || x > 5; }));
  CHECK_FALSE(with([](double x) { return x < 5; }));
  CHECK_FALSE(with([](double) { return true; }));
}

TEST_CASE("maps outside of the mesh are warned of") {
  if (!has_gdal()) return;
  const Folder folder;
  folder.write("bed.asc", ascii_grid(bed_of([](double, double) { return 2.0; })));
  const char* const lost = "the maps lie outside of the mesh, and stay empty";
  const auto said = [&](const std::string& maps) { return said_of(folder, below_raster(maps)); };
  CHECK_FALSE(says(said(R"({"min": [2, 2], "max": [6, 6]})"), lost));
  CHECK(says(said(R"({"min": [5002, 7002], "max": [5006, 7006]})"), lost));
  CHECK(says(said(R"({"min": [-9, 2], "max": [-1, 6]})"), lost));
}

TEST_CASE("tiles of the ground that differ where they overlap are warned of") {
  if (!has_gdal()) return;
  const Folder folder;
  const auto said = [&](double step) {
    folder.write("west.asc", ascii_grid({6, 8, 0, 0, 1, [](double, double) { return 2.0; }}));
    folder.write("bed.asc",
                 ascii_grid({4, 8, 4, 0, 1, [&](double, double) { return 2.0 + step; }}));
    std::string text = below_raster("{}");
    const std::string one = R"("bed.asc")";
    text.replace(text.find(one), one.size(), R"(["west.asc", "bed.asc"])");
    return said_of(folder, text);
  };
  CHECK_FALSE(says(said(0), "overlap and differ"));
  CHECK(says(said(0.5),
             "'west.asc' and 'bed.asc' overlap and differ there, by up to 0.5 m at "
             "(4.5, 0.5): the values of 'bed.asc' are taken"));
}
