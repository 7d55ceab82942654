// Inflow into triangles and tetrahedra: which cells get particles, of what volume, and what is
// missing.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <vector>

#include "tests/io/base/team_folder.h"
#include "tests/io/base/thread_team.h"
#include "tests/io/scenario/said.h"

using namespace lahar;
using namespace lahar::test;

namespace {

constexpr double h = 0.5;

/// A mesh file of 4 x 4 squares, each cut into two triangles by the diagonal from its lower left
/// corner, or by the other one.
std::string triangles(bool rising) {
  std::string nodes, cells;
  for (int j = 0; j <= 4; ++j)
    for (int i = 0; i <= 4; ++i) nodes += fmt::format("{} {}\n", i * h, j * h);
  for (int j = 0; j < 4; ++j)
    for (int i = 0; i < 4; ++i) {
      const int a = 5 * j + i, b = a + 1, c = b + 5, d = a + 5;
      cells += rising ? fmt::format("{} {} {}\n{} {} {}\n", a, b, c, a, c, d)
                      : fmt::format("{} {} {}\n{} {} {}\n", a, b, d, b, c, d);
    }
  return "25 32\n" + nodes + cells;
}

/// A mesh file of 4 x 1 x 1 cubes of 0.5 m, each cut into six tetrahedra.
std::string tetrahedra() {
  constexpr int six[6][4] = {{0, 1, 2, 6}, {0, 2, 3, 6}, {0, 3, 7, 6},
                             {0, 7, 4, 6}, {0, 4, 5, 6}, {0, 5, 1, 6}};
  const auto node = [](int i, int j, int k) { return (k * 2 + j) * 5 + i; };
  std::string nodes, cells;
  for (int k = 0; k < 2; ++k)
    for (int j = 0; j < 2; ++j)
      for (int i = 0; i < 5; ++i) nodes += fmt::format("{} {} {}\n", i * h, j * h, k * h);
  for (int i = 0; i < 4; ++i) {
    const int corners[8] = {node(i, 0, 0), node(i + 1, 0, 0), node(i + 1, 1, 0), node(i, 1, 0),
                            node(i, 0, 1), node(i + 1, 0, 1), node(i + 1, 1, 1), node(i, 1, 1)};
    for (const auto& one : six)
      cells += fmt::format("{} {} {} {}\n", corners[one[0]], corners[one[1]], corners[one[2]],
                           corners[one[3]]);
  }
  return "20 24\n" + nodes + cells;
}

struct Inflow {
  std::string type = "ED2T3", velocity = "[2, 0]", box = R"("min": [0, 0.5], "max": [0.5, 1.5])";
  int per_dir = 1;
  std::string more = "";  ///< keys of the generator
};

/// In the folder whose mesh.txt there is.
Scenario read(const Inflow& of, const Folder& folder, const Team* team = nullptr) {
  ScenarioOptions options;
  if (team) options.team = team;
  return read_scenario_text(fmt::format(R"({{"mesh": {{"mesh": "mesh.txt", "cell_type": "{}"}},
    "sets": {{"cells": {{"inlet": {{"box": {{{}}}}}}}}},
    "materials": [{{"name": "water", "type": "Newtonian", "density": 1000, "bulk_modulus": 1e6,
                    "dynamic_viscosity": 1e-3}}],
    "particles": [{{"generator": {{"type": "inject", "cset": "inlet", "nparticles_per_dir": {},
                                   "velocity": {}, "material": "water"{}}}}}],
    "analysis": {{"end_time": 1, "locate_particles": false}}}})",
                                        of.type, of.box, of.per_dir, of.velocity, of.more),
                            folder.path, options);
}

template <int Dim = 2>
Injection<Dim> injection(const Inflow& of, const std::string& mesh) {
  const Folder folder;
  folder.write("mesh.txt", mesh);
  return std::get<Model<Dim>>(read(of, folder).model).injections.at(0);
}

std::string said(const Inflow& of, const std::string& mesh) {
  const Folder folder;
  folder.write("mesh.txt", mesh);
  return warnings_of(read(of, folder));
}

}  // namespace

