// Cook's membrane in explicit steps: with the mean of volumetric strains it does not lock.
#include <doctest/doctest.h>

#include <cmath>

#include "tests/verification/case.h"
#include "tests/verification/cook_membrane.h"
#include "tests/within.h"

using namespace lahar;
using namespace lahar::verification;

namespace {

/// Comes to rest under Cundall's damping, after `swings` times of a shear wave along the membrane
/// and back.
double at_rest(Index n, bool b_bar, double courant, double swings = 12) {
  Model<2> model = cook_membrane(n);
  constexpr double E = 70, nu = 0.499, rho = 1000, length = 48, height = 16;
  const double G = E / (2 * (1 + nu)), c = std::sqrt(2 * G * (1 - nu) / (1 - 2 * nu) / rho);
  model.analysis.scheme = Scheme::musl;
  model.analysis.mean_volume = b_bar;
  model.analysis.damping = 0.3;
  model.analysis.step.dt = courant * height / static_cast<double>(n) / c;
  const double time = swings * 4 * length / std::sqrt(G / rho);
  model.analysis.nsteps = std::llround(time / model.analysis.step.dt);
  Simulation simulation(std::move(model));
  simulation.run();
  const HistoryRow end = simulation.history();
  MESSAGE(n << " cells, b_bar " << b_bar << ", step " << courant << ": " << cook_corner(simulation)
            << ", kinetic over strain energy " << end.kinetic / end.internal);
  CHECK(end.kinetic < 1e-6 * end.internal);
  return cook_corner(simulation);
}

}  // namespace

TEST_CASE("explicit steps: Cook's membrane does not lock with the mean of volumetric strains") {
  const double coarse = at_rest(16, true, 0.4), half_step = at_rest(16, true, 0.2),
               fine = at_rest(32, true, 0.4), locked = at_rest(16, false, 0.4);
  // What quasi-static steps give.
  CHECK(coarse == test::within(0.002, 0.2722));
  CHECK(half_step == test::within(0.001, coarse));
  CHECK(fine == test::within(0.02, cook_limit));
  CHECK(locked < 0.75 * cook_limit);
}
