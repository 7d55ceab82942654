// Forces on single walls: at an edge, each wall has what it holds there, so that walls add up.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "tests/runtime/step/models.h"
#include "tests/within.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// Rows of all gauges, after each `steps`.
template <int Dim>
std::vector<std::vector<std::vector<double>>> rows_of(Model<Dim> model, Index steps) {
  model.output.measured.steps = steps;
  std::vector<std::vector<std::vector<double>>> rows;
  Observer observer;
  observer.gauges = [&](const GaugeRows& found) { rows.push_back(found.values); };
  Simulation simulation(model, flow(2), observer);
  simulation.gauges();
  simulation.run();
  rows.erase(rows.begin());  // nothing was measured yet
  return rows;
}

/// The first gauge is the sum of all others, in its forces and its moments, which are about 0.
void check_sums(const std::vector<std::vector<std::vector<double>>>& rows) {
  REQUIRE(rows.size() > 1);
  for (const auto& row : rows) {
    double largest = 0;
    for (const double value : row[0]) largest = std::max(largest, std::abs(value));
    CHECK(largest > 1e-3);
    for (std::size_t k = 0; k < row[0].size(); ++k) {
      double sum = 0;
      for (std::size_t wall = 1; wall < row.size(); ++wall) sum += row[wall][k];
      CHECK(std::abs(sum - row[0][k]) < 1e-11 * largest);
    }
  }
}

/// Water that sloshes in a tank of smooth walls, in which its surface is not level.
std::string tank(const std::string& walls, const std::string& analysis) {
  return R"({
    "mesh": {"structured": {"cell_size": 0.1, "extent": [0.5, 0.3, 0.6]},
      "boundary_conditions": {)" +
         walls + R"(}},
    "sets": {"nodes": {
      "floor": {"half_space": {"point": [0, 0, 0], "normal": [0, 0, 1]}},
      "left": {"half_space": {"point": [0, 0, 0], "normal": [1, 0, 0]}},
      "right": {"half_space": {"point": [0.5, 0, 0], "normal": [-1, 0, 0]}},
      "front": {"half_space": {"point": [0, 0, 0], "normal": [0, 1, 0]}},
      "back": {"half_space": {"point": [0, 0.3, 0], "normal": [0, -1, 0]}},
      "all": {"box": {"min": [-1, -1, -1], "max": [2, 2, 2]}}}},
    "materials": [{"name": "water", "type": "Newtonian", "density": 1000, "bulk_modulus": 1e5,
                   "dynamic_viscosity": 1e-3}],
    "particles": [
      {"generator": {"type": "region", "per_cell": 2, "material": 0,
        "region": {"box": {"min": [0, 0, 0], "max": [0.3, 0.3, 0.4]}}}},
      {"generator": {"type": "region", "per_cell": 2, "material": 0,
        "region": {"box": {"min": [0.3, 0, 0], "max": [0.5, 0.2, 0.2]}}}}],
    "external_loading_conditions": {"gravity": [0, 0, -9.81]},
    "analysis": {"dt": 1e-3, "nsteps": 100, "patch_particles": 64)" +
         analysis + R"(},
    "post_processing": {"gauges": [
      {"name": "all", "type": "force", "nset": "all"},
      {"name": "floor", "type": "force", "nset": "floor"},
      {"name": "left", "type": "force", "nset": "left"},
      {"name": "right", "type": "force", "nset": "right"},
      {"name": "front", "type": "force", "nset": "front"},
      {"name": "back", "type": "force", "nset": "back"}]}})";
}

constexpr const char* held = R"("velocity_constraints": [
  {"nset": "floor", "dir": "z", "velocity": 0},
  {"nset": "left", "dir": "x", "velocity": 0}, {"nset": "right", "dir": "x", "velocity": 0},
  {"nset": "front", "dir": "y", "velocity": 0}, {"nset": "back", "dir": "y", "velocity": 0}])";
constexpr const char* pushed = R"("walls": [
  {"nset": "floor", "normal": [0, 0, 1], "friction": 0},
  {"nset": "left", "normal": [1, 0, 0], "friction": 0},
  {"nset": "right", "normal": [-1, 0, 0], "friction": 0},
  {"nset": "front", "normal": [0, 1, 0], "friction": 0},
  {"nset": "back", "normal": [0, -1, 0], "friction": 0}])";

}  // namespace

TEST_CASE("forces on the smooth walls of a tank add up to that on all nodes") {
  for (const char* walls : {held, pushed})
    for (const char* analysis :
         {R"(, "mpm_scheme": "musl")", R"(, "shape_functions": "element", "mpm_scheme": "usf")"}) {
      CAPTURE(walls);
      CAPTURE(analysis);
      check_sums(rows_of<3>(model_of_text<3>(tank(walls, analysis)), 10));
    }
}

TEST_CASE("a smooth wall bears nothing along itself, at its edges neither") {
  const auto rows =
      rows_of<3>(model_of_text<3>(tank(held, R"(, "shape_functions": "element")")), 10);
  for (const auto& row : rows) {
    const auto &floor = row[1], &left = row[2], &front = row[4];
    const double least = 1e-12 * -floor[2];  // rounding of nodes that nothing holds
    CHECK(-floor[2] > 1);
    for (const double along : {floor[0], floor[1], left[1], left[2], front[0], front[2]})
      CHECK(std::abs(along) < least);
  }
}

TEST_CASE("at an edge a rough floor keeps its friction, and a smooth wall has none of it") {
  // A block flies into the corner of the floor and the wall, and slides.
  const auto model = model_of_text<2>(R"({
    "mesh": {"structured": {"cell_size": 0.1, "extent": [1.2, 1]},
      "boundary_conditions": {
        "walls": [{"nset": "floor", "normal": [0, 1], "friction": 0.4}],
        "velocity_constraints": [{"nset": "left", "dir": "x", "velocity": 0}]}},
    "sets": {"nodes": {
      "floor": {"half_space": {"point": [0, 0], "normal": [0, 1]}},
      "left": {"half_space": {"point": [0, 0], "normal": [1, 0]}},
      "all": {"box": {"min": [-1, -1], "max": [2, 2]}}}},
    "materials": [{"type": "LinearElastic", "density": 1000, "youngs_modulus": 1e5,
                   "poisson_ratio": 0.2}],
    "particles": [{"generator": {"type": "region", "per_cell": 2, "material": 0,
      "velocity": [-1, -0.5], "region": {"box": {"min": [0, 0], "max": [0.4, 0.4]}}}}],
    "external_loading_conditions": {"gravity": [0, -9.81]},
    "analysis": {"dt": 5e-4, "nsteps": 400, "patch_particles": 16},
    "post_processing": {"gauges": [{"name": "all", "type": "force", "nset": "all"},
                                   {"name": "floor", "type": "force", "nset": "floor"},
                                   {"name": "left", "type": "force", "nset": "left"}]}})");
  const auto rows = rows_of<2>(model, 20);
  check_sums(rows);
  double friction = 0;
  for (const auto& row : rows) {
    friction = std::max(friction, std::abs(row[1][0]));
    CHECK(std::abs(row[2][1]) < 1e-12 * std::abs(row[0][1]));
  }
  CHECK(friction > 1);
}
