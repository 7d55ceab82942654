// What the transfer of velocities takes from a standing wave: a rate, whatever the time step.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/verification/case.h"
#include "tests/within.h"

using namespace lahar;
using namespace lahar::verification;

namespace {

constexpr double c = 10, pressure = 4, length = 1, q = 4 * std::numbers::pi / length;

struct Wave {
  int cells = 16;
  std::string functions = "element", scheme = "usl", transfer = "xpic";
  int order = 1;
  double relaxation_time = 0;  // [s]; 0: none
  double viscosity = 0;        // [m^2/s], beside a filter of higher order
  double length = 0;           // [m] of a viscosity by pressure, in place of that one
  double step = 0.1;           // [h / c]
};

/// Half of the variance of functions around particles, over h^2.
double variance(const Wave& wave) {
  return wave.functions == "quadratic_spline" ? 1.0 / 4 : 3.0 / 16;
}

/// Two waves between the closed ends of a bar, 2 x 2 particles per cell.
Model<2> standing_wave(const Wave& wave) {
  const double h = length / wave.cells;
  const std::string settings = wave.relaxation_time == 0
                                   ? R"("velocity_update": "flip")"
                                   : R"("velocity_update": ")" + wave.transfer +
                                         R"(", "velocity_update_settings": {"order": )" +
                                         std::to_string(wave.order) + R"(, "relaxation_time": )" +
                                         std::to_string(wave.relaxation_time) + "}";
  Model<2> model = model_of_text<2>(R"({
    "mesh": {"structured": {"cell_size": )" +
                                    std::to_string(h) + R"(, "extent": [1, )" +
                                    std::to_string(4 * h) + R"(]},
             "boundary_conditions": {"velocity_constraints": [
               {"nset": "all", "dir": "y", "velocity": 0},
               {"nset": "ends", "dir": "x", "velocity": 0}]}},
    "sets": {"nodes": {
      "all": {"box": {"min": [-1, -1], "max": [2, 2]}},
      "ends": {"union": [{"half_space": {"point": [0, 0], "normal": [1, 0]}},
                         {"half_space": {"point": [1, 0], "normal": [-1, 0]}}]}}},
    "materials": [{"type": "LinearElastic", "density": 1, "youngs_modulus": 100,
                   "poisson_ratio": 0}],
    "particles": [{"generator": {"type": "region", "per_cell": 2, "material": 0,
                                 "region": {"box": {"min": [0, 0], "max": [1, 1]}}}}],
    "analysis": {"mpm_scheme": ")" + wave.scheme +
                                    R"(", "shape_functions": ")" + wave.functions + R"(",
                 "dt": )" + std::to_string(wave.step * h / c) +
                                    R"(, "end_time": 1, )" + settings + "}}");
  for (const Vec<2>& x : model.particles.x)
    model.particles.velocity.push_back(Vec<2>(1e-3 * std::sin(q * x[0]), 0.0));
  model.analysis.transfer.viscous = wave.viscosity / (variance(wave) * h * h);
  model.analysis.transfer.viscosity_length = wave.length;
  model.analysis.transfer.per_viscosity = 1 / (variance(wave) * h * h);
  if (wave.length > 0)
    model.particles.stress.assign(model.particles.x.size(),
                                  Voigt{-pressure, -pressure, -pressure, 0, 0, 0});
  return model;
}

/// Rate at which the transfer lets its energy fall [1/s], over two periods: the scheme alone
/// changes it by a share of the time step.
double decay(Wave wave) {
  const auto rate = [](const Wave& some) {
    Model<2> model = standing_wave(some);
    const double dt = model.analysis.step.dt, until = length / c;
    Simulation simulation(std::move(model));
    const HistoryRow start = simulation.history();
    simulation.advance(static_cast<Index>(std::lround(until / dt)));
    const HistoryRow end = simulation.history();
    return -std::log((end.kinetic + end.internal) / start.kinetic) / end.time;
  };
  const double with = rate(wave);
  wave.relaxation_time = 0;
  return with - rate(wave);
}

/// Nodes and particles keep 1 - q^2 s^2 of a mode exp(i q x) each way; s^2 is half the variance of
/// functions around particles. So much of the mode is lost per relaxation time, to the power of
/// the order. Kinetic energy is half of the energy, and falls twice as fast.
double predicted(const Wave& wave) {
  const double h = length / wave.cells;
  return std::pow(q * q * h * h * variance(wave), wave.order) / wave.relaxation_time;
}

}  // namespace

TEST_CASE("the transfer damps a standing wave at a rate that does not depend on the time step") {
  for (const std::string functions : {"element", "uniform_gimp", "quadratic_spline"})
    for (const int order : {1, 2})
      for (const int cells : {16, 32}) {
        Wave wave{
            .cells = cells, .functions = functions, .order = order, .relaxation_time = 2.5e-3};
        CAPTURE(functions);
        CAPTURE(order);
        CAPTURE(cells);
        wave.scheme = cells == 16 ? "usl" : "musl";
        wave.step = 0.05;
        const double rate = decay(wave);
        // What is left out is of the order q^2 h^2.
        CHECK(rate == test::within(cells == 16 ? 0.2 : 0.08, predicted(wave)));
        for (const double step : {0.1, 0.2}) {
          wave.step = step;
          CHECK(decay(wave) == test::within(0.2 * step, rate));
        }
        wave.scheme = "usf";
        CHECK(decay(wave) == test::within(0.02, rate));
      }
}

