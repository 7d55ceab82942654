// Scenarios read by a team: all shares together are what one process reads.
#include <doctest/doctest.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <numeric>
#include <random>

#include "io/geometry/map_files.h"
#include "io/scenario/particles_generator.h"
#include "io/scenario/scenario.h"
#include "tests/io/base/team_folder.h"
#include "tests/io/base/thread_team.h"
#include "tests/published_cases.h"

namespace fs = std::filesystem;
using namespace lahar;

namespace {

const fs::path source = LAHAR_SOURCE_DIR;
constexpr int teams[] = {2, 3, 7};

// What each member reads.
std::vector<Scenario> read_by_team(const fs::path& file, int size,
                                   const std::vector<std::string>& overrides) {
  std::vector<Scenario> parts(static_cast<std::size_t>(size));
  run_team(size, [&](const Team& team) {
    parts[static_cast<std::size_t>(team.index())] = read_scenario(file, {overrides, false, &team});
  });
  return parts;
}

template <int Dim>
bool have_ids(const ParticleTable<Dim>& p) {
  return p.id.size() == p.x.size() && std::is_sorted(p.id.begin(), p.id.end()) &&
         std::adjacent_find(p.id.begin(), p.id.end()) == p.id.end();
}

// Put the rows of a column where they belong.
template <class T>
void place_rows(const std::vector<T>& part, const std::vector<Index>& id, std::size_t size,
                std::vector<T>& whole) {
  if (part.empty()) return;
  whole.resize(size);
  for (std::size_t i = 0; i < part.size(); ++i) whole[static_cast<std::size_t>(id[i])] = part[i];
}

template <class Load>
void join_lists(std::vector<Load>& whole, const std::vector<Load>& part) {
  if (whole.empty()) whole.resize(part.size());
  REQUIRE(whole.size() == part.size());
  for (std::size_t k = 0; k < part.size(); ++k) {
    CHECK(std::is_sorted(part[k].particles.begin(), part[k].particles.end()));
    auto particles = std::exchange(whole[k].particles, {});
    particles.insert(particles.end(), part[k].particles.begin(), part[k].particles.end());
    std::sort(particles.begin(), particles.end());
    whole[k] = part[k];
    whole[k].particles = std::move(particles);
  }
}

template <int Dim>
Model<Dim> joined(const std::vector<Scenario>& parts) {
  Model<Dim> whole;
  std::size_t size = 0;
  for (const Scenario& part : parts) size += std::get<Model<Dim>>(part.model).particles.x.size();
  for (const Scenario& part : parts) {
    const auto& model = std::get<Model<Dim>>(part.model);
    const auto& p = model.particles;
    CHECK(have_ids(p));
    REQUIRE((p.id.empty() || p.id.back() < static_cast<Index>(size)));
    place_rows(p.x, p.id, size, whole.particles.x);
    place_rows(p.cell, p.id, size, whole.particles.cell);
    place_rows(p.volume, p.id, size, whole.particles.volume);
    place_rows(p.material, p.id, size, whole.particles.material);
    place_rows(p.velocity, p.id, size, whole.particles.velocity);
    place_rows(p.stress, p.id, size, whole.particles.stress);
    join_lists(whole.tractions, model.tractions);
    join_lists(whole.particle_velocities, model.particle_velocities);
  }
  return whole;
}

template <class Load>
void check_lists(const std::vector<Load>& a, const std::vector<Load>& b) {
  REQUIRE(a.size() == b.size());
  for (std::size_t k = 0; k < a.size(); ++k) {
    CHECK(a[k].particles == b[k].particles);
    CHECK(a[k].dir == b[k].dir);
  }
}

template <int Dim>
void check_model(const Model<Dim>& whole, const std::vector<Scenario>& parts) {
  const Model<Dim> all = joined<Dim>(parts);
  CHECK(all.particles.x == whole.particles.x);
  CHECK(all.particles.cell == whole.particles.cell);
  CHECK(all.particles.volume == whole.particles.volume);
  CHECK(all.particles.material == whole.particles.material);
  CHECK(all.particles.velocity == whole.particles.velocity);
  CHECK(all.particles.stress == whole.particles.stress);
  check_lists(all.tractions, whole.tractions);
  check_lists(all.particle_velocities, whole.particle_velocities);
  const double even =
      static_cast<double>(whole.particles.x.size()) / static_cast<double>(parts.size());
  std::size_t velocities = 0, forces = 0;
  for (const Scenario& part : parts) {
    const auto& model = std::get<Model<Dim>>(part.model);
    CHECK(static_cast<double>(model.particles.x.size()) <= 1.1 * even + 100);
    velocities += entries_of<NodeVelocity>(model).size();
    forces += entries_of<NodeForce>(model).size();
    CHECK(model.output.folder == whole.output.folder);
  }
  CHECK(velocities == entries_of<NodeVelocity>(whole).size());
  CHECK(forces == entries_of<NodeForce>(whole).size());
}

// Read a scenario alone and by teams, and compare. Returns what one process alone reads.
Scenario check_shares(const fs::path& file, const std::vector<std::string>& overrides = {}) {
  Scenario whole = read_scenario(file, {overrides});
  for (const int size : teams) {
    CAPTURE(size);
    const std::vector<Scenario> parts = read_by_team(file, size, overrides);
    for (const Scenario& part : parts) {
      CHECK(format_problems(part.warnings) == format_problems(whole.warnings));
      CHECK(part.full == whole.full);
      CHECK(part.side_files == whole.side_files);
    }
    std::visit([&]<int Dim>(const Model<Dim>& model) { check_model<Dim>(model, parts); },
               whole.model);
  }
  return whole;
}

const char* const head = R"({
  "mesh": {"structured": {"cell_size": 0.1, "counts": [40, 30]}, MESH
    "boundary_conditions": {"particles_velocity_constraints": [
      {"pset": "low", "dir": "y", "velocity": 0.5}]}},
  "sets": {"particles": {"low": {"box": {"max": [4, 0.5]}}, "none": {"box": {"min": [5, 5]}}},
           "cells": {"middle": {"box": {"min": [1, 1], "max": [2, 2]}}}},
  "materials": [{"type": "LinearElastic", "name": "soft", "density": 1000,
                 "youngs_modulus": 1e5, "poisson_ratio": 0.25},
                {"type": "LinearElastic", "name": "hard", "density": 2000,
                 "youngs_modulus": 1e5, "poisson_ratio": 0.25}],
  "material_sets": [{"pset": "low", "material": "hard"}],
  "external_loading_conditions": {"particle_surface_traction": [
    {"pset_id": -1, "dir": "x", "traction": 1}, {"pset_id": 4, "dir": "y", "traction": 2}]},
  "analysis": {"dt": 0.0001, "nsteps": 1},
  "particles": [PARTICLES]})";

