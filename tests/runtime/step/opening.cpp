// Loose material in whole runs: volumes, steps, and the same bits however they are executed.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "io/frames/csv.h"
#include "tests/runtime/step/restart_checks.h"
#include "tests/within.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// Dry sand that falls and is pulled apart as it does.
Model<2> torn_sand(const std::string& more) {
  return model_of_text<2>(R"({
    "mesh": {"structured": {"cell_size": 0.05, "extent": [1, 2]}},
    "materials": [{"type": "MohrCoulomb", "density": 1600, "youngs_modulus": 1e5,
                   "poisson_ratio": 0.3, "friction": 30, "dilation": 0, "cohesion": 0,
                   "tension_cutoff": 0}],
    "particles": [
      {"generator": {"type": "region", "per_cell": 2, "material": 0, "velocity": [-0.5, 0],
                     "region": {"box": {"min": [0.4, 1.7], "max": [0.5, 1.9]}}}},
      {"generator": {"type": "region", "per_cell": 2, "material": 0, "velocity": [0.5, 0],
                     "region": {"box": {"min": [0.5, 1.7], "max": [0.6, 1.9]}}}}],
    "external_loading_conditions": {"gravity": [0, -9.81]},
    "analysis": {"mpm_scheme": "musl", "time_step": {"adaptive": true, "safety": 0.4},
                 "end_time": 0.3, "nsteps": 100000, "patch_particles": 16)" +
                          more + R"(},
    "post_processing": {"output_steps": 100000, "history_steps": 1}})");
}

/// A column of sand on a floor, of many patches.
Model<2> column_of_sand() {
  return model_of_text<2>(R"({
    "mesh": {"structured": {"cell_size": 0.1, "extent": [3, 1.5]},
             "boundary_conditions": {"velocity_constraints": [
               {"nset": "floor", "dir": "y", "velocity": 0}]}},
    "sets": {"nodes": {"floor": {"half_space": {"point": [0, 0], "normal": [0, 1]}}}},
    "materials": [{"type": "MohrCoulomb", "density": 1600, "youngs_modulus": 1e5,
                   "poisson_ratio": 0.3, "friction": 30, "dilation": 0, "cohesion": 0,
                   "tension_cutoff": 0}],
    "particles": [{"generator": {"type": "region", "per_cell": 2, "material": 0,
                                 "velocity": [1, 1],
                                 "region": {"box": {"min": [1, 0], "max": [1.6, 1]}}}}],
    "external_loading_conditions": {"gravity": [0, -9.81]},
    "analysis": {"dt": 2e-3, "nsteps": 120, "patch_particles": 32},
    "post_processing": {"output_steps": 40, "history_steps": 10}})");
}

double largest(const Frame& frame, const char* name) {
  const FrameColumn* column = frame.find(name);
  return column ? *std::max_element(column->values.begin(), column->values.end()) : -1;
}

constexpr double first_volume = 0.025 * 0.025;

constexpr Scheme schemes[] = {Scheme::usf, Scheme::usl, Scheme::musl};

}  // namespace

TEST_CASE("sand without cohesion that is torn apart as it falls keeps its volume and its step") {
  const Outcome torn = run(torn_sand(""), serial());
  REQUIRE(torn.error == "");
  const Frame& end = torn.frames.back();
  CHECK(largest(end, "volume") < 1.001 * first_volume);
  CHECK(largest(end, "opening") > 0.3);
  double shortest = 1;
  for (const HistoryRow& row : torn.rows)
    if (row.step > 1 && row.time < 0.29) shortest = std::min(shortest, row.dt);
  CHECK(shortest > 0.75 * torn.rows[1].dt);  // it falls with the speed alone

  const Outcome grown = run(torn_sand(R"(, "opening": false)"), serial());
  CHECK(largest(grown.frames.back(), "volume") > 1.3 * first_volume);
  CHECK(!grown.frames.back().find("opening"));
}

