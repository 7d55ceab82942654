// Newmark's method (1959): what it keeps, what it damps, and its order.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "tests/verification/case.h"
#include "tests/within.h"

using namespace lahar;
using namespace lahar::verification;

namespace {

struct Run {
  double dt, end;
  double beta = 0.25, gamma = 0.5;
  std::string functions = "element";
  std::string more = "";  ///< of the scenario
};

/// A bar of 25 m, held at its left end, c = 10 m/s, that begins in its first mode: v = v0 sin(b x),
/// b = pi / (2 L). Its period is 10 s. It moves by 1e-5 of a cell, so that the mesh sees a linear
/// system.
constexpr double length = 25, v0 = 1e-5;

Model<2> bar(const Run& run) {
  Model<2> model = model_of_text<2>(fmt::format(
      R"({{
    "mesh": {{"structured": {{"cell_size": 1, "extent": [30, 1]}},
             "boundary_conditions": {{"velocity_constraints": [
               {{"nset": -1, "dir": "y", "velocity": 0}},
               {{"nset": "wall", "dir": "x", "velocity": 0}}]}}}},
    "sets": {{"nodes": {{"wall": {{"half_space": {{"point": [0, 0], "normal": [1, 0]}}}},
                         "middle": {{"box": {{"min": [12, 0], "max": [12, 1]}}}}}},
             "particles": {{"tip": {{"box": {{"min": [24, 0], "max": [25, 1]}}}}}}}},{}
    "materials": [{{"type": "LinearElastic", "density": 1, "youngs_modulus": 100,
                   "poisson_ratio": 0}}],
    "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": 0,
                                 "region": {{"box": {{"max": [25, 1]}}}}}}}}],
    "analysis": {{"mpm_scheme": "newmark", "shape_functions": "{}", "dt": {}, "nsteps": 1000000,
                 "end_time": {},
                 "scheme_settings": {{"beta": {}, "gamma": {}, "displacement_tolerance": 0,
                                     "relative_residual_tolerance": 1e-11}}}}}})",
      run.more, run.functions, run.dt, run.end, run.beta, run.gamma));
  model.particles.velocity.clear();
  for (const Vec<2>& x : model.particles.x)
    model.particles.velocity.push_back({v0 * std::sin(0.5 * std::numbers::pi * x[0] / length), 0});
  return model;
}

/// Mean of the velocity over the bar after each step.
std::vector<HistoryRow> rows_of(const Run& run) {
  std::vector<HistoryRow> rows;
  Model<2> model = bar(run);
  model.output.history_steps = 1;
  Observer observer;
  observer.history = [&](const HistoryRow& row) { rows.push_back(row); };
  Simulation simulation(std::move(model), {.threads = 1}, observer);
  simulation.run();
  return rows;
}

/// Mean time between upward zeros of the momentum [s].
double period_of(const std::vector<HistoryRow>& rows) {
  std::vector<double> zeros;
  for (std::size_t k = 1; k < rows.size(); ++k) {
    const double a = rows[k - 1].momentum[0], b = rows[k].momentum[0];
    if (a <= 0 && b > 0) zeros.push_back(rows[k].time - rows[k].dt * b / (b - a));
  }
  REQUIRE(zeros.size() > 2);
  return (zeros.back() - zeros.front()) / static_cast<double>(zeros.size() - 1);
}

double largest_kinetic(const std::vector<HistoryRow>& rows, double from, double to) {
  double largest = 0;
  for (const HistoryRow& row : rows)
    if (row.time > from && row.time <= to) largest = std::max(largest, row.kinetic);
  return largest;
}

}  // namespace

TEST_CASE("Newmark: a bar has its first frequency and keeps its energy over 50 periods") {
  for (const char* const functions : {"element", "gimp", "quadratic_spline"}) {
    const auto rows = rows_of({.dt = 0.1, .end = 500, .functions = functions});
    const double period = period_of(rows), start = rows.front().kinetic;
    double worst = 0;
    for (const HistoryRow& row : rows) worst = std::max(worst, std::abs(row.balance));
    MESSAGE(functions << ": period " << period << ", energy " << worst / start << ", kinetic "
                      << largest_kinetic(rows, 490, 500) / start);
    CHECK(period == test::within(0.002, 10));
    CHECK(worst < 0.02 * start);  // measured 1.1, 1.2, 1.5 %
  }
}