std::string scenario(std::string mesh, std::string particles) {
  std::string text = head;
  text.replace(text.find("MESH"), 4, mesh);
  text.replace(text.find("PARTICLES"), 9, particles);
  return text;
}

// A square full of particles at random places; their order has nothing to do with these.
std::vector<Vec<2>> random_points(int n) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> x(0, 4), y(0, 3);
  std::vector<Vec<2>> points;
  for (int i = 0; i < n; ++i) points.emplace_back(x(random), y(random));
  return points;
}

std::string text_of(const std::vector<Vec<2>>& points) {
  std::string text = fmt::format("# made up\n{}\n", points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    text += fmt::format("{} {}\n", points[i].x(), points[i].y());
    if (i % 1000 == 0) text += "\n! a comment\n";
  }
  return text;
}

// Side files in an order of their own, and sets of particles.
void write_side_files(const Folder& folder, const std::vector<Vec<2>>& points) {
  const auto n = static_cast<Index>(points.size());
  std::vector<Index> order(points.size());
  std::iota(order.begin(), order.end(), Index{0});
  std::shuffle(order.begin(), order.end(), std::mt19937(3));
  std::string volumes, cells, stresses = fmt::format("{}\n", n), members;
  for (const Index i : order) {
    const auto& x = points[static_cast<std::size_t>(i)];
    const auto cell = static_cast<Index>(x.x() / 0.1) + 40 * static_cast<Index>(x.y() / 0.1);
    if (i % 2 == 0) volumes += fmt::format("{} {}\n", i, 0.001 + 1e-9 * static_cast<double>(i));
    if (i % 3 != 0) cells += fmt::format("{} {}\n", i, i % 5 == 0 ? 0 : cell);
    if (i % 7 == 0) members += fmt::format("{}{}", members.empty() ? "" : ", ", i);
  }
  for (Index i = 0; i < n; ++i) stresses += fmt::format("{} -1 0 {} 0 0\n", i, 0.5 * i);
  folder.write("particles.txt", text_of(points));
  folder.write("volumes.txt", volumes);
  folder.write("cells.txt", cells);
  folder.write("stresses.txt", stresses);
  folder.write("sets.json", fmt::format(R"({{"node_sets": [{{"set": [3, 1], "id": 0}}],
    "particle_sets": [{{"set": [{}], "id": 4}}, {{"id": 9, "set": []}}]}})",
                                        members));
}

