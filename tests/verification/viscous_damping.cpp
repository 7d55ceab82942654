// Mass-proportional damping of rate a: what moves freely slows down as exp(-a t), and an oscillator
// of the circular frequency w without it as
//   v = v_0 exp(-a t / 2) (cos(w_d t) - a / (2 w_d) sin(w_d t)),   w_d^2 = w^2 - a^2 / 4.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "tests/verification/case.h"

using namespace lahar;
using namespace lahar::verification;

namespace {

constexpr double rate = 0.2;  // [1/s]

/// A bar of 25 x 1 m along which waves have 10 m/s.
Model<2> damped_bar(const std::string& scheme, const std::string& functions, bool held, double dt) {
  const std::string hold = R"({"nset": "end", "dir": "x", "velocity": 0}, )";
  return model_of_text<2>(fmt::format(
      R"({{
    "mesh": {{"structured": {{"cell_size": 1, "extent": [27, 1]}},
             "boundary_conditions": {{"velocity_constraints": [{}
               {{"nset": "all", "dir": "y", "velocity": 0}}]}}}},
    "sets": {{"nodes": {{"end": {{"half_space": {{"point": [0, 0], "normal": [1, 0]}}}},
                       "all": {{"box": {{"min": [0, 0]}}}}}}}},
    "materials": [{{"type": "LinearElastic", "density": 1, "youngs_modulus": 100,
                   "poisson_ratio": 0}}],
    "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": 0,
                   "velocity": [0.1, 0], "region": {{"box": {{"min": [0, 0], "max": [25, 1]}}}}}}}}],
    "analysis": {{"mpm_scheme": "{}", "shape_functions": "{}", "dt": {},
                 "damping": {{"type": "Viscous", "damping_factor": {}}}, "end_time": 20}},
    "post_processing": {{"history_steps": 10}}}})",
      held ? hold : "", scheme, functions, dt, rate));
}

}  // namespace

TEST_CASE("viscous damping stops free motion as exp(-rate t), whatever the step") {
  for (const std::string scheme : {"usf", "musl"})
    for (const double dt : {0.05, 0.01}) {
      Model<2> model = damped_bar(scheme, "element", false, dt);
      model.analysis.end_time = 4;
      Simulation simulation(std::move(model));
      simulation.run();
      const HistoryRow end = simulation.history();
      CHECK(end.momentum[0] / end.mass ==
            doctest::Approx(0.1 * std::exp(-rate * end.time)).epsilon(1e-9));
      CHECK(std::abs(end.balance) < 1e-9 * end.damping);
    }
}

TEST_CASE("a bar in its first mode decays as an oscillator with viscous damping") {
  const double w = std::numbers::pi * 10 / (2 * 25), w_d = std::sqrt(w * w - rate * rate / 4);
  const auto worst = [&](const std::string& scheme, const std::string& functions, double dt) {
    Model<2> model = damped_bar(scheme, functions, true, dt);
    for (std::size_t p = 0; p < model.particles.x.size(); ++p)
      model.particles.velocity[p][0] *= std::sin(std::numbers::pi * model.particles.x[p][0] / 50);
    const double start = 0.1 * 2 / std::numbers::pi;  // mean velocity
    double most = 0, imbalance = 0, energy = 0;
    Observer observer;
    observer.history = [&](const HistoryRow& row) {
      const double t = row.time;
      const double exact =
          std::exp(-rate * t / 2) * (std::cos(w_d * t) - rate / (2 * w_d) * std::sin(w_d * t));
      most = std::max(most, std::abs(row.momentum[0] / row.mass / start - exact));
      energy = std::max(energy, row.kinetic);
      imbalance = std::max(imbalance, std::abs(row.balance));
    };
    Simulation simulation(std::move(model), {}, observer);
    simulation.run();
    CHECK(simulation.history().damping > 0.95 * energy);
    CHECK(imbalance < 0.01 * energy);
    MESSAGE(scheme << ", " << functions << ", dt " << dt << ": error " << most << ", imbalance "
                   << imbalance / energy);
    return most;
  };
  for (const std::string functions : {"element", "gimp", "quadratic_spline"})
    for (const std::string scheme : {"usf", "musl"}) {
      const double coarse = worst(scheme, functions, 0.02), half = worst(scheme, functions, 0.01);
      CHECK(coarse < 0.01);
      CHECK(half < 0.8 * coarse);
    }
}
