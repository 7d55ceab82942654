// GIMP and splines on meshes from files: the results are those on the same grid without a file.
#include <doctest/doctest.h>
#include <fmt/format.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "tests/runtime/step/models.h"

using namespace lahar;
using namespace lahar::test;

namespace {

constexpr int n = 8;           // cells along each axis
constexpr double h = 0.125;    // their size [m]
constexpr int grid_nodes = 4;  // of a cell and around it, along an axis

/// A folder with a file of a grid of boxes, removed at the end. `ring`: nodes around the cells of
/// the unit square or cube are in the file, and cells list those near them.
class GridFile {
 public:
  GridFile(int dim, bool ring) : dim_(dim), ring_(ring ? 1 : 0) {
    folder_ =
        std::filesystem::temp_directory_path() / fmt::format("lahar_grid_{}_{}", dim, getpid());
    std::filesystem::create_directories(folder_);
    const int nodes = n + 1 + 2 * ring_, layers = dim == 3 ? nodes : 1;
    std::ofstream file(folder_ / "mesh.txt");
    file << nodes * nodes * layers << " " << (dim == 3 ? n * n * n : n * n) << "\n";
    for (int k = 0; k < layers; ++k)
      for (int j = 0; j < nodes; ++j)
        for (int i = 0; i < nodes; ++i) {
          file << (i - ring_) * h << " " << (j - ring_) * h;
          if (dim == 3) file << " " << (k - ring_) * h;
          file << "\n";
        }
    for (int k = 0; k < (dim == 3 ? n : 1); ++k)
      for (int j = 0; j < n; ++j)
        for (int i = 0; i < n; ++i) file << cell(i, j, k) << "\n";
  }
  ~GridFile() { std::filesystem::remove_all(folder_); }
  GridFile(const GridFile&) = delete;

  Scenario scenario(const std::string& text, bool as_cbgeo = false) const {
    ScenarioOptions options;
    options.as_cbgeo = as_cbgeo;
    return read_scenario_text(text, folder_.string(), test::plain_defaults(text, options));
  }

 private:
  /// Counter-clockwise; then in 2D the ring from the lower left on, counter-clockwise, and in 3D
  /// layer by layer.
  std::string cell(int i, int j, int k) const {
    const int nodes = n + 1 + 2 * ring_;
    const auto id = [&](int x, int y, int z) {
      const int layer = dim_ == 3 ? (k + z + ring_) * nodes * nodes : 0;
      return fmt::format("{} ", layer + (j + y + ring_) * nodes + i + x + ring_);
    };
    std::string line;
    for (int z = 0; z < dim_ - 1; ++z)
      line += id(0, 0, z) + id(1, 0, z) + id(1, 1, z) + id(0, 1, z);
    if (ring_ == 0) return line;
    if (dim_ == 2) {
      for (int x = -1; x < 2; ++x) line += id(x, -1, 0);
      for (int y = -1; y < 2; ++y) line += id(2, y, 0);
      for (int x = 2; x > -1; --x) line += id(x, 2, 0);
      for (int y = 2; y > -1; --y) line += id(-1, y, 0);
      return line;
    }
    for (int z = -1; z < 3; ++z)
      for (int y = -1; y < 3; ++y)
        for (int x = -1; x < 3; ++x)
          if (x < 0 || x > 1 || y < 0 || y > 1 || z < 0 || z > 1) line += id(x, y, z);
    return line;
  }

  int dim_, ring_;
  std::filesystem::path folder_;
};

/// A block that flies and turns inside the unit square or cube.
std::string scenario_text(int dim, const std::string& mesh, const std::string& functions) {
  const bool flat = dim == 2;
  return fmt::format(
      R"({{"mesh": {{{}}},
  "materials": [{{"type": "LinearElastic", "density": 1000, "youngs_modulus": 2000,
                  "poisson_ratio": 0.3}}],
  "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": 0,
     "velocity": {}, "region": {{"box": {{"min": {}, "max": {}}}}}}}}}],
  "analysis": {{"mpm_scheme": "musl", "dt": 4e-3, "nsteps": 60{}, "patch_particles": 40}}}})",
      mesh, flat ? "[0.6, 0.4]" : "[0.6, 0.4, -0.3]", flat ? "[0.25, 0.25]" : "[0.25, 0.25, 0.25]",
      flat ? "[0.625, 0.625]" : "[0.625, 0.625, 0.625]", functions);
}

