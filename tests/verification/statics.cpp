// Bodies that come to rest under gravity, with damping.
#include <doctest/doctest.h>

#include "tests/verification/case.h"

using namespace lahar;
using namespace lahar::verification;

TEST_CASE("a fluid at rest carries the weight above: sigma = -rho g depth") {
  Model<2> model = model_of_file<2>("examples/hydrostatic-column.json");
  Simulation<2> simulation(std::move(model));
  simulation.run();
  const State state(simulation.frame());
  // Linear elements with a constant gradient per cell carry the stress of the cell's centre, so means
  // over a row of cells are compared there; 0.5 % of the largest pressure, 1766 Pa, mostly because
  // the column is compressed by 0.1 %.
  const double g = 9.81, rho = 1800, h = 0.1, dx = 0.01;
  for (int row = 0; row < 9; ++row) {
    const double y = (row + 0.5) * dx;
    auto in_row = [&](Index p) { return std::abs(state.x(p, 1) - y) < dx / 2; };
    const double exact = -rho * g * (h - y);
    for (int k = 0; k < 3; ++k) {
      CAPTURE(row);
      CAPTURE(k);
      const double value = mean(state, in_row, [&](Index p) { return state.get("stress", p, k); });
      CHECK(std::abs(value - exact) < 0.005 * rho * g * h);
    }
  }
}

TEST_CASE("a confined elastic column: vertical stress by weight, horizontal by K0 = nu / (1 - nu)") {
  Model<2> model = model_of_file<2>("examples/hydrostatic-column.json");
  const double nu = 0.3;
  model.materials[0].law = LinearElastic{1e6, nu};
  Simulation<2> simulation(std::move(model));
  simulation.run();
  const State state(simulation.frame());
  const double g = 9.81, rho = 1800, h = 0.1, dx = 0.01;
  for (int row = 0; row < 9; ++row) {
    const double y = (row + 0.5) * dx;
    auto in_row = [&](Index p) { return std::abs(state.x(p, 1) - y) < dx / 2; };
    auto stress = [&](int k) {
      return mean(state, in_row, [&](Index p) { return state.get("stress", p, k); });
    };
    CAPTURE(row);
    CHECK(std::abs(stress(1) + rho * g * (h - y)) < 0.005 * rho * g * h);
    CHECK(std::abs(stress(0) - nu / (1 - nu) * stress(1)) < 1e-3 * rho * g * h);
    CHECK(std::abs(stress(2) - nu / (1 - nu) * stress(1)) < 1e-3 * rho * g * h);
    CHECK(std::abs(stress(3)) < 1e-3 * rho * g * h);
  }
}

TEST_CASE("a hanging bar stretches by rho g L^2 / (2 E)") {
  Model<3> model = model_of_file<3>("examples/hanging-bar.json");
  Simulation<3> simulation(std::move(model));
  const State start(simulation.frame());
  simulation.run();
  const State end(simulation.frame());
  const double rho_g = 9810, length = 1, E = 2e6, dx = 0.05;
  double tip = 0;
  for (Index p = 0; p < end.size(); ++p)
    if (start.x(p, 2) < dx / 2) tip = end.x(p, 2) - start.x(p, 2);
  // The tip's particle is dx/4 above the end; the material stretches, so 2 %.
  const double z = dx / 4;
  CHECK(tip == doctest::Approx(-rho_g * (length * length - z * z) / (2 * E)).epsilon(0.02));
  for (int row = 1; row < 20; ++row) {
    auto in_row = [&](Index p) { return std::abs(start.x(p, 2) - (row + 0.5) * dx) < dx / 2; };
    const double value =
        mean(end, in_row, [&](Index p) { return end.get("stress", p, 2); });
    CAPTURE(row);
    CHECK(std::abs(value - rho_g * (row + 0.5) * dx) < 0.01 * rho_g * length);
  }
}
