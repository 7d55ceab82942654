// Parameters of materials, water tables and thicknesses from maps.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "io/geometry/map_files.h"
#include "io/scenario/scenario.h"
#include "tests/io/base/team_folder.h"
#include "tests/io/base/thread_team.h"
#include "tests/io/geometry/map_samples.h"
#include "tests/io/scenario/said.h"
#include "tests/within.h"

using namespace lahar;
using namespace lahar::test;

namespace {

constexpr double unknown = std::numeric_limits<double>::quiet_NaN();

/// Weak in the west, strong in the east [Pa]; 0 in the first cells.
double cohesion(double x, double) {
  return 1000 * std::max(x - 1, 0.0);
}

GridSample grid(const std::function<double(double, double)>& value) {
  return {12, 6, 100, 50, 1, [=](double x, double y) { return value(x - 100, y - 50); }};
}

/// A block of 10 x 4 x 2 m whose place on the map is (101, 51).
std::string scenario(const std::string& parameter, const std::string& geometry = "") {
  return fmt::format(R"({{"mesh": {{"structured": {{"cell_size": 1, "extent": [10, 4, 3]}},
                                    "map_origin": [101, 51]}},
    "geometry": {{{}}},
    "materials": [{{"name": "clay", "type": "MohrCoulomb", "density": 2000, "youngs_modulus": 1e7,
                    "poisson_ratio": 0.3, "friction": 20, "dilation": 0, "cohesion": {},
                    "tension_cutoff": 0}}],
    "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": "clay",
                     "region": {{"box": {{"min": [0, 0, 0], "max": [10, 4, 2]}}}}}}}}],
    "analysis": {{"nsteps": 1}}}})",
                     geometry, parameter);
}

const char* const mapped = R"({"raster": "c.asc"})";

Model<3> model_of(const Folder& folder, const std::string& text, const Team* team = nullptr) {
  folder.write("case.json", text);
  return std::get<Model<3>>(read_scenario(folder.path / "case.json", {{}, false, team}).model);
}

std::string refusal(const Folder& folder, const std::string& text) {
  return refusal_of([&] { model_of(folder, text); });
}

double cohesion_at(const Model<3>& model, std::size_t p) {
  return std::get<MohrCoulomb>(model.materials[model.particles.material[p]].law).cohesion;
}

}  // namespace

TEST_CASE("a parameter from a map is right to 1 % of its range at every particle") {
  if (!has_gdal()) return;
  const Folder folder;
  folder.write("c.asc", ascii_grid(grid(cohesion)));
  const Model<3> model = model_of(folder, scenario(mapped));
  REQUIRE(model.particles.x.size() == 640);
  double least = 1e9;
  for (std::size_t p = 0; p < model.particles.x.size(); ++p) {
    const double x = model.particles.x[p].x();
    CHECK(model.materials[model.particles.material[p]].id == 0);
    // Bilinear between centres of cells: straight lines but in the bend.
    if (x > 1) CHECK(std::abs(cohesion_at(model, p) - 1000 * x) < 0.01 * 10500);
    least = std::min(least, cohesion_at(model, p));
  }
  CHECK(least < 0.05 * 10500);
  folder.write("c.asc", ascii_grid(grid([](double x, double) { return x < 6 ? 0.0 : 5000.0; })));
  const Model<3> two = model_of(folder, scenario(mapped));
  for (std::size_t p = 0; p < two.particles.x.size(); ++p) {
    const double x = two.particles.x[p].x();  // steps are exactly what the map says
    if (x < 4.5) CHECK(cohesion_at(two, p) == 0.0);
    if (x > 5.5) CHECK(cohesion_at(two, p) == 5000.0);
  }
  const Model<3> bounded =
      model_of(folder, scenario(R"({"raster": "c.asc", "min": 1000, "max": 3000, "classes": 5})"));
  CHECK(bounded.materials.size() <= 5);
  for (std::size_t p = 0; p < bounded.particles.x.size(); ++p)
    CHECK((cohesion_at(bounded, p) >= 1000.0 && cohesion_at(bounded, p) <= 3000.0));
  folder.write("c.asc", ascii_grid(grid([](double, double) { return 700.0; })));
  CHECK(cohesion_at(model_of(folder, scenario(mapped)), 5) == 700.0);
}