TEST_CASE("Newmark: gamma above 0.5 damps by (gamma - 0.5) omega dt / 2 of critical") {
  for (const double gamma : {0.55, 0.6}) {
    const Run run{.dt = 0.1, .end = 200, .beta = std::pow(gamma + 0.5, 2) / 4, .gamma = gamma};
    const auto rows = rows_of(run);
    const double omega = 0.2 * std::numbers::pi;
    const double share = 0.5 * (gamma - 0.5) * omega * run.dt;
    const double left = largest_kinetic(rows, 190, 200) / largest_kinetic(rows, 0, 10);
    MESSAGE(gamma << ": " << left);
    CHECK(left == test::within(0.05, std::exp(-2 * share * omega * 190)));
  }
}

TEST_CASE("Newmark: errors fall with the second order of the step") {
  for (const char* const functions : {"element", "quadratic_spline"}) {
    const auto velocity = [&](double dt) {
      Simulation simulation(bar({.dt = dt, .end = 8, .functions = functions}), {.threads = 1});
      simulation.run();
      std::vector<double> all;
      const State state(simulation.frame());
      for (Index p = 0; p < state.size(); ++p) {
        all.push_back(state.get("velocity", p));
        all.push_back(0.2 * std::numbers::pi * state.get("displacement", p));
      }
      return all;
    };
    const auto fine = velocity(0.0125);
    const auto error = [&](double dt) {
      const auto coarse = velocity(dt);
      double sum = 0;
      for (std::size_t k = 0; k < fine.size(); ++k) sum += std::pow(coarse[k] - fine[k], 2);
      return std::sqrt(sum);
    };
    const double first = error(0.4), second = error(0.2), third = error(0.1);
    // The reference has an error of its own, of 1 / 64 of that at 0.1 s.
    MESSAGE(functions << ": " << std::log2(first / second) << " " << std::log2(second / third));
    CHECK(std::log2(first / second) == test::within(0.1, 2));
    CHECK(std::log2(second / third) == test::within(0.1, 2));
  }
}

TEST_CASE("Newmark: free fall is exact, and momentum is kept when bodies meet") {
  for (const char* const functions : {"element", "gimp", "quadratic_spline"}) {
    Model<2> model = model_of_text<2>(fmt::format(
        R"({{"mesh": {{"structured": {{"cell_size": 0.25, "extent": [4, 3]}}}},
            "materials": [{{"type": "LinearElastic", "density": 1000, "youngs_modulus": 1e5,
                           "poisson_ratio": 0.3}}],
            "particles": [
              {{"generator": {{"type": "region", "per_cell": 2, "material": 0, "velocity": [1, 1],
                              "region": {{"box": {{"min": [0.5, 1], "max": [1.5, 2]}}}}}}}},
              {{"generator": {{"type": "region", "per_cell": 2, "material": 0, "velocity": [-1, 0],
                              "region": {{"sphere": {{"centre": [3, 2], "radius": 0.5}}}}}}}}],
            "external_loading_conditions": {{"gravity": [0.5, -2]}},
            "analysis": {{"mpm_scheme": "newmark", "shape_functions": "{}", "dt": 0.025,
                         "nsteps": 24, "scheme_settings": {{"relative_residual_tolerance": 1e-12}}}}}})",
        functions));
    Simulation simulation(std::move(model), {.threads = 1});
    const State start(simulation.frame());
    const HistoryRow before = simulation.history();
    simulation.advance(4);  // they are more than two cells apart
    const State flying(simulation.frame());
    const double t = flying.time();
    double worst_x = 0, worst_v = 0;
    const double g[2] = {0.5, -2};
    for (Index p = 0; p < start.size(); ++p)
      for (int d = 0; d < 2; ++d) {
        const double v = start.get("velocity", p, d);
        worst_x = std::max(worst_x,
                           std::abs(flying.x(p, d) - start.x(p, d) - v * t - 0.5 * g[d] * t * t));
        worst_v = std::max(worst_v, std::abs(flying.get("velocity", p, d) - v - g[d] * t));
      }
    simulation.advance(20);
    const HistoryRow after = simulation.history();
    MESSAGE(functions << ": " << worst_x << " " << worst_v << " stress "
                      << after.internal / before.kinetic);
    CHECK(worst_x < 1e-12);
    CHECK(worst_v < 1e-12);
    for (std::size_t d = 0; d < 2; ++d)
      CHECK(std::abs(after.momentum[d] - before.momentum[d] - after.mass * g[d] * after.time) <
            1e-10 * after.mass);
    CHECK(after.internal > 0.01 * before.kinetic);  // they have met
  }
}

