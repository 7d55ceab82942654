// A landslide from a bowl on a hillside into a valley, `examples/landslide.json` as it is: where
// its soil comes to rest hangs neither on the step nor on the cell. The hill is a rigid body that
// cuts the mesh.
//
// Half the cell also has a finer bed: raster and body are the same, but boundaries that cut the
// mesh are as sharp as its cells.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "tests/verification/world.h"

using namespace lahar;
using namespace lahar::verification;

namespace {

/// The value that `share` of all are below.
double quantile(std::vector<double> values, double share) {
  std::ranges::sort(values);
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size()))];
}

Numbers landslide(const Resolution& at) {
  constexpr double height = 100;  // of the fall, about [m]
  Simulation simulation(
      world_case<3>("../../../examples/landslide.json", at,
                    {fmt::format("particles.0.generator.spacing={}", std::stod(at.cell) / 2)}));
  run_to_end(simulation);
  const State end(simulation.frame());
  std::vector<double> slide, x, y;
  double sum = 0;
  for (Index p = 0; p < end.size(); ++p) {
    slide.push_back(std::hypot(end.get("displacement", p, 0), end.get("displacement", p, 1),
                               end.get("displacement", p, 2)));
    sum += slide.back();
    x.push_back(end.x(p, 0));
    y.push_back(std::abs(end.x(p, 1) - 120));
  }
  return {{"mean slide", sum / static_cast<double>(end.size())},
          {"largest slide but of 1 %", quantile(slide, 0.99)},
          {"98 % of the soil lies before x =", quantile(x, 0.98)},
          {"half width of 98 % of the soil", quantile(y, 0.98)},
          {"unrest", unrest(simulation.history(), height)},
          {"lost share", lost_share(simulation)}};
}

}  // namespace

TEST_CASE("a landslide in 3D ends in the same place with half the step and half the cell") {
  const Study study("landslide", {"4", 0.2}, "2", landslide);
  for (const char* number : {"mean slide", "largest slide but of 1 %",
                             "98 % of the soil lies before x =", "half width of 98 % of the soil"})
    study.converges(number);
  study.stays_below("unrest", 0.05);
  study.stays_below("lost share", 0.001);
}
