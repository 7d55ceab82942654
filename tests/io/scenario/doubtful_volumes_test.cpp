// Warnings of volumes of particles from files: too large ones, missing ones, and those that follow
// from cells that are not full; of liquids that are thinner than a cell. And silence where they are
// as they should be.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <string>

#include "io/scenario/scenario.h"
#include "tests/io/base/team_folder.h"
#include "tests/io/scenario/said.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// Rows of 8 particles in cells of 1 m, which have two in each direction; `listed` of them with
/// this volume in a file of volumes.
struct Block {
  int rows = 4, listed = 0;
  double volume = 0.25;
  std::string analysis = "";
};

std::string said_of(const Block& c) {
  const Folder folder;
  std::string points = fmt::format("{}\n", 8 * c.rows), volumes;
  for (int i = 0; i < 8 * c.rows; ++i)
    points += fmt::format("{} {}\n", 0.25 + 0.5 * (i % 8), 0.25 + 0.5 * (i / 8));
  for (int i = 0; i < c.listed; ++i) volumes += fmt::format("{} {}\n", i, c.volume);
  folder.write("points.txt", points);
  folder.write("volumes.txt", volumes);
  folder.write(
      "case.json",
      fmt::format(R"({{
    "mesh": {{"structured": {{"cell_size": 1, "counts": [4, 4]}}, {}
      "boundary_conditions": {{"velocity_constraints": [
        {{"nset": "floor", "dir": "y", "velocity": 0}}]}}}},
    "sets": {{"nodes": {{"floor": {{"half_space": {{"point": [0, 0], "normal": [0, 1]}}}}}}}},
    "materials": [{{"name": "soil", "density": 2000, "type": "LinearElastic",
                    "youngs_modulus": 1e8, "poisson_ratio": 0.3}}],
    "particles": [{{"generator": {{"type": "file", "location": "points.txt",
                                   "material": "soil"}}}}],
    "external_loading_conditions": {{"gravity": [0, -10]}},
    "analysis": {{"nsteps": 1{}}}}})",
                  c.listed > 0 ? R"("particles_volumes": "volumes.txt",)" : "", c.analysis));
  return warnings_of(read_scenario(folder.path / "case.json"));
}

/// Water behind a dam, and `depth` [m] before it, in cells 0.1 m high. `up` is the vertical axis.
std::string said_of_water(double depth, const std::string& law, const std::string& up = "y") {
  const auto place = [&](double along, double height) {
    return up == "y" ? fmt::format("[{}, {}]", along, height)
                     : fmt::format("[{}, {}]", height, along);
  };
  return warnings_of(read_scenario_text(
      fmt::format(R"({{
    "mesh": {{"structured": {{"cell_size": {}, "counts": [20, 20]}}}},
    "materials": [{{"name": "m", "density": 1000, {}}}],
    "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": "m",
      "region": {{"union": [{{"box": {{"max": {}}}}}, {{"box": {{"max": {}}}}}]}}}}}}],
    "external_loading_conditions": {{"gravity": {}}},
    "analysis": {{"nsteps": 1}}}})",
                  place(0.2, 0.1), law, place(1, 0.5), place(4, depth), place(0, -9.81)),
      ""));
}

}  // namespace

TEST_CASE("liquids that are less than a cell deep are warned of, with where and how deep") {
  const std::string water =
                        R"("type": "Newtonian", "bulk_modulus": 4e5, "dynamic_viscosity": 1e-3)",
                    soil = R"("type": "LinearElastic", "youngs_modulus": 1e7, "poisson_ratio": 0)",
                    shallow = "of its area the liquid is less than a cell deep";
  for (const char* up : {"y", "x"})
    CHECK(says(said_of_water(0.05, water, up), "over 75 % " + shallow + ", 0.05 m in the mean"));
  CHECK_FALSE(says(said_of_water(0.1, water), shallow));
  CHECK_FALSE(says(said_of_water(0.05, soil), shallow));
}

TEST_CASE("cells with fewer particles than most are warned of where nothing gives volumes") {
  const std::string part = "cells with particles from files hold fewer than 4";
  CHECK(says(said_of({.rows = 3}), "4 of the 8 " + part));
  CHECK(says(said_of({.rows = 7}), "4 of the 16 " + part));
  CHECK_FALSE(says(said_of({}), part));
  CHECK_FALSE(says(said_of({.rows = 3, .listed = 24}), part));
  CHECK_FALSE(says(said_of({.rows = 3, .analysis = R"(, "preset": "cbgeo", "dt": 1e-4)"}), part));
}

TEST_CASE("particles of regions have volumes of their own, also where they fill cells in part") {
  const Scenario s = read_scenario_text(R"({
    "mesh": {"structured": {"cell_size": 1, "counts": [4, 4]}},
    "materials": [{"name": "soil", "density": 2000, "type": "LinearElastic",
                   "youngs_modulus": 1e8, "poisson_ratio": 0.3}],
    "particles": [{"generator": {"type": "region", "per_cell": 2, "material": "soil",
                                 "region": {"box": {"max": [4, 1.5]}}}}],
    "analysis": {"nsteps": 1}})",
                                        "");
  CHECK_FALSE(says(warnings_of(s), "hold fewer than"));
}

TEST_CASE("a file of volumes that has not all particles is warned of") {
  CHECK(says(said_of({.listed = 5}), "the file has no volume for 27 of the 32 particles"));
  CHECK_FALSE(says(said_of({.listed = 32}), "has no volume"));
}

TEST_CASE("volumes above those of cells are warned of") {
  const std::string large = "particles are above 1.5 times that of their cell";
  CHECK(says(said_of({.listed = 32, .volume = 25}),
             "the volumes of 32 of the 32 " + large + ", the largest is 25 times it"));
  CHECK_FALSE(says(said_of({.listed = 32, .volume = 1.4}), large));
}