TEST_CASE("Newmark: the work of a load that grows is what the body has") {
  Run run{.dt = 0.1, .end = 20};
  run.more = R"(
    "external_loading_conditions": {"particle_surface_traction": [
      {"pset": "tip", "dir": "x", "traction": 1e-4, "math_function_id": 0}],
      "concentrated_nodal_forces": [
      {"nset": "middle", "dir": "x", "force": 1e-4, "math_function_id": 0}]},
    "math_functions": [{"id": 0, "type": "Linear", "xvalues": [0, 20], "fxvalues": [0, 1]}],)";
  Model<2> model = bar(run);
  for (Vec<2>& v : model.particles.velocity) v.setZero();
  Simulation simulation(std::move(model), {.threads = 1});
  simulation.run();
  const HistoryRow end = simulation.history();
  MESSAGE("balance " << end.balance << " of " << end.external);
  CHECK(end.external > 0);
  CHECK(std::abs(end.balance) < 1e-3 * end.external);
}

TEST_CASE("implicit steps: nodes that are moved do the work that the body stores") {
  // A bar that is pulled at its end, whose force grows: without inertia, or in 40 times the time
  // that a wave takes through it.
  const auto balance = [](int steps, bool still) {
    const double end = still ? 1 : 40;
    Model<2> model = model_of_text<2>(fmt::format(
        R"({{
      "mesh": {{"structured": {{"cell_size": 1, "extent": [12, 1]}},
               "boundary_conditions": {{"velocity_constraints": [
                 {{"nset": -1, "dir": "y", "velocity": 0}},
                 {{"nset": "wall", "dir": "x", "velocity": 0}},
                 {{"nset": "pulled", "dir": "x", "velocity": 1e-4}}]}}}},
      "sets": {{"nodes": {{"wall": {{"box": {{"min": [0, 0], "max": [0, 1]}}}},
                           "pulled": {{"box": {{"min": [10, 0], "max": [10, 1]}}}}}}}},
      "materials": [{{"type": "LinearElastic", "density": 1, "youngs_modulus": 100,
                     "poisson_ratio": 0}}],
      "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": 0,
                                   "region": {{"box": {{"max": [10, 1]}}}}}}}}],
      "analysis": {{"mpm_scheme": "newmark", "dt": {}, "nsteps": {},
                   "scheme_settings": {{"quasi_static": {}, "displacement_tolerance": 0,
                                       "relative_residual_tolerance": 1e-11}}}}}})",
        end / steps, steps, still));
    Simulation simulation(std::move(model), {.threads = 1});
    simulation.run();
    const HistoryRow row = simulation.history();
    CHECK(row.external > 0);
    return std::abs(row.balance) / row.external;
  };
  // Strains of 1e-5 are all that is not linear.
  for (const int steps : {1, 4}) CHECK(balance(steps, true) < 1e-4);
  for (const int steps : {40, 80}) {
    const double moving = balance(steps, false);
    MESSAGE("moving, " << steps << " steps: " << moving);
    CHECK(moving < 0.006);
  }
}
