#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>

#include "io/scenario/scenario.h"
#include "runtime/step/simulation.h"
#include "tests/plain_defaults.h"
#include "tests/within.h"

using namespace lahar;

// The reference code gives nodes below 1e-15 kg no acceleration; a model in micrometres has no
// others.
TEST_CASE("a body of any size falls under gravity: momentum is m g t") {
  for (const double h : {1.0, 1e-3, 1e-6, 1e-9, 1e-13}) {
    CAPTURE(h);
    const std::string text = fmt::format(
        R"({{"mesh": {{"structured": {{"cell_size": {0}, "counts": [6, 12]}}}},
            "particles": [{{"generator": {{"type": "region", "material": 0, "per_cell": 2,
               "region": {{"box": {{"min": [{1}, {2}], "max": [{3}, {4}]}}}}}}}}],
            "materials": [{{"type": "LinearElastic2D", "density": 1000, "youngs_modulus": 1e6,
                           "poisson_ratio": 0.3}}],
            "external_loading_conditions": {{"gravity": [0, -10]}},
            "analysis": {{"dt": {5}, "nsteps": 20}}}})",
        h, 2 * h, 7 * h, 4 * h, 10 * h, 1e-3 * h);
    Simulation simulation(
        std::get<Model<2>>(read_scenario_text(text, ".", test::plain_defaults(text)).model));
    simulation.run();
    const HistoryRow row = simulation.history();
    CHECK(row.mass > 0);
    CHECK(row.momentum[1] == test::within(1e-9, -10 * row.mass * simulation.time()));
  }
}

// USL updates stresses after positions: what goes wrong there in the last step, no step sees.
TEST_CASE("a stress that is not finite is reported even if it arises in the last step") {
  for (const char* scheme : {"usf", "usl", "musl"}) {
    CAPTURE(scheme);
    const std::string text = fmt::format(
        R"({{"mesh": {{"structured": {{"cell_size": 1, "counts": [4, 4]}},
                       "boundary_conditions": {{"velocity_constraints": [
                          {{"nset": "left", "dir": "x", "velocity": 0}}]}}}},
            "sets": {{"nodes": {{"left": {{"half_space": {{"point": [1, 0], "normal": [1, 0]}}}}}}}},
            "particles": [{{"generator": {{"type": "region", "material": 0, "per_cell": 2,
               "velocity": [1.1, 0], "region": {{"box": {{"min": [1, 1], "max": [3, 3]}}}}}}}}],
            "materials": [{{"type": "LinearElastic2D", "density": 1, "youngs_modulus": 1e307,
                           "poisson_ratio": 0.49}}],
            "analysis": {{"mpm_scheme": "{}", "dt": 1, "nsteps": 1,
                          "time_step": {{"accept_unstable": true}}}}}})",
        scheme);
    Simulation simulation(
        std::get<Model<2>>(read_scenario_text(text, ".", test::plain_defaults(text)).model));
    std::string message;
    try {
      simulation.run();
    } catch (const SimulationError& error) {
      message = error.what();
    }
    CHECK(message.find("step 0 (t = 0 s), rank 0, patch 0, stage ") == 0);
    CHECK(message.find("is not finite") != std::string::npos);
  }
}

TEST_CASE("a run whose particles have all been removed goes on to its end, with time and step") {
  const std::string text =
      R"({"mesh": {"structured": {"cell_size": 1, "counts": [40, 4]}},
          "particles": [{"generator": {"type": "region", "material": 0, "per_cell": 1,
             "velocity": [100, 0], "region": {"box": {"min": [36, 1], "max": [38, 2]}}}}],
          "materials": [{"type": "LinearElastic2D", "density": 1, "youngs_modulus": 1,
                         "poisson_ratio": 0}],
          "analysis": {"dt": 0.005, "nsteps": 30, "locate_particles": false, "patch_particles": 1},
          "post_processing": {"output_steps": 10, "history_steps": 1}})";
  for (const auto mode : {ExecutionOptions::Mode::serial, ExecutionOptions::Mode::random_order,
                          ExecutionOptions::Mode::flow_graph}) {
    std::vector<Index> frames, rows;
    Observer observer;
    observer.frame = [&](FramePieces&& frame) { frames.push_back(frame.header.step); };
    observer.history = [&](const HistoryRow& row) { rows.push_back(row.step); };
    ExecutionOptions options;
    options.mode = mode;
    Simulation simulation(
        std::get<Model<2>>(read_scenario_text(text, ".", test::plain_defaults(text)).model),
        options, observer);
    simulation.run();
    CHECK(simulation.info().particles == 0);
    CHECK(simulation.info().removed == 2);
    CHECK(rows.size() == 30);
    CHECK(frames == std::vector<Index>{10, 20, 30});
    CHECK(simulation.frame().step == 30);
    CHECK(simulation.frame().time == doctest::Approx(0.15));
  }
}