TEST_CASE("of triangles only those get particles into which something flows from outside") {
  for (const bool rising : {true, false}) {
    CAPTURE(rising);
    const Injection<2> one = injection({}, triangles(rising));
    // Squares 4 and 8 each have a triangle with the left side: it gets particles.
    const Index left = rising ? 1 : 0;
    CHECK(one.cells == std::vector<Index>{8 + left, 16 + left});
    CHECK(one.n_cells() == 2);
    CHECK(one.flow == doctest::Approx(2 * 1.0));
    // The particle has a third of the square's length before it.
    for (const double volume : one.volume) CHECK(volume == doctest::Approx(h * h / 3));
    CHECK(one.filling == doctest::Approx(2 * h * h / 3));
    const Injection<2> three = injection({.per_dir = 2}, triangles(rising));
    CHECK(three.cells == one.cells);
    REQUIRE(three.x.size() == 6);
    for (const Vec<2>& x : three.x) CHECK((0 < x[0] && x[0] < h));
    // The last of three, two thirds of it.
    for (const double volume : three.volume) CHECK(volume == doctest::Approx(2 * h * h / 3 / 3));
  }
}

TEST_CASE("triangles that are filled but once are filled, all of them") {
  const Injection<2> still = injection({.velocity = "[0, 0]"}, triangles(true));
  const Injection<2> brief = injection({.more = R"(, "duration": [0, 0.01])"}, triangles(true));
  for (const Injection<2>* one : {&still, &brief}) {
    CHECK(one->cells == std::vector<Index>{8, 9, 16, 17});
    for (const double volume : one->volume) CHECK(volume == doctest::Approx(h * h / 2));
  }
}

TEST_CASE("tetrahedra let in what flows through their sides") {
  const Injection<3> one = injection<3>(
      {.type = "ED3T4", .velocity = "[2, 0, 0]", .box = R"("min": [0, 0, 0], "max": [0.5, 1, 1])"},
      tetrahedra());
  CHECK(one.flow == doctest::Approx(2 * h * h));
  CHECK(one.cells == std::vector<Index>{2, 3});  // with the corners 0, 3, 7 and 0, 7, 4
  // The middle of a tetrahedron has a quarter of the cube's length before it, its side is half.
  for (const double volume : one.volume) CHECK(volume == doctest::Approx(h * h * h / 8));
}

TEST_CASE("what enters cells that others flow into is said to be missing, with how much") {
  const std::string missing = "% of this inflow will be missing";
  CHECK_FALSE(says(said({}, triangles(true)), missing));
  CHECK_FALSE(says(said({.per_dir = 2}, triangles(false)), missing));
  // Along the diagonal each triangle has one side through which something enters.
  CHECK_FALSE(says(said({.velocity = "[2, 2]"}, triangles(true)), missing));
  // Across it a triangle has two, and one of the upper square's is below: half of a third.
  CHECK(says(said({.velocity = "[2, 2]"}, triangles(false)), "about 17 " + missing));
}

TEST_CASE("each member of a team has the cells and volumes that one alone has") {
  const Folder folder;
  folder.write("mesh.txt", triangles(true));
  const Injection<2> whole = std::get<Model<2>>(read({}, folder).model).injections.at(0);
  for (const int size : {2, 3}) {
    CAPTURE(size);
    std::vector<Injection<2>> parts(static_cast<std::size_t>(size));
    run_team(size, [&](const Team& team) {
      const Scenario scenario = read({}, folder, &team);
      parts[static_cast<std::size_t>(team.index())] =
          std::get<Model<2>>(scenario.model).injections.at(0);
    });
    std::size_t n = 0;
    for (const Injection<2>& part : parts) {
      CHECK(part.n_cells() == whole.n_cells());
      n += part.cells.size();
      for (std::size_t i = 0; i < part.cells.size(); ++i) {
        const auto at = static_cast<std::size_t>(part.position_of(i));
        CHECK(part.cells[i] == whole.cells.at(at));
        CHECK(part.x[i] == whole.x.at(at));
        CHECK(part.volume[i] == whole.volume.at(at));
      }
    }
    CHECK(n == whole.cells.size());
  }
}
