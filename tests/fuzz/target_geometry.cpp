// Shapes and meshes of other programs: read alone, looked at, and then in a scenario.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <variant>

#include "io/geometry/ascii_grid.h"
#include "io/geometry/map_files.h"
#include "io/geometry/triangles_check.h"
#include "io/geometry/triangles_file.h"
#include "io/mesh/element_file.h"
#include "io/scenario/scenario.h"
#include "physics/base/error.h"
#include "physics/geometry/triangle_heights.h"
#include "physics/geometry/triangle_solid.h"
#include "physics/mesh/mesh.h"
#include "tests/fuzz/accepted.h"
#include "tests/fuzz/case_folder.h"

namespace lahar::fuzz {

namespace {

namespace fs = std::filesystem;

constexpr double most_memory = 256e6;  // [bytes] of a scenario
/// Grids of heights with more points are not looked at: a scenario refuses those that are too many.
constexpr double most_points = 1e6;

/// The file that is read: the first of a bundle, which has no scenario of its own.
const BundledFile& first_file(const std::vector<BundledFile>& files) {
  if (files.size() < 2) throw InputError("this input has no file");
  return files[1];
}

[[noreturn]] void refuse(ProblemList& problems) {
  const auto all = problems.errors("");
  check_shown(format_problems(all));
  throw InputError(all);
}

SideFile open(const fs::path& folder, const std::string& name) {
  std::string reason;
  auto file = open_side_file(name, place_of(folder, name), reason);
  if (!file) throw InputError(name + " " + reason);
  return *file;
}

/// Reads a scenario as the program does, and looks at what it accepts.
void read_case(const std::string& text, const fs::path& folder) {
  try {
    ScenarioOptions options;
    options.memory = {most_memory, "a fuzzed input may take"};
    const Scenario read = read_scenario_text(text, folder, options);
    check_shown(format_problems(read.warnings));
    std::visit([](const auto& model) { check_model(model); }, read.model);
  } catch (const InputError& error) {
    check_shown(format_problems(error.problems()));
    throw;
  }
}

/// Particles in a region that a shape bounds; `quoted` as JSON.
std::string case_of(const std::string& key, const std::string& quoted, const std::string& where) {
  return fmt::format(
      R"({{"mesh": {{"structured": {{"origin": [-0.5, -0.5, -0.5], "cell_size": 0.5, "counts": [6, 6, 6]}}}},
  "geometry": {{"shape": {{"{}": {}}}}},
  "particles": [{{"generator": {{"type": "region", "region": {{"intersection": [{{"{}": "shape"}},
    {{"box": {{"min": [0, 0, 0], "max": [2, 2, 1]}}}}]}}, "per_cell": 2, "material_id": 0}}}}],
  "materials": [{{"id": 0, "type": "LinearElastic", "density": 1000, "youngs_modulus": 1e6,
                 "poisson_ratio": 0.3}}],
  "analysis": {{"type": "MPMExplicit3D", "dt": 0.001, "nsteps": 1}}}})",
      key, quoted, where);
}

// --- triangles --------------------------------------------------------------------------------

void check_triangles(const Triangles& triangles) {
  for (const Vec<3>& x : triangles.points) require(x.allFinite(), "a corner is not finite");
  const auto n = static_cast<Local>(triangles.points.size());
  for (const Triangles::Corners& corners : triangles.corners)
    for (const Local c : corners) require(c >= 0 && c < n, "a triangle has a corner that is none");
}

void check_solid_of(Triangles triangles, const std::string& name, ProblemList& problems) {
  if (!check_solid(name, triangles, problems)) refuse(problems);
  require(is_positive(enclosed_volume(triangles)), "a solid has no volume");
  TriangleTree tree(std::move(triangles));
  if (!check_crossings(name, tree, problems)) refuse(problems);
  const auto solid = solid_of_triangles(std::move(tree), 10);
  for (const Vec<3>& x : {Vec<3>(0.1, 0.2, 0.3), Vec<3>(1, 1, 1), Vec<3>(0, 0, 0)}) {
    const auto nearest = solid->nearest(x);
    require(!std::isnan(nearest.distance), "a distance is not a number");
    require(nearest.normal.allFinite(), "a normal is not finite");
  }
}

void check_heights_of(Triangles triangles, const std::string& name, ProblemList& problems) {
  if (!check_surface(name, triangles, problems)) refuse(problems);
  const double spacing = spacing_for(triangles);
  const auto counts = grid_counts(triangles, spacing);
  require(counts[0] > 1 && counts[1] > 1, "a grid has no points");
  if (static_cast<double>(counts[0]) * static_cast<double>(counts[1]) > most_points) return;
  const TriangleHeights heights = triangle_heights(triangles, spacing);
  for (const float height : heights.surface.heights())
    require(!std::isinf(height), "a height is not finite");
}

void read_triangles_of(const fs::path& folder, const std::string& name) {
  ProblemList problems;
  auto triangles = read_triangles(open(folder, name), {}, problems);
  if (!triangles) refuse(problems);
  check_triangles(*triangles);
  const bool solid = name.starts_with("solid");
  if (solid)
    check_solid_of(std::move(*triangles), name, problems);
  else
    check_heights_of(std::move(*triangles), name, problems);
  read_case(case_of(solid ? "solid" : "triangles", '"' + name + '"', solid ? "inside" : "below"),
            folder);
}

// --- maps -------------------------------------------------------------------------------------

