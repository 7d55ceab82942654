// Columns of sand that collapse on a rough floor: run-out against Lube, Huppert, Sparks and Freundt
// (2005), Phys. Rev. E 72, 041301, and Lajeunesse, Monnier and Homsy (2005), Phys. Fluids 17,
// 103302.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tests/verification/case.h"

using namespace lahar;
using namespace lahar::verification;

namespace {

constexpr double L0 = 0.1;

/// (Linf - L0) / L0 of the column of the examples with another aspect ratio a = h0 / L0.
double run_out(double a) {
  ScenarioOptions options;
  const double cell = 0.005, reach = L0 * (3 + 3 * a);
  const auto cells = [&](double size) { return static_cast<int>(std::ceil(size / cell)); };
  options.overrides = {
      fmt::format("mesh.structured.counts=[{},{}]", cells(reach), cells(a * L0) + 12),
      fmt::format("particles.0.generator.region.box.max=[{},{}]", L0, a * L0),
      "analysis.end_time=1.2"};
  Scenario scenario = read_scenario(LAHAR_SOURCE_DIR "/examples/column-collapse.json", options);
  Simulation<2> simulation(std::get<Model<2>>(std::move(scenario.model)));
  simulation.run();
  const State end(simulation.frame());
  std::vector<double> x;
  for (Index p = 0; p < end.size(); ++p) x.push_back(end.x(p, 0));
  std::sort(x.begin(), x.end());
  const HistoryRow row = simulation.history();
  MESSAGE("a = " << a << ": mean speed at the end "
                 << std::sqrt(2 * row.kinetic / row.mass) / std::sqrt(9.81 * a * L0)
                 << " sqrt(g h0)");
  // The front is where the deposit ends; single grains run ahead of it in experiments, too.
  return (x[x.size() - x.size() / 200] - L0) / L0;
}

}  // namespace

TEST_CASE("a column of sand runs out as far as experiments say, whatever its aspect ratio") {
  for (const double a : {1.0, 2.0, 4.0}) {
    const double law = a < 2.3 ? 1.2 * a : 1.9 * std::pow(a, 2.0 / 3.0);
    const double ours = run_out(a);
    MESSAGE("a = " << a << ": run-out " << ours << ", law " << law);
    CHECK(ours == doctest::Approx(law).epsilon(0.1));
  }
}
