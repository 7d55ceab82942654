// Front of a collapsing column of water against the experiment of Martin and Moyce (1952), Phil.
// Trans. R. Soc. A 244, 312-324: square column of base a, front Z = z / a at T = t sqrt(2 g / a).
#include <doctest/doctest.h>

#include <cmath>
#include <utility>
#include <vector>

#include "tests/verification/case.h"

using namespace lahar;
using namespace lahar::verification;

namespace {

/// Front against time, dimensionless.
struct Front {
  std::vector<double> T, Z;
  /// Z at time T, or T at front Z: linear between the points of an ascending table.
  static double at(const std::vector<double>& x, const std::vector<double>& y, double value) {
    std::size_t i = 1;
    while (i + 1 < x.size() && x[i] < value) ++i;
    return y[i - 1] + (value - x[i - 1]) / (x[i] - x[i - 1]) * (y[i] - y[i - 1]);
  }
};

Front dam_break() {
  // Column 2.25 in wide and twice as high (Martin and Moyce's n^2 = 2), 20 x 40 cells of 3 x 3.
  constexpr double a = 0.05716, g = 9.81;
  ScenarioOptions options;
  options.overrides = {
      "mesh.structured.cell_size=[0.002858,0.002858]", "mesh.structured.counts=[240,60]",
      "particles.0.generator.region.box.max=[0.05716,0.11432]",
      "sets.nodes.walls.union.1.half_space.point=[0.68592,0]", "analysis.end_time=0.21"};
  Scenario scenario = read_scenario(LAHAR_SOURCE_DIR "/examples/dam-break.json", options);
  Simulation<2> simulation(std::get<Model<2>>(std::move(scenario.model)));
  Front front;
  while (!simulation.finished()) {
    simulation.advance(20);
    const State state(simulation.frame());
    double x = 0;
    for (Index p = 0; p < state.size(); ++p) x = std::max(x, state.x(p, 0));
    front.T.push_back(state.time() * std::sqrt(2 * g / a));
    front.Z.push_back(x / a);
  }
  return front;
}

}  // namespace

TEST_CASE("the front of a dam break runs as fast as Martin and Moyce saw, and some time ahead") {
  // Their two columns, a = 1.125 and 2.25 in.
  const std::vector<std::vector<std::pair<double, double>>> experiments{
      {{0.849, 1.245},
       {1.212, 1.443},
       {1.602, 1.884},
       {2.283, 2.689},
       {2.950, 3.728},
       {3.598, 4.528}},
      {{0.832, 1.217}, {1.219, 1.474}, {1.997, 2.292}, {2.547, 2.995}, {3.345, 4.134}}};
  const Front front = dam_break();
  for (const auto& experiment : experiments) {
    for (const auto& [T, Z] : experiment) {
      const double ahead = Front::at(front.T, front.Z, T) / Z - 1;
      const double earlier = T - Front::at(front.Z, front.T, Z);
      MESSAGE("T " << T << ": Z " << Z << ", " << 100 * ahead << " % ahead, " << earlier
                   << " earlier");
      // Ahead, as other codes are (usually by 5 to 10 %): in the experiment the gate takes time to
      // open and water sticks to the floor; here all of the water is free at once and the floor is
      // smooth. Measured 7 to 21 %, the most of it early; the foremost particle counts as the
      // front.
      CHECK(ahead > 0);
      CHECK(ahead < 0.22);
      // The lead is one of time, from the start, and does not grow: 0.16 to 0.32.
      CHECK(earlier > 0.1);
      CHECK(earlier < 0.45);
    }
    // So the speed of the front is that of the experiment, to 10 %, from Z = 1.5 to the end
    // (measured 1 %).
    const auto &first = experiment[1], &last = experiment.back();
    const double measured = (last.second - first.second) / (last.first - first.first);
    const double ours = (last.second - first.second) / (Front::at(front.Z, front.T, last.second) -
                                                        Front::at(front.Z, front.T, first.second));
    MESSAGE("speed dZ/dT " << ours << ", experiment " << measured);
    CHECK(ours == doctest::Approx(measured).epsilon(0.1));
  }
  // Never faster than on a dry bed without friction (Ritter 1892), 2 sqrt(g h0): dZ/dT = 2.
  for (std::size_t i = 1; i < front.T.size(); ++i)
    CHECK((front.Z[i] - front.Z[i - 1]) / (front.T[i] - front.T[i - 1]) < 2);
}
