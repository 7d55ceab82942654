// From a scenario to the rows that each rank owns.
#include "runtime/patches/initial_particles.h"

#include <doctest/doctest.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <numeric>
#include <random>

#include "io/scenario/scenario.h"
#include "runtime/comm/rank_team.h"
#include "runtime/patches/rank_partition.h"

namespace fs = std::filesystem;
using namespace lahar;

namespace {

// A folder that the ranks share.
class Folder {
 public:
  explicit Folder(const Communicator& ranks) : ranks_(ranks) {
    std::string name = fmt::format("lahar-ranks-{}", ::getpid());
    ranks.broadcast(name);
    path = fs::temp_directory_path() / name;
    if (ranks.rank() == 0) fs::create_directories(path);
  }
  ~Folder() {
    ranks_.wait_for_all();
    std::error_code ignored;
    if (ranks_.rank() == 0) fs::remove_all(path, ignored);
  }
  void write(const std::string& file, const std::string& text) const {
    if (ranks_.rank() == 0) std::ofstream(path / file, std::ios::binary) << text;
    ranks_.wait_for_all();
  }
  fs::path path;

 private:
  const Communicator& ranks_;
};

const char* const scenario = R"({
  "mesh": {"structured": {"cell_size": 0.1, "counts": [40, 30]},
    "boundary_conditions": {"particles_velocity_constraints": [
      {"pset": "low", "dir": "y", "velocity": 0.5}]}},
  "sets": {"particles": {"low": {"box": {"max": [4, 0.5]}}}},
  "materials": [{"type": "LinearElastic", "density": 1000, "youngs_modulus": 1e5,
                 "poisson_ratio": 0.25},
                {"type": "Newtonian", "density": 1000, "bulk_modulus": 1e5,
                 "dynamic_viscosity": 1}],
  "external_loading_conditions": {"particle_surface_traction": [
    {"pset_id": -1, "dir": "x", "traction": 1}, {"pset": "round", "dir": "y", "traction": 2}]},
  "analysis": {"dt": 0.0001, "nsteps": 1, "patch_particles": 500},
  "particles": [
    {"generator": {"type": "file", "location": "particles.txt", "material": 0}},
    {"generator": {"type": "region", "per_cell": 3, "material": 1, "velocity": [1, 2],
      "pset": "round", "region": {"sphere": {"centre": [2, 1.5], "radius": 1.2}}}}]})";

std::string random_particles(int n) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> x(0, 4), y(0, 3);
  std::string text = fmt::format("{}\n", n);
  for (int i = 0; i < n; ++i) {
    const double first = x(random);
    text += fmt::format("{} {}\n", first, y(random));
  }
  return text;
}

// Whether the rows of a column are those of the whole table.
template <class T>
bool same_rows(const std::vector<T>& own, const std::vector<Index>& id,
               const std::vector<T>& whole) {
  if (own.size() != (whole.empty() ? 0 : id.size())) return false;
  for (std::size_t i = 0; i < own.size(); ++i)
    if (own[i] != whole[static_cast<std::size_t>(id[i])]) return false;
  return true;
}

void check_rows(ParticleTable<2> own, const ParticleTable<2>& whole) {
  if (own.id.empty()) {  // of one rank alone: the position
    own.id.resize(own.x.size());
    std::iota(own.id.begin(), own.id.end(), Index{0});
  }
  CHECK(std::is_sorted(own.id.begin(), own.id.end()));
  CHECK(same_rows(own.x, own.id, whole.x));
  CHECK(same_rows(own.cell, own.id, whole.cell));
  CHECK(same_rows(own.volume, own.id, whole.volume));
  CHECK(same_rows(own.material, own.id, whole.material));
  CHECK(same_rows(own.velocity, own.id, whole.velocity));
  CHECK(same_rows(own.stress, own.id, whole.stress));
  CHECK(same_rows(own.loads, own.id, whole.loads));
}

// Peak of this process's memory since the last call of reset_peak() [bytes].
double memory(const std::string& key) {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;)
    if (word == key) {
      double kib = 0;
      status >> kib;
      return 1024 * kib;
    }
  return 0;
}
bool reset_peak() {
#ifdef __SANITIZE_THREAD__
  return false;  // its own memory would be measured
#endif
  std::ofstream file("/proc/self/clear_refs");
  return static_cast<bool>(file << "5" << std::flush);
}

}  // namespace

