// Scenarios with their side files, and material drivers.
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <variant>

#include "io/frames/cbgeo_table.h"
#include "io/scenario/material_driver.h"
#include "io/scenario/scenario.h"
#include "physics/base/error.h"
#include "runtime/program/material_command.h"
#include "runtime/step/simulation.h"
#include "tests/fuzz/accepted.h"
#include "tests/fuzz/case_folder.h"
#include "tests/fuzz/targets.h"

namespace lahar::fuzz {

namespace {

namespace fs = std::filesystem;

/// Runs take some steps where they are small.
constexpr double most_memory = 256e6;  // [bytes]
constexpr Index most_particles = 2000, most_cells = 20000, steps = 3;

template <int Dim>
void take_steps(Model<Dim> model) {
  const auto particles = static_cast<Index>(model.particles.x.size());
  if (particles > most_particles || model.mesh->n_cells() > most_cells) return;
  model.analysis.patch_particles = std::max<Index>(model.analysis.patch_particles, 16);
  model.output = {};
  const double end_time = model.analysis.end_time;
  ExecutionOptions options;
  options.mode = ExecutionOptions::Mode::serial;
  Simulation simulation(std::move(model), options);
  require(
      simulation.finished() || end_time <= simulation.time() || is_positive(simulation.info().dt),
      "the first time step is not positive");
  if (!simulation.finished()) simulation.advance(steps);
  static_cast<void>(simulation.frame());
  const double mass = simulation.history().mass;
  require(std::isfinite(mass) && mass >= 0, "the mass is not finite");
}

/// Grids of so many cells are looked through for as long as they say; no failure, but no time.
bool takes_long(const std::string& scenario) {
  constexpr double most = 1e7;
  const auto json = nlohmann::json::parse(scenario, nullptr, false, true);
  const nlohmann::json::json_pointer place("/mesh/structured");
  if (json.is_discarded() || !json.contains(place)) return false;
  const auto& grid = json[place];
  const auto of = [&](const char* key, std::size_t d) {
    if (!grid.contains(key)) return 1.0;
    const auto& values = grid[key];
    const auto& value = values.is_array() && d < values.size() ? values[d] : values;
    return value.is_number() ? std::abs(value.get<double>()) : 1.0;
  };
  double cells = 1;
  for (std::size_t d = 0; d < 3; ++d)
    cells *= grid.is_object() && grid.contains("counts")
                 ? of("counts", d)
                 : of("extent", d) / std::max(of("cell_size", d), 1e-300);
  return cells > most;
}

void read_and_run(Bytes input, bool as_cbgeo) {
  const std::vector<BundledFile> files = unbundle(text_of(input));
  if (takes_long(files.front().text)) throw InputError("it is not tried: there are many cells");
  const CaseFolder folder(files);
  try {
    ScenarioOptions options;
    options.memory = {most_memory, "a fuzzed input may take"};
    options.as_cbgeo = as_cbgeo;
    Scenario read = read_scenario_text(files.front().text, folder.folder(), options);
    check_shown(format_problems(read.warnings));
    std::visit(
        [](auto& model) {
          check_model(model);
          take_steps(std::move(model));
        },
        read.model);
  } catch (const InputError& error) {
    check_shown(format_problems(error.problems()));
    throw;
  }
}

/// The particles of table.json as CB-Geo MPM would have them after six steps.
std::string resumed_case() {
  std::vector<BundledFile> files = unbundle(example("table.json"));
  std::string& scenario = files.front().text;
  const std::string from = R"("resume": {"resume": false})";
  scenario.replace(scenario.find(from), from.size(),
                   R"("resume": {"resume": true, "uuid": "table", "step": 5})");
  const fs::path file = work_folder() / "resumed.h5";
  write_cbgeo_table(file, 2, [](Index first, Index n) {
    std::vector<CbgeoParticle> rows(static_cast<std::size_t>(n));
    for (Index k = 0; k < n; ++k) {
      CbgeoParticle& row = rows[static_cast<std::size_t>(k)];
      row.id = first + k;
      row.mass = 250;
      row.volume = 0.25;
      row.coord[0] = 0.6 - 0.3 * static_cast<double>(row.id);
      row.coord[1] = 0.2 + 0.5 * static_cast<double>(row.id);
      row.velocity[1] = -0.1;
      row.stress[0] = row.stress[1] = -100;
      row.cell_id = row.id;
    }
    return rows;
  });
  files.push_back({"results/table/particles05.h5", contents(file)});
  return bundle(files);
}

}  // namespace

void run_scenario(Bytes input) {
  read_and_run(input, false);
}

void run_dialect(Bytes input) {
  read_and_run(input, true);
}

std::vector<Seed> scenario_seeds() {
  return {{"resumed", resumed_case()}};
}

/// Those of the scenarios that have what CB-Geo MPM requires.
std::vector<Seed> dialect_seeds() {
  std::vector<Seed> seeds = scenario_seeds();
  for (const char* name : {"brick.json", "files.json", "soil.json", "table.json", "water.json"})
    seeds.push_back({name, example(name)});
  return seeds;
}

void run_material(Bytes input) {
  const std::vector<BundledFile> files = unbundle(text_of(input));
  const CaseFolder folder(files);
  MaterialDriver driver = read_material_driver_text(files.front().text, folder.folder());
  check_material(driver.material);
  // The beginning of each part of the path, in steps as large as the input wants them.
  constexpr Index most = 2;
  constexpr std::size_t parts = 4;
  if (driver.path.size() > parts) driver.path.resize(parts);
  for (PathSegment& segment : driver.path) {
    require(segment.steps > 0, "a path has no steps");
    if (segment.steps <= most) continue;
    for (double& change : segment.change)
      change *= static_cast<double>(most) / static_cast<double>(segment.steps);
    segment.steps = most;
    if (!segment.increments.empty()) segment.increments.resize(static_cast<std::size_t>(most));
  }
  std::vector<PathPoint> points;
  Index divided = 0;
  follow_path(driver, points, divided);
  static_cast<void>(path_table(driver, points));
  static_cast<void>(path_picture(driver, points));
}

}  // namespace lahar::fuzz
