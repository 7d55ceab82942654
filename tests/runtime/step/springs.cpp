// Bodies on an elastic foundation against the oscillator that they are.
#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

#include "tests/runtime/step/models.h"
#include "tests/within.h"

using namespace lahar;
using namespace lahar::test;

namespace {

constexpr double speed = 0.01, mass = 4000, period = 1.0, dt = 1e-3;  // [m/s], [kg], [s], [s]

/// A stiff block of 2 m x 2 m on springs at its three nodes below, without weight. The springs
/// together give it the period.
Model<2> block(Scheme scheme, double damping) {
  const double omega = 2 * std::numbers::pi / period;
  Model<2> model = model_of_text<2>(R"({
    "mesh": {"structured": {"cell_size": 1, "extent": [4, 4]},
             "boundary_conditions": {"spring_constraints": [
               {"nset": "base", "dir": "y", "stiffness": )" +
                                    std::to_string(mass * omega * omega / 3) + R"(, "damping": )" +
                                    std::to_string(damping / 3) + R"(}]}},
    "sets": {"nodes": {"base": {"box": {"min": [1, 1], "max": [3, 1]}}}},
    "materials": [{"type": "LinearElastic", "density": 1000, "youngs_modulus": 1e8,
                   "poisson_ratio": 0}],
    "particles": [{"generator": {"type": "region", "per_cell": 2, "velocity": [0, -0.01],
                                 "material": 0,
                                 "region": {"box": {"min": [1, 1], "max": [3, 3]}}}}],
    "analysis": {"dt": 1e-3, "nsteps": 2000, "patch_particles": 8}})");
  model.analysis.scheme = scheme;
  return model;
}

double mean_velocity(const Frame& frame) {
  const auto& v = frame.find("velocity")->values;
  double sum = 0;
  for (std::size_t k = 1; k < v.size(); k += 2) sum += v[k];
  return sum / static_cast<double>(v.size() / 2);
}

}  // namespace

TEST_CASE("springs: a body swings with the period 2 pi sqrt(m / k), and the energy closes") {
  for (const Scheme scheme : {Scheme::usf, Scheme::usl, Scheme::musl}) {
    CAPTURE(static_cast<int>(scheme));
    const Model<2> model = block(scheme, 0);
    CHECK(model.analysis.takes_means);
    Simulation simulation(model, flow(2));
    const double start = 0.5 * mass * speed * speed;
    simulation.advance(250);
    CHECK(std::abs(mean_velocity(simulation.frame())) < 0.02 * speed);
    CHECK(simulation.history().external == within(0.01, -start));
    simulation.advance(250);
    CHECK(mean_velocity(simulation.frame()) == within(0.01, speed));
    simulation.advance(500);
    CHECK(mean_velocity(simulation.frame()) == within(0.01, -speed));
    const HistoryRow row = simulation.history();
    CHECK(std::abs(row.balance) < 0.01 * start);
  }
}

TEST_CASE("springs: dashpots take what the oscillator's decay says") {
  const double decay = 0.5;  // [1/s]
  const double omega = 2 * std::numbers::pi / period;
  const double damped = 2 * std::numbers::pi / std::sqrt(omega * omega - decay * decay);
  Simulation simulation(block(Scheme::usl, 2 * decay * mass), flow(2));
  simulation.advance(static_cast<Index>(std::lround(damped / dt)));
  const double kept = std::exp(-decay * damped), start = 0.5 * mass * speed * speed;
  CHECK(mean_velocity(simulation.frame()) == within(0.01, -kept * speed));
  const HistoryRow row = simulation.history();
  CHECK(row.damping == within(0.02, (1 - kept * kept) * start));
  CHECK(std::abs(row.balance) < 0.01 * start);
}
