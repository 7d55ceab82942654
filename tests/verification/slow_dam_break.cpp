// Front of a collapsing column of water against the experiment of Martin and Moyce (1952), Phil.
// Trans. R. Soc. A 244, 312-324: square column of base a, front Z = z / a at T = t sqrt(2 g / a).
#include <doctest/doctest.h>

#include <algorithm>
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

// What the front does not depend on, at any of the points below by more than 3 % of Z: cells of
// half the size, water five times stiffer, a start with hydrostatic stress, quadratic B-splines
// with APIC; and where the floor holds the water it is faster still. It is 7 to 21 % ahead in
// place.
TEST_CASE("the front of a dam break runs as Martin and Moyce saw, but for the time of the gate") {
  using Points = std::vector<std::pair<double, double>>;
  // Martin and Moyce's two columns, a = 1.125 and 2.25 in.
  const std::vector<Points> experiments{
      {{0.849, 1.245},
       {1.212, 1.443},
       {1.602, 1.884},
       {2.283, 2.689},
       {2.950, 3.728},
       {3.598, 4.528}},
      {{0.832, 1.217}, {1.219, 1.474}, {1.997, 2.292}, {2.547, 2.995}, {3.345, 4.134}}};
  // Koshizuka and Oka (1996), Nucl. Sci. Eng. 123, 421-434, slower than these.
  const Points slower{{0.381, 1.111}, {0.769, 1.252}, {1.153, 1.505}, {1.537, 1.892},
                      {1.935, 2.241}, {2.323, 2.615}, {2.719, 3.003}, {3.096, 3.624}};
  const Front front = dam_break();
  const auto largest_error = [&](const Points& points, double late) {
    double largest = 0;
    for (const auto& [T, Z] : points)
      largest = std::max(largest, std::abs(Front::at(front.T, front.Z, T - late) / Z - 1));
    return largest;
  };
  // Here all of the water is free at once. In the experiments the gate takes time, which delays all
  // of the motion by the same: one number for both columns, 14 ms of the larger one.
  constexpr double late = 0.255;
  for (const Points& points : experiments) {
    const double error = largest_error(points, late);
    MESSAGE("largest error " << 100 * error << " %, " << 100 * largest_error(points, 0)
                             << " % without the delay");
    CHECK(error < 0.05);  // measured 3.9 and 2.1 %
    CHECK(largest_error(points, 0) < 0.22);
    // Without it the front is ahead everywhere, and the speed is that of the experiment, from Z
    // = 1.5 to the end (measured 0.8 and 0.1 %).
    for (const auto& [T, Z] : points) CHECK(Front::at(front.T, front.Z, T) > Z);
    const auto &first = points[1], &last = points.back();
    const double measured = (last.second - first.second) / (last.first - first.first);
    const double ours = (last.second - first.second) / (Front::at(front.Z, front.T, last.second) -
                                                        Front::at(front.Z, front.T, first.second));
    MESSAGE("speed dZ/dT " << ours << ", experiment " << measured);
    CHECK(ours == doctest::Approx(measured).epsilon(0.05));
  }
  MESSAGE("Koshizuka and Oka: largest error " << 100 * largest_error(slower, late) << " %");
  CHECK(largest_error(slower, late) < 0.12);
  // Never faster than on a dry bed without friction (Ritter 1892), 2 sqrt(g h0): dZ/dT = 2.
  for (std::size_t i = 1; i < front.T.size(); ++i)
    CHECK((front.Z[i] - front.Z[i - 1]) / (front.T[i] - front.T[i - 1]) < 2);
}
