// A million particles from ASCII: quick to read, and one bad line is found.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "io/scenario/scenario.h"
#include "tests/io/scenario/broken_case.h"

using namespace lahar;
using namespace lahar::broken;

namespace {

constexpr int side = 1000;  // particles along each side of the square

std::string million_particles() {
  std::string text = fmt::format("{}\n", side * side);
  text.reserve(24u << 20);
  for (int j = 0; j < side; ++j)
    for (int i = 0; i < side; ++i)
      text += fmt::format("{} {}\n", (i + 0.5) / side * 2, (j + 0.5) / side);
  return text;
}

const char* const structured = "\"structured\": {\"cell_size\": 0.004, \"extent\": [2, 1]},";

}  // namespace

TEST_CASE("a million particles are read and placed within two seconds") {
  const auto text = million_particles();
  const std::vector<Edit> edits = {replace("mpm.json", "\"mesh\": \"mesh.txt\",", structured),
                                   write("particles.txt", text)};
  const auto start = std::chrono::steady_clock::now();
  CHECK(read(edits) == "accepted\n");
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
  MESSAGE("written, read and placed in " << elapsed.count() << " s");
#ifdef NDEBUG
  CHECK(elapsed.count() < 2 * 2);  // the time of writing the file, and of a busy machine, included
#endif
}

TEST_CASE("one bad line among a million is reported with its place") {
  auto text = million_particles();
  const std::string good = "\n0.001 0.7775\n";
  const auto at = text.find(good);
  REQUIRE(at != std::string::npos);
  text.replace(at, good.size(), "\n0.001 O.7775\n");
  for (const int team : {1, 4})
    CHECK(read({replace("mpm.json", "\"mesh\": \"mesh.txt\",", structured),
                write("particles.txt", text)},
               {}, team) ==
          "particles.txt:777002:7: error: y must be a finite number, found 'O.7775'\n"
          "  0.001 O.7775\n"
          "        ^\n");
}

TEST_CASE("a million bad lines are ten messages and a count") {
  std::string text = fmt::format("{}\n", side * side);
  for (int i = 0; i < side * side; ++i) text += "0,5 0,5\n";
  const std::string said = read({write("particles.txt", text)});
  CHECK(read({write("particles.txt", text)}, {}, 3) == said);
  CHECK(std::count(said.begin(), said.end(), '\n') == 3 * 10 + 1);
  CHECK(said.find("particles.txt:11:1: error: x must be a finite number, found '0,5'\n") !=
        std::string::npos);
  CHECK(said.find("particles.txt: error: and 999990 more problems in this file\n") !=
        std::string::npos);
}

TEST_CASE("lines may be longer than the pieces in which files are read") {
  const std::string comment = "# " + std::string(1000000, '-') + "\n";
  const std::string rows = "3\n" + comment + comment + "0.25 0.5\n0.75 0.5\n" + comment;
  for (const int team : {1, 2, 5}) {
    CAPTURE(team);
    CHECK(read({write("particles.txt", comment + rows + "1.5 0.5")}, {}, team) == "accepted\n");
    CHECK(read({write("particles.txt", comment + rows + "1.5 .5.\n")}, {}, team) ==
          "particles.txt:8:5: error: y must be a finite number, found '.5.'\n"
          "  1.5 .5.\n"
          "      ^\n");
    CHECK(read({write("particles.txt", comment + rows + "1.5 2.5\n")}, {}, team) ==
          "particles.txt:8: error: particle 2 at (1.5, 2.5) lies outside the mesh\n"
          "  1.5 2.5\n"
          "  hint: the mesh extends from (0, 0) to (2, 1)\n");
  }
}

TEST_CASE("a huge mesh costs nothing where it is empty") {
  const auto start = std::chrono::steady_clock::now();
  CHECK(read({replace("mpm.json", "\"mesh\": \"mesh.txt\",",
                      "\"structured\": {\"cell_size\": 0.5, \"counts\": [90000, 90000]},")}) ==
        "accepted\n");
  const Scenario scenario = read_scenario_text(R"({
    "mesh": {"structured": {"cell_size": 1, "counts": [2000, 2000, 2000]}},
    "sets": {"nodes": {"corner": {"box": {"max": [1, 1, 1]}}},
             "cells": {"ball": {"sphere": {"centre": [1000, 1000, 1000], "radius": 5}}}},
    "materials": [{"type": "LinearElastic", "density": 1000, "youngs_modulus": 1e5,
                   "poisson_ratio": 0.25}],
    "particles": [{"generator": {"type": "region", "per_cell": 1, "material": 0,
                   "region": {"intersection": [
                     {"half_space": {"point": [0, 0, 1002], "normal": [0, 0, 1]}},
                     {"sphere": {"centre": [1000, 1000, 1000], "radius": 5}}]}}}],
    "analysis": {"dt": 0.01, "nsteps": 1}})",
                                               ".");
  const auto& model = std::get<Model<3>>(scenario.model);
  CHECK(model.particles.size() > 300);
  CHECK(model.mesh->n_cells() == 8'000'000'000);
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
  CHECK(elapsed.count() < 5);  // once through all cells takes minutes
}
