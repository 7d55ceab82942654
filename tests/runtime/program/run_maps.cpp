// Rasters of a run lie on the map where its particles do.
#include "runtime/program/run_maps.h"

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <sstream>
#include <vector>

#include "io/geometry/raster_output.h"
#include "runtime/exchange/exact_sum.h"
#include "tests/io/base/team_folder.h"
#include "tests/runtime/step/models.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// What the scenario's model adds to coordinates to get those of the map [m].
const Vec<2> map_origin(652003, 5163007);
/// Raster cells in the plan of the mesh, and the least corner on the map.
constexpr Index columns = 12, rows = 7;
const Vec<2> corner(652006.5, 5163003);

/// A mass in the shape of an L on a slope, whose ground comes from a map in UTM.
Scenario moving_mass(const Folder& folder) {
  const RasterGrid grid{.columns = 30, .rows = 20, .low = {651995, 5162995}, .cell = 1.5};
  std::vector<double> ground;
  for (Index k = 0; k < grid.columns * grid.rows; ++k)
    ground.push_back(3 + 0.1 * static_cast<double>(k % grid.columns) -
                     0.05 * static_cast<double>(k / grid.columns));
  write_geotiff((folder.path / "ground.tif").string(), grid, "EPSG:32633", ground);
  folder.write("case.json", R"({
    "mesh": {"structured": {"cell_size": 1, "origin": [3.5, -4, 0], "extent": [12, 7, 8]},
             "map_origin": [652003, 5163007]},
    "geometry": {"ground": {"raster": "ground.tif"}},
    "materials": [{"name": "block", "type": "LinearElastic", "density": 2000,
                   "youngs_modulus": 1e6, "poisson_ratio": 0.2}],
    "particles": [
      {"generator": {"type": "region", "per_cell": 2, "material": 0, "velocity": [2, 1, 0],
        "region": {"intersection": [{"below": "ground"},
                                    {"box": {"min": [4, -3, 0], "max": [9, -1, 8]}}]}}},
      {"generator": {"type": "region", "per_cell": 2, "material": 0, "velocity": [2, 1, 0],
        "region": {"intersection": [{"below": "ground"},
                                    {"box": {"min": [4, -1, 0], "max": [6, 1, 8]}}]}}}],
    "analysis": {"dt": 2e-3, "nsteps": 100},
    "post_processing": {"gauge_steps": 10, "maps": {"cell_size": 1, "threshold": 0}}})");
  return read_scenario(folder.path / "case.json", {});
}

/// The thickness that a frame has in the raster cell around a place on the map.
double thickness_at(const Frame& frame, const Vec<2>& place) {
  ExactSum volume;
  const auto& V = frame.find("volume")->values;
  for (std::size_t i = 0; i < V.size(); ++i) {
    const Vec<2> x = Vec<2>(&frame.coordinates[3 * i]) + map_origin;
    if ((x - place).cwiseAbs().maxCoeff() <= 0.5) volume += V[i];
  }
  return volume.value();
}

/// Centres of all raster cells on the map, the first row in the south.
std::vector<Vec<2>> places() {
  std::vector<Vec<2>> all;
  for (Index row = 0; row < rows; ++row)
    for (Index column = 0; column < columns; ++column)
      all.push_back(corner +
                    Vec<2>(0.5 + static_cast<double>(column), 0.5 + static_cast<double>(row)));
  return all;
}

/// Values at all places as GDAL's own program reads them; nothing where it is not installed.
std::vector<double> by_tools(const Folder& folder, const std::string& file) {
  std::string text;
  for (const Vec<2>& place : places()) text += fmt::format("{} {}\n", place.x(), place.y());
  folder.write("places.txt", text);
  const auto out = (folder.path / "values.txt").string();
  const std::string command = fmt::format("gdallocationinfo -valonly -geoloc {} < {} > {} 2>{}.log",
                                          file, (folder.path / "places.txt").string(), out, out);
  if (std::system(command.c_str()) != 0) return {};
  std::ifstream values(out);
  return {std::istream_iterator<double>(values), {}};
}

/// Values of an ASCII grid, the first row in the south, as its text has them.
std::vector<double> values_of(const std::filesystem::path& file) {
  std::ifstream text(file);
  std::string line;
  for (int k = 0; k < 6; ++k) std::getline(text, line);
  std::vector<double> values;
  for (Index row = 0; row < rows; ++row) {
    std::getline(text, line);
    std::istringstream words(line);
    std::vector<double> found{std::istream_iterator<double>(words), {}};
    values.insert(values.begin(), found.begin(), found.end());
  }
  return values;
}

}  // namespace

TEST_CASE("rasters of a run have the values of its last frame at the frame's places on the map") {
  if (!has_gdal()) return;
  const Folder folder;
  const Scenario scenario = moving_mass(folder);
  const auto& model = std::get<Model<3>>(scenario.model);
  Observer observer;
  observer.gauges = [](const GaugeRows&) {};
  Simulation simulation(model, flow(2), observer);
  simulation.gauges();
  simulation.run();
  const std::vector<double> maps = simulation.maps();
  write_maps(folder.path, model.output.measured.maps, scenario.map, maps);
  const Frame frame = simulation.frame();
  const auto file = [&](const std::string& ending) {
    return (folder.path / "maps" / ("thickness" + ending)).string();
  };

  // The text has the bits of the maps.
  const std::vector<double> values = values_of(file(".asc"));
  REQUIRE(values.size() == columns * rows);
  CHECK(same_bits(values, {maps.begin(), maps.begin() + columns * rows}));
  double most = 0;
  for (const std::string ending : {".asc", ".tif"}) {
    CAPTURE(ending);
    const Raster raster({{"thickness" + ending, file(ending)}});
    CHECK(reference_name(raster.reference()) == "WGS 84 / UTM zone 33N");
    CHECK(raster.bounds().first == corner);
    const auto part = raster.part(corner, raster.bounds().second, 1);
    REQUIRE(part.columns == columns);
    REQUIRE(part.rows == rows);
    const std::vector<float> read = raster.read(part, 0, rows);
    const std::vector<double> seen = by_tools(folder, file(ending));
    for (std::size_t k = 0; k < places().size(); ++k) {
      const double thickness = thickness_at(frame, places()[k]);
      CHECK(std::abs(values[k] - thickness) <= 1e-14);
      CHECK(read[k] == static_cast<float>(values[k]));
      most = std::max(most, thickness);
      if (seen.empty()) continue;  // it is not installed
      REQUIRE(seen.size() == places().size());
      // GDAL reads ASCII grids as floats.
      CHECK(std::abs(seen[k] - thickness) <= (ending == ".tif" ? 1e-13 : 1e-6));
    }
  }
  CHECK(most > 1);
}