TEST_CASE("the filter of FMPM damps a standing wave as that of XPIC does") {
  for (const int order : {1, 2, 3}) {
    Wave wave{.order = order, .relaxation_time = 2.5e-3, .step = 0.025};
    const double rate = decay(wave);
    wave.transfer = "fmpm";
    CAPTURE(order);
    CHECK(decay(wave) == test::within(order == 3 ? 0.1 : 0.02, rate));
  }
}

namespace {

/// What give(wave) adds to the decay that a filter of order 3 makes is that of a viscosity, nu q^2,
/// on any mesh and at any step.
template <class Give>
void check_viscosity(const std::string& transfer, double viscosity, Give give) {
  for (const std::string functions : {"element", "quadratic_spline"})
    for (const int cells : {16, 32}) {
      Wave wave{.cells = cells,
                .functions = functions,
                .transfer = transfer,
                .order = 3,
                .relaxation_time = 5e-3,
                .step = 0.05};
      const double of_filter = decay(wave);
      give(wave);
      CAPTURE(transfer);
      CAPTURE(functions);
      CAPTURE(cells);
      const double rate = decay(wave) - of_filter;
      CHECK(rate == test::within(cells == 16 ? 0.2 : 0.08, viscosity * q * q));
      wave.step = 0.1;
      CHECK(decay(wave) - of_filter == test::within(0.05, rate));
    }
}

}  // namespace

TEST_CASE("beside a filter of higher order, a viscosity damps a wave by nu q^2 on any mesh") {
  for (const std::string transfer : {"xpic", "fmpm"})
    check_viscosity(transfer, 0.02, [](Wave& wave) { wave.viscosity = 0.02; });
}

TEST_CASE("a viscosity by pressure damps a wave by l sqrt(p / rho) q^2 on any mesh") {
  check_viscosity("xpic", 0.01 * std::sqrt(pressure), [](Wave& wave) { wave.length = 0.01; });
}

TEST_CASE("what the transfer takes from a wave is counted as damping") {
  for (const std::string scheme : {"usf", "usl", "musl"})
    for (const int order : {1, 2})
      for (const double step : {0.05, 0.025}) {
        Model<2> model = standing_wave(
            {.scheme = scheme, .order = order, .relaxation_time = 1e-3, .step = step});
        Simulation simulation(std::move(model));
        const double start = simulation.history().kinetic;
        simulation.advance(static_cast<Index>(std::lround(16 / step)));
        const HistoryRow end = simulation.history();
        CAPTURE(scheme);
        CAPTURE(order);
        CHECK(end.damping > (order == 1 ? 0.9 : 0.5) * start);
        CHECK(std::abs(end.balance) < 0.5 * step * start);  // what the schemes make or lose
      }
}

namespace {

/// The largest difference of velocities after 20 steps [m/s], of waves of 1e-3 m/s.
double difference(const Wave& one, const Wave& other, bool is_pic = false) {
  const auto end = [](Model<2> model) {
    Simulation simulation(std::move(model));
    simulation.advance(20);
    return State(simulation.frame());
  };
  Model<2> second = standing_wave(other);
  if (is_pic) second.analysis.transfer = VelocityTransfer(), second.analysis.transfer.flip = 0.0;
  const State a = end(standing_wave(one)), b = end(std::move(second));
  double most = 0;
  for (Index p = 0; p < a.size(); ++p)
    for (int d = 0; d < 2; ++d)
      most = std::max(most, std::abs(a.get("velocity", p, d) - b.get("velocity", p, d)));
  return most;
}

constexpr double never = 1e12, at_once = 1e-6;  // [s]
constexpr double rounding = 1e-16;              // [m/s]

}  // namespace

TEST_CASE("a transfer that takes nothing is FLIP, one of order 1 that takes all at once is PIC") {
  for (const std::string transfer : {"flip", "xpic", "fmpm"})
    for (const std::string functions : {"element", "quadratic_spline"}) {
      CAPTURE(transfer);
      CAPTURE(functions);
      const Wave flip{.functions = functions};
      for (const int order : {1, 2, 3})
        CHECK(difference({.functions = functions,
                          .transfer = transfer,
                          .order = order,
                          .relaxation_time = never},
                         flip) < rounding);
      const Wave pic{.functions = functions, .transfer = transfer, .relaxation_time = at_once};
      CHECK(difference(pic, flip, true) < rounding);
      CHECK(difference(pic, flip) > 1e-5);
    }
}

TEST_CASE("a filter of any order gives particles the velocity that all nodes are held at") {
  for (const std::string transfer : {"xpic", "fmpm"})
    for (const std::string scheme : {"usf", "usl", "musl"})
      for (const int order : {1, 2, 3, 4}) {
        Model<2> model = standing_wave(
            {.scheme = scheme, .transfer = transfer, .order = order, .relaxation_time = at_once});
        entries_of<NodeVelocity>(model).clear();
        for (Index n = 0; n < model.mesh->n_nodes(); ++n)
          for (int d = 0; d < 2; ++d)
            entries_of<NodeVelocity>(model).push_back({n, d, d == 0 ? 0.3 : 0.0});
        model.analysis.remove_leaving_particles = true;
        Simulation simulation(std::move(model));
        simulation.advance(3);
        const State end(simulation.frame());
        CAPTURE(transfer);
        CAPTURE(scheme);
        CAPTURE(order);
        for (Index p = 0; p < end.size(); ++p)
          CHECK(std::abs(end.get("velocity", p, 0) - 0.3) < 1e-14);
      }
}
