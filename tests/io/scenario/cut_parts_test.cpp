// Volumes of particles where surfaces, solids and outlines cut cells.
#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <numeric>

#include "io/scenario/particles_generator.h"
#include "tests/within.h"

using namespace lahar;

namespace {

template <int Dim>
Region<Dim> region_of(const std::string& text, const Geometries<Dim>& shapes = {}) {
  ProblemList problems;
  const JsonDocument document("region", text, problems);
  Region<Dim> region(document.root, 1e-9, document, problems, shapes);
  REQUIRE(problems.empty());
  return region;
}

template <int Dim>
double total(const NewParticles<Dim>& particles) {
  return std::accumulate(particles.volume.begin(), particles.volume.end(), 0.0);
}

Mesh<3> unit_cells(Index x, Index y, Index z) {
  return Mesh<3>::structured(Vec<3>(0, 0, 0), Vec<3>(1, 1, 1), {x, y, z});
}

/// A surface over a square from 0 to `size`, with points `step` apart.
template <class Height>
Geometry<3> over_square(double size, double step, Height height) {
  Surface<3>::Axes axes;
  for (int i = 0; i <= std::lround(size / step); ++i)
    for (auto& axis : axes) axis.push_back(i * step);
  std::vector<float> heights;
  for (const double y : axes[1])
    for (const double x : axes[0]) heights.push_back(static_cast<float>(height(x, y)));
  return {std::make_shared<Surface<3>>(axes, heights), nullptr, nullptr};
}

template <int Dim>
NewParticles<Dim> exactly(const Mesh<Dim>& mesh, const Region<Dim>& region, int n) {
  auto particles = fill_region<Dim>(mesh, region, n, Team(), {}, CutCells::exact);
  for (const auto& x : particles.x) CHECK(region.contains(x));
  return particles;
}

}  // namespace

TEST_CASE(
    "an inclined plane leaves half of a box to the particles, and no sliver alone in a cell") {
  const Mesh<3> mesh = unit_cells(10, 10, 10);
  Geometries<3> shapes;
  shapes["ground"] = over_square(10, 10, [](double x, double y) { return 1 + 0.5 * x + 0.3 * y; });
  const auto region = region_of<3>(R"({"below": "ground"})", shapes);
  for (const int n : {1, 2, 3}) {
    const auto particles = exactly(mesh, region, n);
    CHECK(total(particles) == test::within(1e-3, 500));
    CHECK(total(fill_region<3>(mesh, region, n)) == test::within(0.02, 500));
    // Centroids are right, too: the weight has the lever arm of the exact body.
    double moment = 0;
    for (std::size_t i = 0; i < particles.x.size(); ++i)
      moment += particles.volume[i] * particles.x[i].x();
    CHECK(moment / total(particles) == test::within(1e-3, 5 + 50.0 / 12 / 5));
  }
}

TEST_CASE("a thin layer of 0.3 cells has its volume") {
  const Mesh<3> mesh = unit_cells(12, 12, 12);
  Geometries<3> shapes;
  const auto slope = [](double x, double y) { return 4.13 + 0.4 * x - 0.1 * y; };
  shapes["bed"] = over_square(12, 3, slope);
  shapes["top"] = over_square(12, 3, [&](double x, double y) { return slope(x, y) + 0.3; });
  shapes["flat bed"] = over_square(12, 12, [](double, double) { return 3.61; });
  shapes["flat top"] = over_square(12, 12, [](double, double) { return 3.91; });
  const double volume = 12 * 12 * 0.3;
  for (const int n : {1, 2}) {
    const auto inclined = exactly(mesh, region_of<3>(R"({"between": ["bed", "top"]})", shapes), n);
    CHECK(total(inclined) == test::within(0.003, volume));
    const auto flat =
        exactly(mesh, region_of<3>(R"({"between": ["flat bed", "flat top"]})", shapes), n);
    CHECK(total(flat) == test::within(0.01, volume));
    for (const Vec<3>& x : flat.x) CHECK(x.z() == test::within(0.04, 3.76));
  }
}

