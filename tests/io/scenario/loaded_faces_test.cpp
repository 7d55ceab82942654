// The total force of tractions in meshes whose cells are no boxes: that on the faces at which
// material ends.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

#include "tests/io/base/team_folder.h"
#include "tests/io/base/thread_team.h"
#include "tests/io/scenario/said.h"

using namespace lahar;
using namespace lahar::test;

namespace {

constexpr double pressed = -1000;  // [Pa]

using Move = std::function<std::array<double, 2>(double, double)>;

/// A mesh file of nx x ny squares with edges h, cut into triangles or not, whose nodes are moved.
std::string flat_mesh(int nx, int ny, double h, bool triangles, const Move& move = {}) {
  std::string nodes, cells;
  int count = 0;
  for (int j = 0; j <= ny; ++j)
    for (int i = 0; i <= nx; ++i) {
      std::array<double, 2> x{i * h, j * h};
      if (move) x = move(x[0], x[1]);
      nodes += fmt::format("{:.17g} {:.17g}\n", x[0], x[1]);
    }
  for (int j = 0; j < ny; ++j)
    for (int i = 0; i < nx; ++i) {
      const int a = j * (nx + 1) + i, b = a + 1, c = b + nx + 1, d = c - 1;
      cells += triangles ? fmt::format("{} {} {}\n{} {} {}\n", a, b, c, a, c, d)
                         : fmt::format("{} {} {} {}\n", a, b, c, d);
      count += triangles ? 2 : 1;
    }
  return fmt::format("{} {}\n", (nx + 1) * (ny + 1), count) + nodes + cells;
}

/// A mesh file of n x n x 2 n cubes with edges 1 / n, each cut into six tetrahedra.
std::string solid_mesh(int n) {
  constexpr int tetrahedra[6][4] = {{0, 1, 2, 6}, {0, 2, 3, 6}, {0, 3, 7, 6},
                                    {0, 7, 4, 6}, {0, 4, 5, 6}, {0, 5, 1, 6}};
  const auto node = [&](int i, int j, int k) { return (k * (n + 1) + j) * (n + 1) + i; };
  std::string nodes, cells;
  for (int k = 0; k <= 2 * n; ++k)
    for (int j = 0; j <= n; ++j)
      for (int i = 0; i <= n; ++i)
        nodes +=
            fmt::format("{:.17g} {:.17g} {:.17g}\n", double(i) / n, double(j) / n, double(k) / n);
  for (int k = 0; k < 2 * n; ++k)
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i) {
        const int corners[8] = {node(i, j, k),
                                node(i + 1, j, k),
                                node(i + 1, j + 1, k),
                                node(i, j + 1, k),
                                node(i, j, k + 1),
                                node(i + 1, j, k + 1),
                                node(i + 1, j + 1, k + 1),
                                node(i, j + 1, k + 1)};
        for (const auto& t : tetrahedra)
          cells += fmt::format("{} {} {} {}\n", corners[t[0]], corners[t[1]], corners[t[2]],
                               corners[t[3]]);
      }
  return fmt::format("{} {}\n", (n + 1) * (n + 1) * (2 * n + 1), 12 * n * n * n) + nodes + cells;
}

struct Case {
  std::string element = "ED2T3";
  std::string body = R"("min": [0, 0], "max": [1, 1])", set = R"("min": [0, 0.9], "max": [1, 2])";
  std::string dir = "y";
  int per_cell = 2;
  std::string analysis = "";
  std::string loads = "";  ///< more of them
};

std::string text_of(const Case& c) {
  return fmt::format(R"({{"mesh": {{"mesh": "mesh.txt", "cell_type": "{}"}},
    "sets": {{"particles": {{"loaded": {{"box": {{{}}}}}}}}},
    "materials": [{{"name": "clay", "type": "LinearElastic", "density": 2000,
                    "youngs_modulus": 1e7, "poisson_ratio": 0.3}}],
    "particles": [{{"generator": {{"type": "region", "per_cell": {}, "material": "clay",
                                   "region": {{"box": {{{}}}}}}}}}],
    "external_loading_conditions": {{"particle_surface_traction":
        [{{"pset": "loaded", "dir": "{}", "traction": {}}}{}]}},
    "analysis": {{"nsteps": 1{}}}}})",
                     c.element, c.set, c.per_cell, c.body, c.dir, pressed, c.loads, c.analysis);
}

/// The force of traction `k` [N; N/m], as the run sums it up.
template <int Dim>
double force_of(const Scenario& scenario, std::size_t k = 0) {
  const auto& model = std::get<Model<Dim>>(scenario.model);
  const ParticleTraction& t = model.tractions[k];
  double force = 0;
  for (const Index id : t.particles) {
    std::size_t row = 0;
    while (model.particles.id_of(row) != id) ++row;
    const double r = model.particles.x[row][0], depth = depth_at(model.analysis, r),
                 volume = model.particles.volume[row];
    std::array<double, static_cast<std::size_t>(Dim)> edges;
    edges.fill(std::pow(volume / depth, 1.0 / Dim));
    if (!model.particles.edges.empty() && model.particles.edges[row][0] > 0)
      edges = model.particles.edges[row];
    double area = depth;
    for (int d = 0; d < Dim; ++d) area *= d == t.axis ? 1.0 : edges[static_cast<std::size_t>(d)];
    const bool along_r = model.analysis.plane == Plane::axisymmetric && t.axis == 0;
    force += t.traction * area * (along_r ? 1 + 0.5 * t.side * volume / (area * r) : 1.0);
  }
  return force;
}

