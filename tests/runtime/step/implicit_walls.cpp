// Implicit steps at walls that push and rub, along any axes, and equilibria that there are not.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>
#include <string>

#include "physics/base/error.h"
#include "tests/runtime/step/models.h"
#include "tests/within.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// A block of 1 m x 0.5 m on a floor at y = 0, or `gap` above it.
struct Block {
  std::string gravity = "[0, -10]";
  std::string wall = R"({"nset": "floor", "normal": [0, 1], "friction": 0.3})";
  std::string settings = R"("quasi_static": false)";
  double dt = 0.01;
  int steps = 50;
  double gap = 0;

  Frame at_end() const {
    Simulation simulation(std::get<Model<2>>(read_scenario_text(text(), "").model), serial());
    simulation.run();
    return simulation.frame();
  }
  std::string text() const {
    return fmt::format(R"({{
      "mesh": {{"structured": {{"cell_size": 0.25, "extent": [3, 1.5]}},
        "boundary_conditions": {{"walls": [{}]}}}},
      "sets": {{"nodes": {{"floor": {{"half_space": {{"point": [0, 0], "normal": [0, 1]}}}}}}}},
      "materials": [{{"name": "stone", "type": "LinearElastic", "density": 2000,
                      "youngs_modulus": 1e7, "poisson_ratio": 0.2}}],
      "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": "stone",
        "region": {{"box": {{"min": [0.5, {}], "max": [1.5, {}]}}}}}}}}],
      "external_loading_conditions": {{"gravity": {}}},
      "analysis": {{"mpm_scheme": "newmark", "dt": {}, "nsteps": {},
                    "scheme_settings": {{{}}}}}}})",
                       wall, gap, gap + 0.5, gravity, dt, steps, settings);
  }
  static ExecutionOptions serial() {
    ExecutionOptions options;
    options.mode = ExecutionOptions::Mode::serial;
    return options;
  }
};

double mean_of(const Frame& frame, std::string_view field, int component) {
  const auto* column = frame.find(field);
  double sum = 0;
  const auto n = static_cast<double>(frame.id.size());
  for (std::size_t p = 0; p < frame.id.size(); ++p)
    sum += column->values[p * static_cast<std::size_t>(column->components) +
                          static_cast<std::size_t>(component)];
  return sum / n;
}

}  // namespace

TEST_CASE("implicit steps: a block slides with (g_x - mu g_y) t, with any step") {
  for (const int steps : {25, 50, 100}) {
    const Frame end = Block{.gravity = "[4, -10]", .dt = 0.5 / steps, .steps = steps}.at_end();
    CHECK(mean_of(end, "velocity", 0) == within(0.02, 0.5));
    CHECK(std::abs(mean_of(end, "velocity", 1)) < 1e-3);
  }
}

TEST_CASE("implicit steps: without friction a block slides freely, with enough it stays") {
  const Frame free =
      Block{.gravity = "[4, -10]", .wall = R"({"nset": "floor", "normal": [0, 1], "friction": 0})"}
          .at_end();
  CHECK(mean_of(free, "velocity", 0) == within(1e-6, 2.0));
  const Frame stuck = Block{.gravity = "[2, -10]"}.at_end();
  CHECK(std::abs(mean_of(stuck, "velocity", 0)) < 1e-3);
  CHECK(mean_of(stuck, "displacement", 0) < 1e-3);
}