void read_raster_of(const fs::path& folder, const std::string& name) {
  const MapFile file{name, open(folder, name).path};
  check_ascii_grid(file);
  const Raster raster({file});
  const auto& [low, high] = raster.bounds();
  require(low.allFinite() && high.allFinite(), "a raster has no bounds");
  require((high - low).minCoeff() > 0, "a raster has no cells");
  for (const double finest : {0.1, 10.0}) {
    const Raster::Part part = raster.part({0, 0}, {2, 2}, finest);
    if (part.points() == 0 || static_cast<double>(part.points()) > most_points) continue;
    require(part.spacing.allFinite() && part.spacing.minCoeff() > 0, "points have no distance");
    const Surface<3> surface = surface_of(part, raster.read(part, 0, part.rows), {0, 0});
    for (const float height : surface.heights())
      require(!std::isinf(height), "a height is not finite");
  }
  read_case(case_of("raster", '"' + name + '"', "below"), folder);
}

void read_polygons_of(const fs::path& folder, const std::string& name) {
  const PolygonFile read = read_polygons({name, open(folder, name).path}, "");
  for (const Outlines::Polygon& polygon : read.polygons)
    for (const Outlines::Ring& ring : polygon) {
      require(ring.size() >= 3, "a ring has no area");
      for (const Vec<2>& x : ring) require(x.allFinite(), "a corner is not finite");
    }
  const Outlines outlines(read.polygons);
  require(outlines.from_edge({0.3, 0.4}).allFinite(), "a distance is not finite");
  read_case(case_of("polygons", '"' + name + '"', "under"), folder);
}

// --- meshes -----------------------------------------------------------------------------------

template <int Dim>
void read_mesh_of(const SideFile& file) {
  ProblemList problems;
  const ElementMesh<Dim> read = mesh_of<Dim>(read_element_file(file), file.name, problems);
  check_shown(format_problems(problems.found_warnings().kept, "warning"));
  const auto n_nodes = static_cast<Index>(read.nodes.size());
  const auto n_cells = static_cast<Index>(read.cells.size()) / info(read.element).nodes;
  for (const Vec<Dim>& x : read.nodes) require(x.allFinite(), "a node is not finite");
  for (const Index node : read.cells)
    require(node >= 0 && node < n_nodes, "a cell has a node that is none");
  for (const auto* sets : {&read.node_sets, &read.cell_sets})
    for (const auto& set : *sets)
      for (const Index member : set.members)
        require(member >= 0 && member < (sets == &read.node_sets ? n_nodes : n_cells),
                "a set has a member that is none");
  const auto mesh = Mesh<Dim>::from_tables(read.nodes, read.element, read.cells, true);
  for (Index cell = 0; cell < mesh.n_cells(); ++cell)
    require(is_positive(mesh.cell_volume(cell)), "a cell has no volume");
}

std::string mesh_case(int dim, const std::string& name) {
  return fmt::format(
      R"({{"mesh": {{"mesh": "{}"}},
  "particles": [{{"generator": {{"type": "gauss", "cset_id": -1, "nparticles_per_dir": 1,
                               "material_id": 0}}}}],
  "materials": [{{"id": 0, "type": "LinearElastic", "density": 1000, "youngs_modulus": 1e6,
                 "poisson_ratio": 0.3}}],
  "analysis": {{"type": "MPMExplicit{}D", "dt": 0.001, "nsteps": 1}}}})",
      name, dim);
}

}  // namespace

void run_geometry(Bytes input) {
  const std::vector<BundledFile> files = unbundle(text_of(input));
  const std::string name = first_file(files).name, ending = ending_of(name);
  const CaseFolder case_folder(files);
  const fs::path& folder = case_folder.folder();
  try {
    if (ending == "asc" || ending == "tif")
      read_raster_of(folder, name);
    else if (ending == "geojson" || ending == "shp")
      read_polygons_of(folder, name);
    else
      read_triangles_of(folder, name);
  } catch (const InputError& error) {
    check_shown(format_problems(error.problems()));
    throw;
  }
}

void run_mesh(Bytes input) {
  const std::vector<BundledFile> files = unbundle(text_of(input));
  const std::string name = first_file(files).name;
  const CaseFolder case_folder(files);
  const SideFile file = open(case_folder.folder(), name);
  if (!is_element_file(file)) throw InputError("a mesh of another format");
  const int dim = name.starts_with("plane") ? 2 : 3;
  try {
    if (dim == 2)
      read_mesh_of<2>(file);
    else
      read_mesh_of<3>(file);
  } catch (const InputError& error) {
    check_shown(format_problems(error.problems()));
    throw;
  }
  read_case(mesh_case(dim, name), case_folder.folder());
}

/// Those that Gmsh wrote for the tests of its reader.
std::vector<Seed> mesh_seeds() {
  std::vector<Seed> seeds;
  for (const char* name : {"h20-41b", "h27-22a", "h8-22b", "q4-41a", "q8-41b", "q9-22b", "t3-22a",
                           "t3-22b", "t3-41a", "t3-41b", "t6-22b", "tet4-41a"}) {
    const bool plane = name[0] == 'q' || (name[0] == 't' && name[1] != 'e');
    const fs::path file = fs::path(LAHAR_SOURCE_DIR) / "tests/io/mesh/gmsh" / name;
    seeds.push_back(
        {name, bundle({{"", ""},
                       {plane ? "plane.msh" : "solid.msh", contents(file.string() + ".msh")}})});
  }
  return seeds;
}

}  // namespace lahar::fuzz
