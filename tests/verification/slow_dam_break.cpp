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

/// Share of the water that is ahead of the place `Front::bulk`. It is a matter of taste: with half of
/// it the place is up to 10.9 % ahead.
constexpr double toe = 0.01;

/// Front against time, dimensionless.
struct Front {
  std::vector<double> T, Z;  ///< Z of the foremost particle
  std::vector<double> bulk;  ///< place that the foremost 1 % of the water have passed
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
    std::vector<double> Z;
    for (Index p = 0; p < state.size(); ++p) Z.push_back(state.x(p, 0) / a);
    std::sort(Z.begin(), Z.end());
    front.T.push_back(state.time() * std::sqrt(2 * g / a));
    front.Z.push_back(Z.back());
    front.bulk.push_back(Z[static_cast<std::size_t>((1 - toe) * static_cast<double>(Z.size()))]);
  }
  return front;
}

}  // namespace

// The computed motion is that of water which is free at once, on a floor without friction. What the
// front does not depend on, at any of the points below by more than 3 % of Z: cells of half the
// size, water five times stiffer, a start with hydrostatic stress, quadratic B-splines with APIC, a
// floor that holds the water (up to 5 % faster then: particles roll over those that are held), and
// whether it is the foremost particle or where half a cell of depth ends (1 %).
//
// When the water of the experiments was free is not observed. At T = 0.84 their front is at Z
// = 1.22 and 1.25 and the computed one at 1.40; from Z = 1.5 on both are as fast. Others who
// compare with them shift time as well (by 0.175 in the dam break of Lethe's examples, whose water
// is more viscous). Here the clock starts where the experiment first saw the front: nothing is
// fitted.
TEST_CASE("the front of a dam break is where Martin and Moyce saw it, within 10 %") {
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
  // Koshizuka and Oka (1996), Nucl. Sci. Eng. 123, 421-434: Z = 3 is reached 7 % later than by
  // Martin and Moyce.
  const Points slower{{0.381, 1.111}, {0.769, 1.252}, {1.153, 1.505}, {1.537, 1.892},
                      {1.935, 2.241}, {2.323, 2.615}, {2.719, 3.003}, {3.096, 3.624}};
  const Front front = dam_break();
  const auto largest_error = [&](const Points& points, const std::vector<double>& Z, double late) {
    double largest = 0;
    for (const auto& [T, seen] : points)
      largest = std::max(largest, std::abs(Front::at(front.T, Z, T - late) / seen - 1));
    return largest;
  };
  for (const Points& points : experiments) {
    const auto &first = points[0], &second = points[1], &last = points.back();
    const double late = first.first - Front::at(front.Z, front.T, first.second);
    const double error = largest_error(points, front.Z, late);
    const double from_start = largest_error(points, front.Z, 0);
    const double bulk = largest_error(points, front.bulk, 0);
    MESSAGE("largest error " << 100 * error << " % from where the front is first seen (T " << late
                             << " later), " << 100 * from_start
                             << " % from the start, of all but the toe " << 100 * bulk << " %");
    CHECK(error < 0.1);  // measured 7.6 and 4.4 %
    // From the start, what is not the thin toe is as near (4.9 and 5.7 %): a sheet about a
    // tenth of a deep, in which water has surface tension and a boundary layer. The toe is ahead.
    CHECK(bulk < 0.1);
    CHECK(from_start < 0.22);
    for (const auto& [T, Z] : points) CHECK(Front::at(front.T, front.Z, T) > Z);
    // The speed is that of the experiment, from Z = 1.5 to the end (measured 0.8 and 0.1 %).
    const double measured = (last.second - second.second) / (last.first - second.first);
    const double ours =
        (last.second - second.second) /
        (Front::at(front.Z, front.T, last.second) - Front::at(front.Z, front.T, second.second));
    MESSAGE("speed dZ/dT " << ours << ", experiment " << measured);
    CHECK(ours == doctest::Approx(measured).epsilon(0.05));
  }
  MESSAGE("Koshizuka and Oka: largest error " << 100 * largest_error(slower, front.Z, 0) << " %, "
                                              << 100 * largest_error(slower, front.bulk, 0)
                                              << " % of all but the toe");
  CHECK(largest_error(slower, front.bulk, 0) < 0.15);
  // Never faster than on a dry bed without friction (Ritter 1892), 2 sqrt(g h0): dZ/dT = 2.
  for (std::size_t i = 1; i < front.T.size(); ++i)
    CHECK((front.Z[i] - front.Z[i - 1]) / (front.T[i] - front.T[i - 1]) < 2);
}