const char* const all_files = R"("particles_volumes": "volumes.txt", "particle_cells": "cells.txt",
  "particles_stresses": "stresses.txt", "entity_sets": "sets.json",)";

}  // namespace

TEST_CASE("shares of published cases are together what one process reads") {
  for (const auto& folder : test::published_cases()) {
    const std::string name = folder.filename().string();
    if (name == "2d_mc_uniaxial_compression" || name == "2d_sliding_block") continue;
    CAPTURE(name);
    for (const char* file : {"mpm.json", "case.json"})
      if (fs::exists(folder / file)) check_shares(folder / file);
  }
}

TEST_CASE("shares of the examples are together what one process reads") {
  for (const auto& entry : fs::directory_iterator(source / "examples")) {
    if (entry.path().extension() != ".json") continue;
    std::ifstream in(entry.path());
    const std::string text{std::istreambuf_iterator<char>(in), {}};
    if (!has_gdal() && text.find("\"raster\"") != std::string::npos) continue;
    CAPTURE(entry.path().string());
    check_shares(entry.path());
  }
}

TEST_CASE("rows of shuffled side files find the member that has their particle") {
  const Folder folder;
  write_side_files(folder, random_points(100000));
  folder.write("case.json", scenario(all_files, R"(
    {"generator": {"type": "file", "location": "particles.txt", "material": "soft"}})"));
  const Scenario whole = check_shares(folder.path / "case.json");
  const auto& model = std::get<Model<2>>(whole.model);
  CHECK(model.particles.stress.back()[0] == 99999);
  CHECK(model.particles.volume[0] == 0.001);
  CHECK(model.tractions[1].particles.size() == 100000 / 7 + 1);
}

TEST_CASE("shares of several generators are together what one process makes") {
  const Folder folder;
  write_side_files(folder, random_points(1000));
  const std::string particles = R"(
    {"generator": {"type": "file", "location": "particles.txt", "material": "soft", "pset": "a"}},
    {"generator": {"type": "region", "per_cell": 3, "material": "hard", "velocity": [1, 2],
                   "region": {"sphere": {"centre": [2, 1.5], "radius": 1.2}}}},
    {"generator": {"type": "gauss", "cset": "middle", "nparticles_per_dir": 2, "material": "soft",
                   "pset": "a"}},
    {"generator": {"type": "gauss", "cset_id": -1, "nparticles_per_dir": 1, "material": "hard",
                   "pset_id": 4}})";
  folder.write("case.json", scenario(R"("entity_sets": "sets.json",)", particles));
  const Scenario whole = check_shares(folder.path / "case.json");
  // An empty set, particles at one place, a set that entity sets and a generator make, cells with
  // one particle, two pairs of generators that fill the same place, and two tractions that are not
  // on a surface.
  CHECK(whole.warnings.size() == 8);
  CHECK(std::get<Model<2>>(whole.model).tractions[1].particles.size() == 1200);
}