TEST_CASE("a map gives the same to every team that reads it") {
  if (!has_gdal()) return;
  const Folder folder;
  folder.write("c.asc", ascii_grid(grid(cohesion)));
  const Model<3> whole = model_of(folder, scenario(mapped));
  for (const int size : {2, 3})
    run_team(size, [&](const Team& team) {
      const Model<3> part =
          std::get<Model<3>>(read_scenario(folder.path / "case.json", {{}, false, &team}).model);
      REQUIRE(part.materials.size() == whole.materials.size());
      for (std::size_t p = 0; p < part.particles.x.size(); ++p)
        CHECK(cohesion_at(part, p) ==
              cohesion_at(whole, static_cast<std::size_t>(part.particles.id_of(p))));
    });
}

TEST_CASE("maps that have no value of a particle, or a wrong one, are refused") {
  if (!has_gdal()) return;
  const Folder folder;
  folder.write(
      "c.asc",
      ascii_grid(grid([](double x, double y) { return x > 8 && y < 3 ? unknown : 1000.0; })));
  const std::string missing = refusal(folder, scenario(mapped));
  CHECK(says(missing, "the map of 'cohesion' has no value at "));
  CHECK(says(missing, " of the particles of 'clay', the first at x = "));
  CHECK(says(missing, ", y = 0.25"));
  for (const int size : {1, 3}) {
    CAPTURE(size);
    run_team(size, [&](const Team& team) {
      CHECK(refusal_of([&] {
              read_scenario(folder.path / "case.json", {{}, false, &team});
            }) == missing);
    });
  }
  folder.write("c.asc", ascii_grid(grid([](double x, double) { return x < 3 ? -1.0 : 1000.0; })));
  CHECK(refusal(folder, scenario(mapped)) ==
        "'cohesion' becomes -1 in parts of this field; it must be at least 0");
  folder.write("c.asc", ascii_grid(grid([](double, double) { return unknown; })));
  CHECK(refusal(folder, scenario(mapped)) ==
        "the raster has no value where the mesh is: all of it is nodata there");
  CHECK(refusal(folder, scenario(R"({"raster": "d.asc"})")) == "file 'd.asc' does not exist");
  CHECK(refusal(folder, scenario(R"({"raster": "c.asc", "seed": 3})")) ==
        "'seed' has no meaning in a map");
  folder.write("c.asc", "ncols 2\nnrows 1\nxllcorner 90\nyllcorner 40\ncellsize 40\n1 o\n");
  CHECK(refusal(folder, scenario(mapped)) == "line 6 of 'c.asc' has 'o', which is not a number");
  folder.write("c.tif", geotiff(grid(cohesion), 32633));
  folder.write("dem.tif", geotiff(grid([](double, double) { return 2.0; }), 32632));
  CHECK(refusal(folder, scenario(R"({"raster": "c.tif"})", R"("g": {"raster": "dem.tif"})")) ==
        "'dem.tif' and 'c.tif' are in different coordinate reference systems: WGS 84 / UTM zone "
        "32N and WGS 84 / UTM zone 33N");
}

