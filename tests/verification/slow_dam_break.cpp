// Front of a collapsing column of water against the experiments of Martin and Moyce (1952), Phil.
// Trans. R. Soc. A 244, 312-324, and Koshizuka and Oka (1996), Nucl. Sci. Eng. 123, 421-434: a
// column of base a, twice as high, front Z = z / a at T = t sqrt(2 g / a).
//
// The computed motion is that of water which is free at once, on a floor without friction. When the
// water of the experiments was free is not observed. At T = 0.84 their front is at Z = 1.22 and
// 1.25 and the computed one at 1.40; from Z = 1.5 on both are as fast. Others who compare with them
// shift time as well (by 0.175 in the dam break of Lethe's examples, whose water is more viscous).
// Here the clock starts where the experiment first saw the front: nothing is fitted.
//
// Two readings of Koshizuka and Oka's figure differ by up to 10 % of Z: the first has Z = 3 7 %
// later than Martin and Moyce, the second follows them.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "tests/verification/world.h"

using namespace lahar;
using namespace lahar::verification;

namespace {

constexpr double a = 0.05716, g = 9.81, density = 1000;
/// The water's edge: columns as wide as the larger cell, as deep as half of it. What is ahead are
/// drops, which experiments do not call the front.
constexpr double width = a / 20, layer = width / 2;
/// Share of the water that is ahead of the place `bulk`. It is a matter of taste: with half of it
/// the place is up to 10.9 % ahead.
constexpr double toe = 0.01;
/// A row of the front every so much of T.
constexpr double interval = 0.02;

/// Z of the front, and of the place that the foremost 1 % of the water have passed, over T.
struct Front {
  Curve edge, bulk;
};

using Changes = std::vector<std::string>;

Front dam_break(const Resolution& at, const Changes& changes, double* dt) {
  Simulation simulation(world_case<2>("water-column.json", at, changes));
  Front front;
  const double unit = std::sqrt(a / (2 * g));
  const StepGuard guard(simulation);
  while (!simulation.finished()) {
    guard.check(simulation);
    simulation.advance(
        std::max<Index>(1, static_cast<Index>(interval * unit / simulation.info().dt)));
    const State state(simulation.frame());
    std::vector<double> x;
    for (Index p = 0; p < state.size(); ++p) x.push_back(state.x(p, 0) / a);
    std::sort(x.begin(), x.end());
    const double T = state.time() / unit;
    front.edge.add(T, depths_along_x(state, density, 0, width).front(layer) / a);
    front.bulk.add(T, x[static_cast<std::size_t>((1 - toe) * static_cast<double>(x.size()))]);
  }
  keep_curve("front", at, front.edge);
  keep_curve("front-bulk", at, front.bulk);
  *dt = mean_step(simulation);
  return front;
}

/// Largest share of Z by which the front is away from published points that the run reaches, with
/// its clock started `late`.
double largest_error(const Curve& points, const Curve& front, double late) {
  double largest = 0;
  for (std::size_t i = 0; i < points.x.size(); ++i)
    if (points.x[i] - late <= front.x.back())
      largest = std::max(largest, std::abs(front.at(points.x[i] - late) / points.y[i] - 1));
  return largest;
}

/// Mean dZ/dT between the second published point and the last one that the run reaches.
double speed(const Curve& points, const Curve& front, bool published) {
  std::size_t last = points.y.size() - 1;
  while (points.y[last] > front.y.back() || points.x[last] > front.x.back()) --last;
  const double dZ = points.y[last] - points.y[1];
  if (published) return dZ / (points.x[last] - points.x[1]);
  return dZ / (front.first_reach(points.y[last]) - front.first_reach(points.y[1]));
}

const std::vector<std::string> experiments{"martin-moyce-1", "martin-moyce-2", "koshizuka-oka",
                                           "koshizuka-oka-2"};
Curve points_of(const std::string& experiment) {
  return read_curve(world_file("front-" + experiment + ".csv"), 0, 1);
}

Numbers fronts(const Resolution& at, const Changes& changes = {}) {
  Numbers n;
  const Front front = dam_break(at, changes, &n["dt"]);
  for (const std::string& name : experiments) {
    const Curve points = points_of(name);
    const double late = points.x[0] - front.edge.first_reach(points.y[0]);
    n[name + ": largest error"] = largest_error(points, front.edge, late);
    n[name + ": from the start"] = largest_error(points, front.edge, 0);
    n[name + ": all but the toe"] = largest_error(points, front.bulk, 0);
    n[name + ": dZ/dT"] = speed(points, front.edge, false);
    n[name + ": dZ/dT measured"] = speed(points, front.edge, true);
  }
  n["Z at T = 2"] = front.edge.at(2);
  n["Z at T = 3"] = front.edge.at(3);
  n["largest dZ/dT"] = 0;
  // Over a tenth of T: single columns of depth come and go.
  for (double T = 0.5; T + 0.1 < front.edge.x.back(); T += 0.1)
    n["largest dZ/dT"] =
        std::max(n["largest dZ/dT"], (front.edge.at(T + 0.1) - front.edge.at(T)) / 0.1);
  return n;
}

}  // namespace

TEST_CASE("the front of a dam break is where Martin and Moyce, and Koshizuka and Oka, saw it") {
  const Study study("dam break", {"0.002858", 0.5}, "0.001429",
                    [](const Resolution& at) { return fronts(at); });
  for (const std::string& name : {experiments[0], experiments[1]}) {
    study.stays_below(name + ": largest error", 0.1);
    // From the start, what is not the thin toe is as near: a sheet about a tenth of a deep, in
    // which water has surface tension and a boundary layer. The toe is ahead.
    study.stays_below(name + ": all but the toe", 0.1);
    study.stays_below(name + ": from the start", 0.22);
    study.agrees(name + ": dZ/dT", study.value(name + ": dZ/dT measured"), 0.05);
  }
  // Within what the two readings leave open, and 5 %.
  study.stays_below("koshizuka-oka: all but the toe", 0.15);
  study.stays_below("koshizuka-oka-2: all but the toe", 0.15);
  study.converges("Z at T = 2");
  study.converges("Z at T = 3");
  // Never faster than on a dry bed without friction (Ritter 1892), 2 sqrt(g h0): dZ/dT = 2.
  study.stays_below("largest dZ/dT", 2);
}

/// Water that keeps its volume, at ten times the largest step that its sound at 20 m/s allows.
Numbers projected_fronts(const Resolution& at) {
  const double step = 10 * at.safety * std::stod(at.cell) / 20;
  return fronts(at, {"analysis.mpm_scheme=projection", fmt::format("analysis.dt={}", step)});
}

TEST_CASE("projection: the front of a dam break, at ten times the step of explicit runs") {
  const Study study("projected dam break", {"0.002858", 0.5}, "0.001429", projected_fronts);
  for (const std::string& name : {experiments[0], experiments[1]}) {
    study.stays_below(name + ": largest error", 0.11);
    study.stays_below(name + ": all but the toe", 0.1);
    study.agrees(name + ": dZ/dT", study.value(name + ": dZ/dT measured"), 0.05);
  }
  study.converges("Z at T = 2");
  study.converges("Z at T = 3");
}