TEST_CASE("a hill, a sphere, and a prism under an outline have their volumes") {
  const Mesh<3> mesh = unit_cells(16, 16, 10);
  Geometries<3> shapes;
  const auto hill = [](double x, double y) {
    return 2.2 + 5 * std::exp(-((x - 8) * (x - 8) + (y - 8) * (y - 8)) / 16);
  };
  shapes["hill"] = over_square(16, 0.125, hill);
  double volume = 0;
  for (int j = 0; j < 400; ++j)
    for (int i = 0; i < 400; ++i) volume += hill((i + 0.5) * 0.04, (j + 0.5) * 0.04) * 0.0016;
  CHECK(total(exactly(mesh, region_of<3>(R"({"below": "hill"})", shapes), 2)) ==
        test::within(1e-3, volume));
  shapes["ball"].solid = ball<3>({8.1, 7.7, 5.2}, 3.3);
  CHECK(total(exactly(mesh, region_of<3>(R"({"inside": "ball"})", shapes), 2)) ==
        test::within(2e-3, 4.0 / 3 * std::numbers::pi * std::pow(3.3, 3)));
  shapes["field"].outlines = std::make_shared<Outlines>(std::vector<Outlines::Polygon>{
      {{{1.3, 1.1}, {14.2, 2.7}, {9.1, 13.9}}, {{7, 5}, {9.5, 5}, {9.5, 8.2}, {7, 8.2}}}});
  const double area = 0.5 * ((14.2 - 1.3) * (13.9 - 1.1) - (9.1 - 1.3) * (2.7 - 1.1)) - 2.5 * 3.2;
  const auto prism = exactly(
      mesh,
      region_of<3>(
          R"({"intersection": [{"under": "field"}, {"box": {"min": [0, 0, 1.4], "max": [16, 16, 4]}}]})",
          shapes),
      2);
  CHECK(total(prism) == test::within(5e-3, area * 2.6));
}

TEST_CASE("cells in two dimensions and distorted ones are cut, too") {
  Geometries<2> shapes;
  shapes["line"].surface =
      std::make_shared<Surface<2>>(Surface<2>::Axes{{{0, 3, 10}}}, std::vector<float>{1, 4.3F, 6});
  const auto region = region_of<2>(R"({"below": "line"})", shapes);
  const double area = 3 * 0.5 * (1 + 4.3) + 7 * 0.5 * (4.3 + 6);
  const auto regular = Mesh<2>::structured(Vec<2>(0, 0), Vec<2>(1, 1), {10, 8});
  CHECK(total(exactly(regular, region, 2)) == test::within(2e-3, area));
  std::vector<Vec<2>> nodes;
  std::vector<std::array<Index, 4>> cells;
  for (int j = 0; j <= 8; ++j)
    for (int i = 0; i <= 10; ++i) {
      const bool inner = i > 0 && i < 10 && j > 0 && j < 8;
      nodes.emplace_back(i + (inner ? 0.2 * std::sin(3.0 * i + j) : 0),
                         j + (inner ? 0.2 * std::cos(2.0 * i - j) : 0));
    }
  for (Index j = 0; j < 8; ++j)
    for (Index i = 0; i < 10; ++i) {
      const Index first = j * 11 + i;
      cells.push_back({first, first + 1, first + 12, first + 11});
    }
  const Mesh<2> distorted = Mesh<2>::from_tables(nodes, cells, true);
  CHECK(total(exactly(distorted, region, 2)) == test::within(3e-3, area));
}

TEST_CASE("parts inside of a region are the same whether cut parts are exact or not") {
  const Mesh<3> mesh = unit_cells(6, 6, 6);
  const auto region = region_of<3>(R"({"box": {"min": [1, 1, 1], "max": [5, 4, 3]}})");
  const auto exact = exactly(mesh, region, 2), centres = fill_region<3>(mesh, region, 2);
  CHECK(exact.x == centres.x);
  CHECK(exact.cell == centres.cell);
  CHECK(exact.volume == centres.volume);
}

TEST_CASE("a part with little inside gives its volume to a neighbour in the cell") {
  const Mesh<3> mesh = unit_cells(4, 4, 4);
  Geometries<3> shapes;
  shapes["low"] = over_square(4, 4, [](double, double) { return 2.52; });
  const auto merged = exactly(mesh, region_of<3>(R"({"below": "low"})", shapes), 2);
  CHECK(merged.x.size() == 4 * 4 * 4 * 5);  // nothing of its own above 2.5
  CHECK(total(merged) == test::within(2e-4, 16 * 2.52));
  // Without a neighbour it stays: the volume is not lost.
  shapes["film"] = over_square(4, 4, [](double, double) { return 3.02; });
  const auto alone = exactly(mesh, region_of<3>(R"({"below": "film"})", shapes), 1);
  CHECK(alone.x.size() == 4 * 4 * 4);
  CHECK(total(alone) == test::within(1e-3, 16 * 3.02));
}