TEST_CASE("members of a team find the same single rows of nodes") {
  const Folder folder;
  folder.write("case.json", scenario("", R"(
    {"generator": {"type": "region", "per_cell": 2, "material": "soft", "pset_id": 4,
                   "region": {"box": {"min": [0, 0], "max": [2, 3]}}}})"));
  const Scenario whole = check_shares(
      folder.path / "case.json",
      {R"(sets.nodes={"row":{"box":{"min":[2,0],"max":[2,3]}}})",
       R"(mesh.boundary_conditions.velocity_constraints=[{"nset":"row","dir":"x","velocity":0}])"});
  CHECK(format_problems(whole.warnings).find("31 nodes, at x = 2, do not hold") !=
        std::string::npos);
}

TEST_CASE("members of a team find the same nodes with a force and without material") {
  const Folder folder;
  folder.write("case.json", scenario("", R"(
    {"generator": {"type": "region", "per_cell": 2, "material": "soft", "pset_id": 4,
                   "region": {"box": {"min": [0, 0], "max": [2, 3]}}}})"));
  const Scenario whole = check_shares(
      folder.path / "case.json",
      {R"(sets.nodes={"far":{"box":{"min":[3,0],"max":[3,3]}}})",
       R"(external_loading_conditions.concentrated_nodal_forces=[{"nset":"far","dir":"x",)"
       R"("force":1}])"});
  CHECK(format_problems(whole.warnings).find("31 of the 31 nodes with a force") !=
        std::string::npos);
}

TEST_CASE("a team may be larger than the number of particles") {
  const Folder folder;
  folder.write("particles.txt", "2\n0.1 0.1\n0.1 0.1");
  folder.write("sets.json", R"({"particle_sets": [{"id": 4, "set": [1]}]})");
  folder.write("case.json", scenario(R"("entity_sets": "sets.json",)", R"(
    {"generator": {"type": "file", "location": "particles.txt", "material": "soft",
                   "velocity": [1, 0]}})"));
  const Scenario whole = check_shares(folder.path / "case.json");
  REQUIRE(whole.warnings.size() == 3);
  CHECK(whole.warnings[0].message == "particles 0 and 1 are at the same place");
}

TEST_CASE("a region's particles are spread evenly however they lie in the mesh") {
  const Folder folder;
  folder.write("case.json", scenario("", R"(
    {"generator": {"type": "region", "per_cell": 5, "material": "soft", "pset_id": 4,
      "region": {"half_space": {"point": [0.7, 0.4], "normal": [1, 1]}}}})"));
  for (const int size : teams) {
    const auto parts = read_by_team(folder.path / "case.json", size, {});
    Index most = 0, least = std::numeric_limits<Index>::max();
    for (const auto& part : parts) {
      most = std::max(most, std::get<Model<2>>(part.model).particles.size());
      least = std::min(least, std::get<Model<2>>(part.model).particles.size());
    }
    CHECK(least > 0);
    CHECK(most - least <= 1);
  }
}

TEST_CASE("what one member throws, all throw") {
  const Problem problem{"file", 3, 4, "/a", "message", "hint", "source"};
  int thrown = 0;
  std::mutex mutex;
  CHECK_THROWS_WITH_AS(
      run_team(3,
               [&](const Team& team) {
                 try {
                   all_or_none(team, [&] {
                     if (team.index() == 1) throw InputError({problem, problem});
                   });
                 } catch (const InputError& e) {
                   const std::lock_guard lock(mutex);
                   thrown += static_cast<int>(e.problems().size());
                   CHECK(format_problems(e.problems()) == format_problems({problem, problem}));
                 }
                 all_or_none(team, [&] {
                   if (team.index() == 2) throw SimulationError("late");
                 });
               }),
      "late", SimulationError);
  CHECK(thrown == 6);
}

TEST_CASE("the lowest of several coincident pairs is found, whoever has the points") {
  std::vector<Vec<2>> points = random_points(500);
  points[480] = points[100];
  points[300] = points[100];
  points[200] = points[150];
  points[0] = Vec<2>(-0.0, 0.0);
  points[499] = Vec<2>(0.0, -0.0);
  CHECK(find_coincident<2>(points) == std::pair<Index, Index>(0, 499));
  points[0][0] = 17;
  CHECK(find_coincident<2>(points) == std::pair<Index, Index>(100, 300));
  run_team(4, [&](const Team& team) {
    RowShares shares;
    std::vector<Vec<2>> own;
    for (const Index n : {40, 60, 25})  // of each member; blocks one after the other
      shares.append(n, team);
    for (const auto& range : shares.own_ranges())
      for (Index row = range.first; row < range.end; ++row)
        own.push_back(points[static_cast<std::size_t>(row)]);
    CHECK(find_coincident<2>(own, shares, team) == std::pair<Index, Index>(100, 300));
  });
}