template <int Dim = 2>
double force_on(const std::string& mesh, const Case& c, std::size_t k = 0) {
  const Folder folder;
  folder.write("mesh.txt", mesh);
  return force_of<Dim>(read_scenario_text(text_of(c), folder.path), k);
}

std::string said_of(const std::string& mesh, const Case& c) {
  const Folder folder;
  folder.write("mesh.txt", mesh);
  return warnings_of(read_scenario_text(text_of(c), folder.path));
}

}  // namespace

TEST_CASE("a traction on triangles is that on their faces, however thick the set is") {
  const std::string mesh = flat_mesh(4, 6, 0.25, true);
  for (const int per_cell : {1, 2, 3})
    for (const char* low : {"0.9", "0.8", "0.7"}) {
      CAPTURE(per_cell);
      CAPTURE(low);
      Case c{.set = fmt::format(R"("min": [0, {}], "max": [1, 2])", low), .per_cell = per_cell};
      CHECK(force_on(mesh, c) == doctest::Approx(pressed));
      c.dir = "x";
      CHECK(force_on(mesh, c) == doctest::Approx(pressed));
    }
}

TEST_CASE("a traction on tetrahedra is that on their faces") {
  Case c{.element = "ED3T4",
         .body = R"("min": [0, 0, 0], "max": [1, 1, 1.5])",
         .set = R"("min": [0, 0, 1.3], "max": [1, 1, 2])",
         .dir = "z"};
  for (const int per_cell : {1, 2}) {
    c.per_cell = per_cell;
    CHECK(force_on<3>(solid_mesh(2), c) == doctest::Approx(pressed));
  }
  c.dir = "x";
  CHECK(force_on<3>(solid_mesh(2), c) == doctest::Approx(pressed));
}

TEST_CASE("particles on two loaded sides of tetrahedra have the areas of both") {
  const Case c{.element = "ED3T4",
               .body = R"("min": [0, 0, 0], "max": [1, 1, 1.5])",
               .set = R"("min": [0, 0, 1.3], "max": [1, 1, 2])",
               .dir = "z",
               .loads = R"(, {"pset": "side", "dir": "x", "traction": -1000},
                           {"pset": "back", "dir": "y", "traction": -1000})"};
  std::string text = text_of(c);
  const std::string set = R"("loaded": )";
  text.insert(text.find(set), R"("side": {"box": {"min": [0.9, 0, 0], "max": [1, 1, 2]}},
                                 "back": {"box": {"min": [0, 0.9, 0], "max": [1, 1, 2]}}, )");
  const Folder folder;
  folder.write("mesh.txt", solid_mesh(2));
  const Scenario s = read_scenario_text(text, folder.path);
  CHECK(force_of<3>(s, 0) == doctest::Approx(pressed));
  CHECK(force_of<3>(s, 1) == doctest::Approx(1.5 * pressed));
  CHECK(force_of<3>(s, 2) == doctest::Approx(1.5 * pressed));
}

TEST_CASE("a traction on a slope of triangles or distorted quadrilaterals is that in plan") {
  const Move slope = [](double x, double y) { return std::array{x, y * (1 + 0.5 * x)}; };
  const Move bent = [](double x, double y) {
    const double inside = x * (1 - x) * y * (1 - y);
    return std::array{x + 0.8 * inside, y - 0.6 * inside};
  };
  for (const bool triangles : {true, false}) {
    CAPTURE(triangles);
    Case c{.element = triangles ? "ED2T3" : "ED2Q4",
           .body = R"("min": [0, 0], "max": [1, 2])",
           .set = R"("min": [0, 0], "max": [1, 2])"};
    // A set of all of a body whose other sides do not look upwards.
    CHECK(force_on(flat_mesh(4, 4, 0.25, triangles, slope), c) == doctest::Approx(pressed));
    c.set = R"("min": [0, 0.9], "max": [1, 2])";
    CHECK(force_on(flat_mesh(4, 4, 0.25, triangles, bent), c) == doctest::Approx(pressed));
    c.dir = "x";
    CHECK(force_on(flat_mesh(4, 4, 0.25, triangles, bent), c) == doctest::Approx(pressed));
  }
}

