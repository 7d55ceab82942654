// Motions of a body as a whole, which MPM must reproduce to rounding: nothing deforms.
#include <doctest/doctest.h>

#include "tests/verification/case.h"

using namespace lahar;
using namespace lahar::verification;

namespace {

/// A block of 2 x 3 cells in a mesh in which it has room to move.
Model<2> block() {
  return model_of_text<2>(R"({
    "mesh": {"structured": {"cell_size": 0.25, "extent": [4, 4]}},
    "materials": [{"type": "LinearElastic", "density": 1500, "youngs_modulus": 1e5,
                   "poisson_ratio": 0.3}],
    "particles": [{"generator": {"type": "region", "per_cell": 3,
                                 "region": {"box": {"min": [1.5, 2.5], "max": [2, 3.25]}},
                                 "material": 0}}],
    "analysis": {"dt": 1e-3, "nsteps": 500}})");
}

constexpr Scheme schemes[] = {Scheme::usf, Scheme::usl, Scheme::musl};

}  // namespace

TEST_CASE("a body falls freely: v = g t, and positions follow the sum of the steps") {
  for (const Scheme scheme : schemes)
    for (const double flip : {1.0, 0.0, 0.9}) {
      Model<2> model = block();
      model.analysis.scheme = scheme;
      model.analysis.transfer.flip = flip;
      model.gravity = {0.5, -9.81};
      const Index n = model.analysis.nsteps;
      const double dt = model.analysis.step.dt;
      Simulation simulation(std::move(model));
      const State start(simulation.frame());
      simulation.run();
      const State end(simulation.frame());
      REQUIRE(end.size() == start.size());
      CAPTURE(static_cast<int>(scheme));
      CAPTURE(flip);
      // Symplectic Euler: x_n = x_0 + g dt^2 n (n + 1) / 2. Rounding: 1e-11 over 500 steps.
      const double fall = dt * dt * static_cast<double>(n * (n + 1)) / 2;
      double error_v = 0, error_x = 0, stress = 0;
      for (Index p = 0; p < end.size(); ++p)
        for (int d = 0; d < 2; ++d) {
          const double g = d == 0 ? 0.5 : -9.81;
          error_v = std::max(error_v, std::abs(end.get("velocity", p, d) - g * dt * n));
          error_x = std::max(error_x, std::abs(end.x(p, d) - start.x(p, d) - g * fall));
          stress = std::max(stress, std::abs(end.get("stress", p, d)));
        }
      CHECK(error_v < 1e-11);
      CHECK(error_x < 1e-11);
      CHECK(stress < 1e-5);  // of E = 1e5: strains to 1e-10
    }
}

TEST_CASE("a body in uniform motion crosses cells and patches without stress") {
  for (const Scheme scheme : schemes) {
    Model<2> model = block();
    model.analysis.scheme = scheme;
    model.analysis.patch_particles = 16;
    for (auto& v : model.particles.velocity = std::vector<Vec<2>>(
                       static_cast<std::size_t>(model.particles.size()), Vec<2>(2, -3)))
      v = {2, -3};
    Simulation simulation(std::move(model));
    const HistoryRow before = simulation.history();
    const State start(simulation.frame());
    simulation.run();
    const HistoryRow after = simulation.history();
    const State end(simulation.frame());
    double error = 0, stress = 0;
    for (Index p = 0; p < end.size(); ++p) {
      error = std::max({error, std::abs(end.x(p, 0) - start.x(p, 0) - 2 * end.time()),
                        std::abs(end.x(p, 1) - start.x(p, 1) + 3 * end.time())});
      for (int k = 0; k < 4; ++k) stress = std::max(stress, std::abs(end.get("stress", p, k)));
    }
    CAPTURE(static_cast<int>(scheme));
    CHECK(error < 1e-11);
    CHECK(stress < 1e-5);
    CHECK(after.mass == doctest::Approx(before.mass).epsilon(1e-14));
    CHECK(after.momentum[0] == doctest::Approx(before.momentum[0]).epsilon(1e-12));
    CHECK(after.momentum[1] == doctest::Approx(before.momentum[1]).epsilon(1e-12));
    CHECK(after.kinetic == doctest::Approx(before.kinetic).epsilon(1e-12));
  }
}

// With strains of velocities of light nodes, such as the block leaves behind, it burst. With v* of
// these nodes that lack the weight of the block, pressures of some kPa came and went.
TEST_CASE("saturated soil moves and falls freely across cells without stress in projections") {
  for (const double g : {0.0, 9.81}) {
    Model<2> model = model_of_text<2>(R"({
      "mesh": {"structured": {"cell_size": 0.05, "extent": [3, 3]}},
      "materials": [
        {"name": "soil", "type": "LinearElastic", "density": 2650, "youngs_modulus": 2e6,
         "poisson_ratio": 0.25, "porosity": 0.4, "k_x": 1e-3},
        {"name": "water", "type": "Newtonian", "density": 1000, "bulk_modulus": 4e6,
         "dynamic_viscosity": 1e-3}],
      "particles": [{"generator": {"type": "region", "per_cell": 2, "velocity": [1, -0.7],
                                   "region": {"box": {"min": [0.5, 2], "max": [0.7, 2.2]}},
                                   "material": ["soil", "water"]}}],
      "analysis": {"preset": "lahar", "mpm_scheme": "projection", "dt": 2e-4, "nsteps": 2000}})");
    model.gravity = {0.1 * g, -g};
    Simulation simulation(std::move(model));
    const State start(simulation.frame());
    simulation.run();
    const State end(simulation.frame());
    REQUIRE(end.size() == start.size());
    CAPTURE(g);
    const double t = 0.4, fall = g * t * (t + 2e-4) / 2;
    double error = 0, pressure = 0, stress = 0;
    for (Index p = 0; p < end.size(); ++p) {
      error = std::max({error, std::abs(end.x(p, 0) - start.x(p, 0) - t - 0.1 * fall),
                        std::abs(end.x(p, 1) - start.x(p, 1) + 0.7 * t + fall)});
      pressure = std::max(pressure, std::abs(end.get("pore_pressure", p)));
      for (int k = 0; k < 4; ++k) stress = std::max(stress, std::abs(end.get("stress", p, k)));
    }
    CHECK(error < 1e-9);
    CHECK(pressure < 1e-4);  // of moduli of 2e6 Pa
    CHECK(stress < 1e-4);
  }
}
