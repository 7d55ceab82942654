// The published consolidation inputs of two phases, as they are but for columns one cell wide,
// drain as Terzaghi says, in 2D and in 3D. So does the 2D one by projections.
#include "tests/published_consolidation.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "tests/terzaghi.h"
#include "tests/verification/case.h"
#include "tests/within.h"

using namespace lahar;
using namespace lahar::verification;

namespace {

constexpr int cells = 50;
constexpr double dt = 1e-5, end = 0.02, consolidation = 12.94;  // [s], [s], [m^2/s]

template <int Dim>
void check_base(bool as_cbgeo) {
  CAPTURE(as_cbgeo);
  const test::PublishedConsolidation files(Dim, cells, dt, static_cast<int>(std::lround(end / dt)));
  ScenarioOptions options;
  options.as_cbgeo = as_cbgeo;
  Simulation simulation(std::get<Model<Dim>>(read_scenario(files.file(), options).model));
  simulation.run();
  const State state(simulation.frame());
  const double base = mean(
      state, [&](Index p) { return state.x(p, 1) < 0.5 / cells; },
      [&](Index p) { return state.get("pore_pressure", p) / 1e4; });
  MESSAGE(Dim << "D, as CB-Geo " << as_cbgeo << ": " << base << ", Terzaghi "
              << test::terzaghi(consolidation * end));
  // Smoothing, which these inputs ask for, drains a little in each step.
  CHECK(base == test::within(0.03, test::terzaghi(consolidation * end)));
}

}  // namespace

TEST_CASE("the published consolidation inputs drain as Terzaghi says") {
  for (const bool as_cbgeo : {false, true}) {
    check_base<2>(as_cbgeo);
    check_base<3>(as_cbgeo);
  }
}

TEST_CASE("the published consolidation input drains by projections at five times the step") {
  constexpr int longer = 5;
  const test::PublishedConsolidation files(2, cells, longer * dt,
                                           static_cast<int>(std::lround(end / dt)) / longer);
  ScenarioOptions options;
  options.overrides = {"analysis.type=MPMSemiImplicitTwoPhase2D",
                       "analysis.pore_pressure_smoothing=false"};
  for (const bool as_cbgeo : {false, true}) {
    CAPTURE(as_cbgeo);
    options.as_cbgeo = as_cbgeo;
    Simulation simulation(std::get<Model<2>>(read_scenario(files.file(), options).model));
    simulation.run();
    const State state(simulation.frame());
    double worst = 0;
    for (Index p = 0; p < state.size(); ++p) {
      const double z = state.x(p, 1) - state.get("displacement", p, 1);
      const double exact = test::terzaghi(consolidation * end, 1 - z);
      worst = std::max(worst, std::abs(state.get("pore_pressure", p) / 1e4 - exact));
    }
    MESSAGE("as CB-Geo " << as_cbgeo << ": " << worst);
    CHECK(worst < 0.005);
  }
}
