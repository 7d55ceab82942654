// Published CB-Geo cases, the examples of this repository, and the initial states they describe.
#include <doctest/doctest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "io/geometry/map_files.h"
#include "io/scenario/scenario.h"
#include "tests/published_cases.h"

namespace fs = std::filesystem;
using namespace lahar;

namespace {

const fs::path source = LAHAR_SOURCE_DIR;

// The published cases beside the repository; empty if they are not there.
fs::path cases() {
  const fs::path folder = source.parent_path() / "shared" / "cases";
  if (fs::exists(folder)) return folder;
  MESSAGE("no published cases beside the repository: skipped");
  return {};
}

// Whether an example has maps that this build does not read.
bool needs_missing_gdal(const fs::path& example) {
  std::ifstream in(example);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  return !has_gdal() && text.find("\"raster\"") != std::string::npos;
}

struct Csv {
  std::vector<std::string> columns;
  std::vector<std::vector<double>> rows;
  std::size_t column(const std::string& name) const {
    const auto it = std::find(columns.begin(), columns.end(), name);
    REQUIRE(it != columns.end());
    return static_cast<std::size_t>(it - columns.begin());
  }
};

Csv read_csv(const fs::path& file) {
  Csv csv;
  std::ifstream in(file);
  std::string line, cell;
  std::getline(in, line);
  for (std::stringstream s(line); std::getline(s, cell, ',');) csv.columns.push_back(cell);
  while (std::getline(in, line)) {
    csv.rows.emplace_back();
    for (std::stringstream s(line); std::getline(s, cell, ',');)
      csv.rows.back().push_back(std::stod(cell));
  }
  return csv;
}

template <int Dim>
void check_initial_state(const Model<Dim>& model, const Csv& csv) {
  const auto& p = model.particles;
  REQUIRE(p.size() == static_cast<Index>(csv.rows.size()));
  const char* axis[] = {"x", "y", "z"};
  double worst_x = 0, worst_mass = 0;
  const auto id = csv.column("id"), mass_column = csv.column("mass");
  std::vector<std::size_t> coordinate, displacement;
  for (int d = 0; d < Dim; ++d) {
    coordinate.push_back(csv.column(std::string("coord_") + axis[d]));
    displacement.push_back(csv.column(std::string("displacement_") + axis[d]));
  }
  for (const auto& row : csv.rows) {
    const auto i = static_cast<std::size_t>(row[id]);
    for (std::size_t d = 0; d < Dim; ++d)
      worst_x = std::max(worst_x, std::abs(p.x[i][static_cast<int>(d)] -
                                           (row[coordinate[d]] - row[displacement[d]])));
    const double mass = row[mass_column];
    const double ours = p.volume[i] * model.materials[p.material[i]].density;
    worst_mass = std::max(worst_mass, std::abs(ours - mass) / mass);
  }
  CHECK(worst_x < 1e-12);
  CHECK(worst_mass < 1e-12);
}

}  // namespace

TEST_CASE("published cases start with the particles, ids and masses of the reference") {
  const auto folders = test::published_cases();
  if (folders.empty()) return;
  int accepted = 0;
  for (const fs::path& folder : folders) {
    CAPTURE(folder.string());
    const Csv csv = read_csv(folder / "reference.csv");
    for (const char* file : {"mpm.json", "case.json"}) {
      if (!fs::exists(folder / file)) continue;  // of some there is the one that was run alone
      const Scenario s = read_scenario(folder / file);
      std::visit([&](const auto& model) { check_initial_state(model, csv); }, s.model);
      ++accepted;
    }
  }
  CHECK(accepted >= 20);
}

TEST_CASE("stress_update is honoured with a warning, and ignored like in CB-Geo on request") {
  const auto folder = cases();
  if (folder.empty()) return;
  const auto file = folder / "2d_hydrostatic_quad_usl" / "mpm.json";
  const Scenario ours = read_scenario(file);
  CHECK(std::get<Model<2>>(ours.model).analysis.scheme == Scheme::usl);
  REQUIRE(ours.warnings.size() == 1);
  CHECK(ours.warnings[0].message ==
        "'stress_update' is the older spelling of 'mpm_scheme'; usl is run");
  const Scenario theirs = read_scenario(file, {{}, true});
  CHECK(std::get<Model<2>>(theirs.model).analysis.scheme == Scheme::usf);
  REQUIRE(theirs.warnings.size() == 1);
  CHECK(theirs.warnings[0].message == "'stress_update': usl is ignored; usf is run, as by CB-Geo");
  const Scenario said = read_scenario(folder / "2d_hydrostatic_quad_usl" / "case.json", {{}, true});
  CHECK(std::get<Model<2>>(said.model).analysis.scheme == Scheme::usl);
}

TEST_CASE("every example is a valid scenario without warnings") {
  int found = 0;
  for (const auto& entry : fs::directory_iterator(source / "examples")) {
    if (entry.path().extension() != ".json" || needs_missing_gdal(entry.path())) continue;
    CAPTURE(entry.path().string());
    const Scenario s = read_scenario(entry.path());
    CHECK(format_problems(s.warnings, "warning") == "");
    std::visit([](const auto& m) { CHECK(m.particles.size() > 0); }, s.model);
    ++found;
  }
  CHECK(found > 0);
}

TEST_CASE("a scenario with all defaults filled in is the same scenario") {
  for (const auto& entry : fs::directory_iterator(source / "examples")) {
    if (entry.path().extension() != ".json" || needs_missing_gdal(entry.path())) continue;
    CAPTURE(entry.path().string());
    const Scenario a = read_scenario(entry.path());
    const Scenario b = read_scenario_text(a.full, source / "examples");
    CHECK(a.full == b.full);
    std::visit(
        [&](const auto& model) {
          using M = std::decay_t<decltype(model)>;
          const M& again = std::get<M>(b.model);
          CHECK(model.particles.x == again.particles.x);
          CHECK(model.particles.volume == again.particles.volume);
          CHECK(model.output.folder == again.output.folder);
          CHECK(model.analysis.nsteps == again.analysis.nsteps);
          // What the schema says is the default is what the model has where nothing is said.
          CHECK(model.analysis.patch_particles == again.analysis.patch_particles);
          CHECK(model.analysis.split_steps == again.analysis.split_steps);
          CHECK(model.analysis.step.safety == again.analysis.step.safety);
          CHECK(model.analysis.step.adaptive == again.analysis.step.adaptive);
          CHECK(model.analysis.functions == again.analysis.functions);
          CHECK(model.output.frame_steps == again.output.frame_steps);
          CHECK(model.output.history_steps == again.output.history_steps);
          CHECK(model.output.checkpoint_steps == again.output.checkpoint_steps);
          CHECK(model.output.checkpoints_kept == again.output.checkpoints_kept);
          CHECK(model.output.max_frames == again.output.max_frames);
          CHECK(entries_of<NodeVelocity>(model).size() == entries_of<NodeVelocity>(again).size());
        },
        a.model);
  }
}