TEST_CASE("implicit steps in 3D: friction acts against the sliding, along any direction") {
  const auto velocity = [](const std::string& gravity) {
    const std::string text = fmt::format(R"({{
      "mesh": {{"structured": {{"cell_size": 0.5, "extent": [3, 3, 1.5]}},
        "boundary_conditions": {{"walls": [{{"nset": "floor", "normal": [0, 0, 1],
                                            "friction": 0.3}}]}}}},
      "sets": {{"nodes": {{"floor": {{"half_space": {{"point": [0, 0, 0],
                                                      "normal": [0, 0, 1]}}}}}}}},
      "materials": [{{"name": "stone", "type": "LinearElastic", "density": 2000,
                      "youngs_modulus": 1e7, "poisson_ratio": 0.2}}],
      "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": "stone",
        "region": {{"box": {{"min": [0.5, 0.5, 0], "max": [1.5, 1.5, 0.5]}}}}}}}}],
      "external_loading_conditions": {{"gravity": {}}},
      "analysis": {{"mpm_scheme": "newmark", "dt": 0.01, "nsteps": 30}}}})",
                                         gravity);
    Simulation simulation(std::get<Model<3>>(read_scenario_text(text, "").model), Block::serial());
    simulation.run();
    const Frame end = simulation.frame();
    return Vec<2>(mean_of(end, "velocity", 0), mean_of(end, "velocity", 1));
  };
  const Vec<2> along_x = velocity("[5, 0, -10]"), across = velocity("[3, 4, -10]");
  CHECK(along_x[0] == within(0.01, 0.3 * 2));
  CHECK(std::abs(along_x[1]) < 1e-3);
  CHECK(across[0] == within(0.01, 0.3 * 2 * 0.6));
  CHECK(across[1] == within(0.01, 0.3 * 2 * 0.8));
}

TEST_CASE("implicit steps: a wall pushes and does not pull") {
  const Frame up = Block{.gravity = "[0, 1]"}.at_end();
  CHECK(mean_of(up, "velocity", 1) == within(1e-6, 0.5));
  CHECK(mean_of(up, "displacement", 1) == within(1e-6, 0.125));
}

TEST_CASE("quasi-static: weight on a floor, and friction up to its limit") {
  const std::string still = R"("quasi_static": true)";
  const Frame rest = Block{.settings = still, .dt = 1, .steps = 1}.at_end();
  // sigma_yy is -rho g (h - y) in the mean: half of it at the middle.
  CHECK(mean_of(rest, "stress", 1) == within(1e-3, -2000 * 10 * 0.25));
  CHECK(std::abs(mean_of(rest, "displacement", 0)) < 1e-12);
  const Frame held =
      Block{.gravity = "[2.5, -10]", .settings = still, .dt = 1, .steps = 2}.at_end();
  CHECK(mean_of(held, "displacement", 0) > 0);
  CHECK(mean_of(held, "displacement", 0) < 1e-3);
}

TEST_CASE("quasi-static: where nothing holds a body, the run says so and keeps its last state") {
  const Block sliding{
      .gravity = "[4, -10]", .settings = R"("quasi_static": true)", .dt = 1, .steps = 3};
  Simulation simulation(std::get<Model<2>>(read_scenario_text(sliding.text(), "").model),
                        Block::serial());
  std::string message;
  try {
    simulation.run();
  } catch (const SimulationError& error) {
    message = error.what();
  }
  CHECK(message.find("step 1 (t = 0 s): no equilibrium found") == 0);
  CHECK(message.find("most at node") != std::string::npos);
  CHECK(simulation.step() == 0);
  CHECK(mean_of(simulation.frame(), "displacement", 0) == 0.0);
}

TEST_CASE("implicit steps along a node's own axes are those along the mesh's") {
  // A normal that is hardly another gives nodes axes of their own.
  const Frame plain = Block{.gravity = "[4, -10]"}.at_end();
  const Frame normal = Block{.gravity = "[4, -10]",
                             .wall = R"({"nset": "floor", "normal": [1e-9, 1], "friction": 0.3})"}
                           .at_end();
  CHECK(mean_of(normal, "velocity", 0) == within(1e-6, mean_of(plain, "velocity", 0)));
  CHECK(mean_of(normal, "stress", 1) == within(1e-5, mean_of(plain, "stress", 1)));
}

TEST_CASE(
    "implicit steps: a block that falls on a floor comes to rest there, and makes no energy") {
  Block falling{.steps = 100, .gap = 0.125};
  Simulation simulation(std::get<Model<2>>(read_scenario_text(falling.text(), "").model),
                        Block::serial());
  simulation.run();
  const HistoryRow row = simulation.history();
  CHECK(row.kinetic + row.internal <= row.external + 1e-9 * std::abs(row.external));
  CHECK(mean_of(simulation.frame(), "displacement", 1) < 0);
  CHECK(mean_of(simulation.frame(), "displacement", 1) > -0.3);
}