template <int Dim>
Frame end_of(Scenario scenario, const ExecutionOptions& way) {
  Model<Dim> model = std::get<Model<Dim>>(std::move(scenario.model));
  for (const auto& x : model.particles.x)  // it turns
    model.particles.velocity[static_cast<std::size_t>(&x - model.particles.x.data())] +=
        (Vec<Dim>::Unit(0) * (0.4 - x[1]) + Vec<Dim>::Unit(1) * (x[0] - 0.4)) * 2;
  Simulation simulation(std::move(model), way);
  simulation.run();
  return simulation.frame();
}

double furthest(const std::vector<double>& a, const std::vector<double>& b) {
  REQUIRE(a.size() == b.size());
  double worst = 0;
  for (std::size_t i = 0; i < a.size(); ++i) worst = std::max(worst, std::abs(a[i] - b[i]));
  return worst;
}

/// The file against a grid from `low` to `high`.
template <int Dim>
void check_file(const std::string& cell_type, double low, double high,
                const std::string& functions) {
  const std::string corner = Dim == 2 ? "[{0}, {0}]" : "[{0}, {0}, {0}]";
  const std::string grid = fmt::format(
      R"("structured": {{"cell_size": 0.125, "origin": {}, "extent": {}}})",
      fmt::format(fmt::runtime(corner), low), fmt::format(fmt::runtime(corner), high - low));
  const std::string file = fmt::format(R"("mesh": "mesh.txt", "cell_type": "{}")", cell_type);
  const GridFile files(Dim, low < 0);
  const Frame of_grid =
      end_of<Dim>(files.scenario(scenario_text(
                      Dim, grid, fmt::format(R"(, "shape_functions": "{}")", functions))),
                  serial());
  const Frame of_file = end_of<Dim>(files.scenario(scenario_text(Dim, file, "")), serial());
  CHECK(furthest(of_file.coordinates, of_grid.coordinates) < 1e-11);
  CHECK(furthest(of_file.find("stress")->values, of_grid.find("stress")->values) < 1e-7);
  CHECK(same_bits(end_of<Dim>(files.scenario(scenario_text(Dim, file, "")), flow(3)), of_file));
}

}  // namespace

TEST_CASE("quadratic splines on a mesh file of boxes are those of the grid") {
  check_file<2>("ED2Q4P2B", 0, 1, "quadratic_spline");
  check_file<3>("ED3H8P2B", 0, 1, "quadratic_spline");
}

TEST_CASE("GIMP cells that list the nodes around them are those of a grid one cell wider") {
  check_file<2>("ED2Q16G", -0.125, 1.125, "gimp");
  check_file<3>("ED3H64G", -0.125, 1.125, "gimp");
}

TEST_CASE("the box of a GIMP particle: of its volume, or as CB-Geo takes it") {
  const GridFile files(2, true);
  const std::string text = scenario_text(2, R"("mesh": "mesh.txt", "cell_type": "ED2Q16G")", "");
  for (const bool as_cbgeo : {false, true}) {
    Simulation simulation(std::get<Model<2>>(files.scenario(text, as_cbgeo).model), serial());
    const Frame frame = simulation.frame();
    for (const double edge : frame.find("domain")->values)
      CHECK(edge == doctest::Approx(as_cbgeo ? h / 4 : h / 2).epsilon(1e-12));
  }
}

TEST_CASE("Gauss points of all cells of a GIMP mesh are in the cells that the file lists") {
  const GridFile files(2, true);
  const Scenario scenario = files.scenario(R"({
    "mesh": {"mesh": "mesh.txt", "cell_type": "ED2Q16G"},
    "materials": [{"id": 0, "type": "LinearElastic", "density": 1, "youngs_modulus": 1,
                   "poisson_ratio": 0}],
    "particles": [{"generator": {"type": "gauss", "cset_id": -1, "nparticles_per_dir": 1,
                                 "material_id": 0}}],
    "analysis": {"dt": 1e-3, "nsteps": 1}})");
  const auto& particles = std::get<Model<2>>(scenario.model).particles;
  CHECK(particles.size() == n * n);
  for (const auto& x : particles.x) CHECK(x.cwiseAbs().maxCoeff() < 1);
}