TEST_CASE("a map of thicknesses has its volume, also where it has data in a part alone") {
  if (!has_gdal()) return;
  const auto volume = [](const std::function<double(double, double)>& thickness, double cell) {
    const Folder folder;
    const int columns = static_cast<int>(12 / cell), rows = static_cast<int>(8 / cell);
    folder.write("t.asc", ascii_grid({columns, rows, 0, 0, cell, thickness}));
    folder.write("flat.asc", ascii_grid({12, 8, 0, 0, 1, [](double, double) { return 1.0; }}));
    const Model<3> model = model_of(folder, R"({
      "mesh": {"structured": {"cell_size": 0.5, "extent": [12, 8, 4]}},
      "geometry": {"ground": {"raster": "flat.asc"}, "thick": {"raster": "t.asc"},
                   "top": {"surface": "ground", "raise_by": "thick"}},
      "materials": [{"name": "m", "type": "LinearElastic", "density": 2000,
                     "youngs_modulus": 1e7, "poisson_ratio": 0.3}],
      "particles": [{"generator": {"type": "region", "per_cell": 2, "material": "m",
                                   "region": {"between": ["ground", "top"]}}}],
      "analysis": {"nsteps": 1}})");
    double sum = 0;
    for (const double V : model.particles.volume) sum += V;
    return sum;
  };
  const auto known = [](double x, double y) { return x > 4 && x < 8 && y > 2 && y < 6; };
  for (const double cell : {0.5, 1.0, 2.0}) {
    CAPTURE(cell);
    CHECK(volume([&](double x, double y) { return known(x, y) ? 1.5 : unknown; }, cell) ==
          within(0.01, 16 * 1.5));
    // Cells that are 0 at the sides of the map go straight on to its edge, and not below 0.
    CHECK(volume([&](double x, double y) { return known(x, y) ? 1.5 : 0.0; }, cell) ==
          within(0.01, 16 * 1.5));
    CHECK(volume([&](double x, double) { return 0.2 * std::max(0.0, x - cell / 2); }, cell) > 0);
  }
}

TEST_CASE("a surface of geometry is the level of the water") {
  const auto pressures = [](const std::string& table) {
    const std::string text = fmt::format(R"({{
      "mesh": {{"structured": {{"cell_size": 1, "extent": [4, 3]}},
                "particles_pore_pressures": {{"type": "water_table", {}}}}},
      "geometry": {{"water": {{"points": [[0, 1], [3, 2.5]]}},
                    "wall": {{"points": [[0, 1], [4, 1]]}}}},
      "materials": [{{"name": "soil", "type": "LinearElastic", "density": 2650,
                      "youngs_modulus": 1e7, "poisson_ratio": 0.2, "porosity": 0.4, "k_x": 1e-3}},
                    {{"name": "water", "type": "Newtonian", "density": 1000, "bulk_modulus": 1e8,
                      "dynamic_viscosity": 1e-3}}],
      "particles": [{{"generator": {{"type": "region", "per_cell": 2,
                                     "material": ["soil", "water"]}}}}],
      "external_loading_conditions": {{"gravity": [0, -10]}},
      "analysis": {{"nsteps": 1}}}})",
                                         table);
    return std::get<Model<2>>(read_scenario_text(text, "").model).particles;
  };
  const auto particles = pressures(R"("surface": "water")");
  REQUIRE(particles.x.size() == 48);
  for (std::size_t p = 0; p < particles.x.size(); ++p) {
    const Vec<2>& x = particles.x[p];
    const double depth = x[0] < 3 ? 1 + 0.5 * x[0] - x[1] : 0;  // no water beyond the surface
    CHECK(particles.pore_pressure[p] == doctest::Approx(1e4 * std::max(0.0, depth)));
  }
  const auto said = [&](const std::string& table) { return refusal_of([&] { pressures(table); }); };
  CHECK(said(R"("surface": "watr")") == "'surface' must name a surface; 'watr' is not in geometry");
  CHECK(said(R"("surface": "water", "water_tables": [{"position": 0, "h0": 1}])") ==
        "a water table needs either 'surface' or 'water_tables'");
  CHECK(said(R"("dir_v": 1)") == "a water table needs either 'surface' or 'water_tables'");
  CHECK(said(R"("surface": "water", "dir_v": 0)") == "'dir_v' does not go together with 'surface'");
  CHECK(said(R"("water_tables": [])") == "'water_tables' is empty");
}