TEST_CASE("every rank gets the rows of its patches, bit for bit those of one process") {
  const Communicator ranks = Communicator::world();
  const RankTeam team(ranks);
  const Folder folder(ranks);
  folder.write("particles.txt", random_particles(20000));
  folder.write("case.json", scenario);
  Scenario whole = read_scenario(folder.path / "case.json");
  Scenario share = read_scenario(folder.path / "case.json", {{}, false, &team});
  auto& alone = std::get<Model<2>>(whole.model);
  auto& model = std::get<Model<2>>(share.model);

  const ParticleCensus one = take_census(alone, Communicator());
  const ParticleCensus census = take_census(model, ranks);
  CHECK(census.particles == one.particles);
  CHECK(census.occupied_cells == one.occupied_cells);
  CHECK(census.stressed == one.stressed);
  CHECK(census.used == one.used);

  const Partition<2> partition(*model.mesh, 20);
  const auto weight = particles_of_patches(model.particles, partition, ranks);
  CHECK(weight == particles_of_patches(alone.particles, partition, Communicator()));
  const std::vector<int> owner = curve_partition(weight, ranks.size());
  const auto owner_of = [&](const ParticleTable<2>& table, std::size_t row) {
    return owner[static_cast<std::size_t>(partition.patch_of(table.cell[row]))];
  };
  set_loads(alone);
  set_loads(model);
  std::vector<int> destination;
  for (std::size_t row = 0; row < model.particles.x.size(); ++row)
    destination.push_back(owner_of(model.particles, row));
  send_to_owners<2>(
      model.particles, [&](std::size_t row) { return destination[row]; }, ranks);

  check_rows(model.particles, alone.particles);
  CHECK(ranks.sum(model.particles.size()) == one.particles);
  for (std::size_t row = 0; row < model.particles.x.size(); ++row)
    CHECK(owner_of(model.particles, row) == ranks.rank());
  CHECK(std::count_if(alone.particles.loads.begin(), alone.particles.loads.end(),
                      [](auto bits) { return bits == 7; }) > 0);
}

TEST_CASE("rows are sent to one rank and back") {
  const Communicator ranks = Communicator::world();
  ParticleTable<2> table, whole;
  const int n = 1000;
  for (int i = 0; i < n; ++i) {
    whole.x.emplace_back(i, -i);
    whole.cell.push_back(i / 2);
    whole.volume.push_back(0.5 * i);
    whole.material.push_back(static_cast<std::uint16_t>(i % 3));
    whole.stress.push_back({1.0 * i});
    if (i % ranks.size() != ranks.rank()) continue;  // the shares of ranks interleave
    const auto at = static_cast<std::size_t>(i);
    table.id.push_back(i);
    table.x.push_back(whole.x[at]);
    table.cell.push_back(whole.cell[at]);
    table.volume.push_back(whole.volume[at]);
    table.material.push_back(whole.material[at]);
    table.stress.push_back(whole.stress[at]);
  }
  const int last = ranks.size() - 1;
  send_to_owners<2>(
      table, [&](std::size_t) { return last; }, ranks);
  CHECK(table.size() == (ranks.rank() == last ? n : 0));
  check_rows(table, whole);
  send_to_owners<2>(
      table, [&](std::size_t row) { return static_cast<int>(table.id[row] % ranks.size()); },
      ranks);
  check_rows(table, whole);
  CHECK(std::all_of(table.id.begin(), table.id.end(),
                    [&](Index id) { return id % ranks.size() == ranks.rank(); }));
}

TEST_CASE("a broken file is reported alike by all ranks") {
  const Communicator ranks = Communicator::world();
  const RankTeam team(ranks);
  const Folder folder(ranks);
  std::string text = random_particles(20000);
  text[text.rfind('.')] = ',';
  folder.write("particles.txt", text);
  folder.write("case.json", scenario);
  const auto said = [&](const Team* members) {
    try {
      read_scenario(folder.path / "case.json", {{}, false, members});
    } catch (const InputError& e) {
      return format_problems(e.problems());
    }
    return std::string("accepted");
  };
  const std::string one = said(nullptr);
  CHECK(one.find("y must be a finite number") != std::string::npos);
  CHECK(said(&team) == one);
}

TEST_CASE("a rank that reads its share needs its share of the memory") {
  const Communicator ranks = Communicator::world();
  const RankTeam team(ranks);
  if (ranks.any(!reset_peak())) {
    MESSAGE("the peak of memory cannot be measured here: skipped");
    return;
  }
  const Folder folder(ranks);
  folder.write("particles.txt", random_particles(1000000));
  folder.write("case.json", scenario);
  reset_peak();
  const double before = memory("VmRSS:");
  const Scenario read = read_scenario(folder.path / "case.json", {{}, false, &team});
  const double peak = memory("VmHWM:") - before;
  const auto& particles = std::get<Model<2>>(read.model).particles;
  const auto own = static_cast<double>(particles.size());
  CHECK(own < 1.1 * static_cast<double>(ranks.sum(particles.size())) / ranks.size());
  // Beyond the table of the share: pieces of files, and what is exchanged on the way.
  const double row = 3 * sizeof(particles.x[0]) + 2 * sizeof(Index) + sizeof(std::uint16_t);
  constexpr double pieces = 4e6;
  CHECK(peak < 2 * row * own + pieces);
  MESSAGE(fmt::format("rank {}: {} particles, peak {:.1f} MB, {:.0f} bytes each", ranks.rank(), own,
                      peak / 1e6, peak / own));
}