TEST_CASE("what sand that spreads becomes larger by is known as gaps, also in full cells") {
  const auto spread = [](ShapeFunctions functions, Plane plane) {
    Model<2> model =
        model_of_text<2>(fmt::format(R"({{
      "mesh": {{"structured": {{"cell_size": 0.1, "extent": [2, 2]}}}},
      "materials": [{{"type": "MohrCoulomb", "density": 1600, "youngs_modulus": 1e5,
                     "poisson_ratio": 0.3, "friction": 30, "dilation": 0, "cohesion": 0,
                     "tension_cutoff": 0}}],
      "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": 0,
                                   "region": {{"box": {{"min": [0, 0.5], "max": [1, 1.5]}}}}}}}}],
      "analysis": {{"dt": 1e-3, "nsteps": 200, "plane": "{}"}},
      "post_processing": {{"output_steps": 200, "history_steps": 200}}}})",
                                     plane == Plane::strain ? "strain" : "axisymmetric"));
    model = with_functions(std::move(model), functions);
    constexpr double rate = 0.5;  // all lengths grow by 0.1
    for (const Vec<2>& x : model.particles.x)
      model.particles.velocity.push_back(rate * (x - Vec<2>(0, 1)));
    const Outcome outcome = run(model, serial());
    REQUIRE(outcome.error == "");
    double before = 0, after = 0;
    for (const double volume : model.particles.volume) before += volume;
    const Frame& end = outcome.frames.back();
    for (std::size_t p = 0; p < end.find("volume")->values.size(); ++p)
      after += end.find("volume")->values[p] * (1 + end.find("opening")->values[p]);
    return after / before;
  };
  for (const auto functions :
       {ShapeFunctions::element, ShapeFunctions::gimp, ShapeFunctions::quadratic_spline}) {
    CAPTURE(static_cast<int>(functions));
    CHECK(spread(functions, Plane::strain) == within(0.03, 1.1 * 1.1));
    CHECK(spread(functions, Plane::axisymmetric) == within(0.03, 1.1 * 1.1 * 1.1));
  }
}

TEST_CASE("in CB-Geo's input volumes follow the velocity field") {
  const std::string type = R"(, "type": "MPMExplicit2D")";
  CHECK(!torn_sand(type).analysis.opening);
  CHECK(torn_sand(type + R"(, "opening": true)").analysis.opening);
}

TEST_CASE(
    "loose material: every scheme gives the serial loop's bits, and goes on after a restart") {
  for (const Scheme scheme : schemes)
    for (const bool adaptive : {false, true}) {
      CAPTURE(static_cast<int>(scheme));
      CAPTURE(adaptive);
      for (Model<2> model : {column_of_sand(), dam_break()}) {
        model.analysis.scheme = scheme;
        model.analysis.pressure_smoothing = true;
        if (adaptive) model.analysis.step = {.adaptive = true, .dt = 2e-3, .safety = 0.3};
        model.analysis.nsteps = 100;
        const Outcome reference = run(model, serial());
        CHECK(reference.error == "");
        if (!adaptive) CHECK(largest(reference.frames.back(), "opening") > 0);
        for (const ExecutionOptions& way : {flow(2), random_order(4)})
          CHECK(same_bits(run(model, way), reference));
        check_restart(model, 50, 100, {flow(2)});
      }
    }
  for (const ShapeFunctions functions :
       {ShapeFunctions::gimp, ShapeFunctions::cpdi, ShapeFunctions::quadratic_spline}) {
    CAPTURE(static_cast<int>(functions));
    Model<2> model = with_functions(column_of_sand(), functions);
    model.analysis.nsteps = 60;
    const Outcome reference = run(model, serial());
    CHECK(reference.error == "");
    CHECK(same_bits(run(model, flow(2)), reference));
    check_restart(model, 30, 60, {flow(2)});
  }
}

TEST_CASE("tables have the opening beside state variables, whose numbers stay the law's") {
  Model<2> model = dam_break();
  model.analysis.nsteps = 5;
  const Outcome outcome = run(model, serial());
  const Frame& frame = outcome.frames.back();
  REQUIRE(frame.find("opening"));
  const Frame table = parse_csv(csv_text(frame), "table");
  REQUIRE(table.find("svars_0"));
  CHECK(!table.find("svars_1"));
  CHECK(table.find("svars_0")->values == frame.find("pressure")->values);
  CHECK(table.find("opening")->values == frame.find("opening")->values);
}
