// Aluminium rods that collapse: surface and failure line against Bui, Fukagawa, Sako and Ohno
// (2008), Int. J. Numer. Anal. Meth. Geomech. 32, 1537-1570. The points are read from their
// photograph (see world/rods-surface.csv): uncertain by about a rod, 2 mm, or 2 % of the heap's
// height.
#include <doctest/doctest.h>

#include <cmath>
#include <string>

#include "tests/verification/world.h"

using namespace lahar;
using namespace lahar::verification;

namespace {

constexpr double density = 2650, H = 0.1;
/// Depths are means over the larger cell; the front is where one layer of its particles ends, which
/// is about two rods, in the experiment, too.
constexpr double width = 0.005, layer = 0.0025;
/// From when a rod is said to have moved [m]: that of Huo et al., who compare with the same points.
constexpr double moved = 0.001;

const Curve surface = read_curve(world_file("rods-surface.csv"), 0, 1);
const Curve failure = read_curve(world_file("rods-failure.csv"), 0, 1);

Numbers collapse(const Resolution& at) {
  Simulation simulation(world_case<2>("rods.json", at));
  run_to_end(simulation);
  const State end(simulation.frame());
  const Depths depth = depths_along_x(end, density, 0, width);
  const Curve rest = depths_at_rest(end, density, 0, width, moved).curve();
  keep_curve("rods-surface", at, depth.curve());
  keep_curve("rods-failure", at, rest);
  return {{"front", depth.front(layer)},
          {"distance to the surface / H", distance(surface, depth.curve()) / H},
          {"distance to the failure line / H", distance(failure, rest) / H},
          // Where the failure line meets the floor and the top: as high as 5 and 95 % of the heap.
          {"failure at the floor", rest.last_above(0.05 * H)},
          {"failure at the top", rest.last_above(0.95 * H)},
          {"unrest", unrest(simulation.history(), H)},
          {"lost share", lost_share(simulation)}};
}

}  // namespace

TEST_CASE("aluminium rods come to rest, and fail, where Bui et al. photographed them") {
  const Study study("aluminium rods", {"0.005", 0.2}, "0.0025", collapse);
  study.agrees("front", surface.last_above(layer), 0.1);
  study.stays_below("distance to the surface / H", 0.05);
  study.stays_below("distance to the failure line / H", 0.1);
  study.agrees("failure at the floor", failure.last_above(0.05 * H), 0.1);
  study.stays_below("unrest", 0.01);
  study.stays_below("lost share", 0.001);
  study.converges("front");
  // Changes are shares of H here: both lines move by that.
  study.converges("failure at the floor", H);
  study.converges("failure at the top", H);
}
