// Force of sand that slides down a chute on a wall across it, as Moriguchi, Borja, Yashima and
// Sawada (2009), Acta Geotech. 4, 57-71, measured it at 45 to 65 degrees. Their forces are
// published as curves only, and no reading of them was found that could be cited: nothing here is
// compared with them. What is checked is what follows from mechanics, and that the force converges:
//
// - until its front meets the wall, after 0.34 s, the bed takes mu times the impulse that it gives;
// - at rest the wall carries M g sin of the chute's angle, give or take what the bed can: mu M g
// cos;
// - the largest force is more than that of the sand at rest.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "tests/verification/world.h"

using namespace lahar;
using namespace lahar::verification;

namespace {

/// As in world/sand-chute.json; `g_along` and `g_across` are gravity's components.
constexpr double density = 1600, mu = 0.4, g_along = 6.936717, g_across = 6.936717;
constexpr double length = 0.6, depth = 0.2, weight = density * length * depth * g_along;
/// Means over so many seconds, as a load cell gives them, a value every so many.
constexpr double window = 0.04, interval = 0.004;

Numbers impact(const Resolution& at) {
  Curve force, friction;
  Simulation simulation(world_case<2>("sand-chute.json", at), {}, observe_gauge(force));
  const StepGuard guard(simulation);
  while (!simulation.finished()) {
    guard.check(simulation);
    simulation.advance(std::max<Index>(1, static_cast<Index>(interval / simulation.info().dt)));
    const HistoryRow row = simulation.history();
    // What the bed took of the momentum along it, over what it gave across: until the wall acts.
    friction.add(row.time, (row.mass * g_along * row.time + row.momentum[0]) /
                               (row.mass * g_across * row.time + row.momentum[1]));
  }
  for (double& f : force.y) f /= -weight;  // the wall is pushed along -x
  keep_curve("chute-force", at, force);
  Numbers n{{"lost share", lost_share(simulation)},
            {"friction of the bed", friction.at(0.3)},
            {"largest force / weight", 0}};
  const double end = force.x.back();
  const auto mean = [&](double from, double to) {
    double sum = 0;
    int count = 0;
    for (std::size_t i = 0; i < force.x.size(); ++i)
      if (force.x[i] >= from && force.x[i] < to) {
        sum += force.y[i];
        ++count;
      }
    return count > 0 ? sum / count : 0.0;
  };
  Curve smooth;
  for (double t = 0; t + window <= end; t += interval)
    smooth.add(t + window / 2, mean(t, t + window));
  const double largest = *std::max_element(smooth.y.begin(), smooth.y.end());
  const auto risen =
      std::find_if(smooth.y.begin(), smooth.y.end(), [&](double f) { return f > 0.9 * largest; });
  n["largest force / weight"] = largest;
  // The largest is hardly above the force at rest: when it comes says little.
  n["time until 0.9 of it"] = smooth.x[static_cast<std::size_t>(risen - smooth.y.begin())];
  n["force at rest / weight"] = mean(end - 0.2, end);
  return n;
}

}  // namespace

TEST_CASE("sand that slides down a chute pushes a wall as the balance of forces says") {
  const Study study("sand on a chute", {"0.02", 0.2}, "0.01", impact);
  study.agrees("friction of the bed", mu, 0.02);
  study.agrees("force at rest / weight", 1 - mu * g_across / g_along, 1 + mu * g_across / g_along,
               0);
  CHECK(study.value("largest force / weight") > study.value("force at rest / weight"));
  study.stays_below("lost share", 0.001);
  study.converges("largest force / weight");
  study.converges("time until 0.9 of it");
  study.converges("force at rest / weight");
}