TEST_CASE("a traction on boxes of several sizes is that on the faces of those that are loaded") {
  const Move graded = [](double x, double y) { return std::array{x * x, 1 - (1 - y) * (1 - y)}; };
  Case c{.element = "ED2Q4",
         .body = R"("min": [0, 0], "max": [1, 2])",
         .set = R"("min": [0, 0.97], "max": [1, 2])"};
  CHECK(force_on(flat_mesh(4, 4, 0.25, false, graded), c) == doctest::Approx(pressed));
  c.dir = "x";
  CHECK(force_on(flat_mesh(4, 4, 0.25, false, graded), c) == doctest::Approx(pressed));
}

TEST_CASE("a set that ends within cells has its part of their faces") {
  for (const double right : {0.5, 0.625, 0.4}) {
    CAPTURE(right);
    const Case c{.set = fmt::format(R"("min": [0, 0.9], "max": [{}, 2])", right), .per_cell = 4};
    CHECK(std::abs(force_on(flat_mesh(4, 6, 0.25, true), c) / (right * pressed) - 1) < 0.1);
  }
}

TEST_CASE("a traction on a plate of one cell acts on one side of it") {
  const Case c{.body = R"("min": [0, 0], "max": [1, 0.25])",
               .set = R"("min": [0, 0], "max": [1, 1])"};
  const std::string mesh = flat_mesh(4, 6, 0.25, true);
  CHECK(force_on(mesh, c) == doctest::Approx(pressed));
  Case tip = c;
  tip.set = R"("min": [0.9, 0], "max": [1, 1])";
  tip.dir = "x";
  CHECK(force_on(mesh, tip) == doctest::Approx(0.25 * pressed));
}

TEST_CASE(
    "a traction on a narrow strip acts across itself, where a side of the mesh is larger, too") {
  const std::string mesh = flat_mesh(8, 4, 0.1, true, [](double x, double y) {
    return std::array{x, 2.5 * y};  // triangles that are higher than wide
  });
  const Case c{.body = R"("min": [0, 0], "max": [0.8, 1])",
               .set = R"("min": [0, 0.76], "max": [0.1, 1])"};
  CHECK(std::abs(force_on(mesh, c) / (0.1 * pressed) - 1) < 1e-6);
  CHECK(says(said_of(mesh, c), "it is -100 N/m on 0.1 m, the surface as seen along y"));
  Case wide = c;
  wide.set = R"("min": [0, 0.76], "max": [0.2, 1])";
  CHECK(std::abs(force_on(mesh, wide) / (0.2 * pressed) - 1) < 1e-6);
}

TEST_CASE("tractions on rings of triangles act on the whole ring") {
  Case c{.analysis = R"(, "plane": "axisymmetric")"};
  const std::string mesh = flat_mesh(4, 6, 0.25, true);
  CHECK(std::abs(force_on(mesh, c) / (std::numbers::pi * pressed) - 1) < 1e-3);
  c.set = R"("min": [0.9, 0], "max": [1, 1])";
  c.dir = "x";
  CHECK(std::abs(force_on(mesh, c) / (2 * std::numbers::pi * pressed) - 1) < 1e-6);
  c.dir = "y";
  CHECK(std::abs(force_on(mesh, c) / (2 * std::numbers::pi * pressed) - 1) < 1e-6);
}

TEST_CASE("a traction on triangles is the same on any ranks") {
  const Folder folder;
  folder.write("mesh.txt", flat_mesh(4, 6, 0.25, true));
  folder.write("case.json", text_of(Case{}));
  const double whole = force_of<2>(read_scenario(folder.path / "case.json"));
  const auto sides = std::get<Model<2>>(read_scenario(folder.path / "case.json").model).tractions;
  for (const int size : {2, 3, 5}) {
    std::vector<double> force(static_cast<std::size_t>(size), 0.0);
    run_team(size, [&](const Team& team) {
      const Scenario s = read_scenario(folder.path / "case.json", {{}, false, &team});
      force[static_cast<std::size_t>(team.index())] = force_of<2>(s);
      const auto& own = std::get<Model<2>>(s.model).tractions;
      if (own.size() != sides.size() || own[0].traction != sides[0].traction)
        throw std::logic_error("another traction");
      if (s.loads != std::vector<std::string>{"loaded: -1000 N/m along y (-1000 Pa on 1 m)"})
        throw std::logic_error("another load");
    });
    double sum = 0;
    for (const double one : force) sum += one;
    CHECK(sum == doctest::Approx(whole));
  }
}

TEST_CASE("particles of triangles that are at no surface, or behind it, are warned of") {
  const std::string mesh = flat_mesh(4, 6, 0.25, true);
  const Case inside{.set = R"("min": [0.3, 0.3], "max": [0.7, 0.7])"};
  CHECK(says(said_of(mesh, inside), "the cells of these particles have material all around"));
  const Case thick{.set = R"("min": [0, 0.3], "max": [1, 2])"};
  CHECK(says(said_of(mesh, thick),
             "particles of this traction lie behind others, and get none: it is -1000 N/m on 1 m, "
             "the surface as seen along y"));
  CHECK(force_on(mesh, thick) == doctest::Approx(pressed));
  CHECK(said_of(mesh, Case{}) == "");
}
