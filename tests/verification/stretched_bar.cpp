// A bar that lies across the grid is pulled to three times its length: it begins with the velocity
// v = d(lambda)/dt (n . X) n along it and is so soft that its ends, where nothing holds it, do not
// make themselves felt in its middle third. There the motion is x = X + (lambda - 1) (n . X) n with
// lambda = 1 + t / 1 s, and of a neo-Hookean material with nu = 0 the stress is
//   sigma = E / 2 (lambda^2 - 1) / lambda along the bar, 4/3 E at lambda = 3,
// and nothing across it. Particles move apart by more than a cell: functions that do not know how
// far a particle reaches, or only along the axes of the grid, let the bar fall apart.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "physics/base/error.h"
#include "tests/verification/case.h"
#include "tests/within.h"

using namespace lahar;
using namespace lahar::verification;

namespace {

constexpr double E = 100, stretch = 3;

/// 2 m by 0.2 m at 45 degrees around the middle of the mesh. Waves cross at most 0.63 m of it.
Model<2> bar(const std::string& functions, Scheme scheme) {
  Model<2> model = model_of_text<2>(R"({
    "mesh": {"structured": {"cell_size": 0.05, "extent": [4.5, 4.5]}},
    "materials": [{"type": "NeoHookean", "density": 1000, "youngs_modulus": 100,
                   "poisson_ratio": 0}],
    "particles": [{"generator": {"type": "region", "per_cell": 2, "material": 0,
      "region": {"intersection": [
        {"half_space": {"point": [2.95711, 2.95711], "normal": [1, 1]}},
        {"half_space": {"point": [1.54289, 1.54289], "normal": [-1, -1]}},
        {"half_space": {"point": [2.17929, 2.32071], "normal": [-1, 1]}},
        {"half_space": {"point": [2.32071, 2.17929], "normal": [1, -1]}}]}}}],
    "analysis": {"dt": 2e-3, "end_time": 2, "shape_functions": ")" +
                                    functions + R"("}})");
  model.analysis.scheme = scheme;
  for (const Vec<2>& x : model.particles.x) {
    const double along = x[0] + x[1] - 4.5;  // times sqrt(2)
    model.particles.velocity.push_back(Vec<2>(0.5, 0.5) * along);
  }
  return model;
}

/// Mean of the stress along the bar in its middle third, and the largest difference to it and of
/// other components from 0, over the exact stress.
struct Stress {
  double mean, scatter;
};

Stress stress_of(const std::string& functions, Scheme scheme = Scheme::usl) try {
  Simulation simulation(bar(functions, scheme));
  simulation.run();
  const State end(simulation.frame());
  const auto middle = [&](Index p) {
    return std::abs(end.x(p, 0) + end.x(p, 1) - 4.5) / std::sqrt(2.0) < stretch / 3;
  };
  const double exact = E / 2 * (stretch * stretch - 1) / stretch;
  const auto along = [&](Index p) {
    return (0.5 * (end.get("stress", p, 0) + end.get("stress", p, 1)) + end.get("stress", p, 3)) /
           exact;
  };
  Stress stress{mean(end, middle, along), 0};
  for (Index p = 0; p < end.size(); ++p) {
    if (!middle(p)) continue;
    const double shear = 0.5 * (end.get("stress", p, 0) - end.get("stress", p, 1)) / exact;
    const double across = 0.5 * (end.get("stress", p, 0) + end.get("stress", p, 1)) / exact -
                          end.get("stress", p, 3) / exact;
    for (const double error : {along(p) - stress.mean, shear, across})
      stress.scatter = std::max(stress.scatter, std::abs(error));
  }
  return stress;
} catch (const SimulationError&) {  // cells collapse
  return {0, 0};
}

}  // namespace

TEST_CASE("a bar pulled to three times its length holds with CPDI and CPDI2, and with no other") {
  // Measured: mean 0.9997 and scatter 0.016 with CPDI, 0.9998 and 0.010 with CPDI2; -0.25 and 1.1
  // with linear functions, 0.35 and 0.6 with boxes that keep their size, 0.88 and 0.7 with GIMP.
  for (const char* functions : {"cpdi", "cpdi2"})
    for (const Scheme scheme : {Scheme::usf, Scheme::usl, Scheme::musl}) {
      const Stress stress = stress_of(functions, scheme);
      CHECK(stress.mean == test::within(0.005, 1));
      CHECK(stress.scatter < 0.03);
    }
  for (const char* functions : {"element", "uniform_gimp"}) CHECK(stress_of(functions).mean < 0.5);
  CHECK(stress_of("gimp").scatter > 0.5);
}
