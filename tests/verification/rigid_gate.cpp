// A gate holds water, and opens.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>
#include <string>

#include "tests/verification/case.h"
#include "tests/within.h"

using namespace lahar;
using namespace lahar::verification;

namespace {

constexpr double depth = 0.8, density = 1000, gravity = 9.81;
constexpr double opens = 0.3;  ///< [s]

/// Water of 0.8 x 0.8 m beside a gate that goes up from 0.3 s on with `speed`; 0: no gate.
struct Water {
  double force = 0;    ///< [N/m] on the gate, mean from 0.15 to 0.3 s
  double arrival = 0;  ///< [s] at 1.6 m

  explicit Water(double speed) {
    const std::string gate = fmt::format(
        R"("math_functions": [{{"type": "Linear", "xvalues": [0, {0}, {1}], "fxvalues": [0, 0, 1]}}],
           "rigid_bodies": [{{"name": "gate", "velocity": [0, {2}], "math_function_id": 0,
             "region": {{"box": {{"min": [0.8, -0.2], "max": [0.92, 2]}}}}}}],)",
        opens, opens + 1e-3, speed);
    Simulation simulation(model_by_default<2>(fmt::format(
        R"({{"mesh": {{"structured": {{"cell_size": 0.04, "extent": [2, 1.6]}},
               "boundary_conditions": {{"walls": [{{"nset": "floor", "normal": [0, 1]}},
                                                  {{"nset": "left", "normal": [1, 0]}}]}}}},
            "sets": {{"nodes": {{
              "floor": {{"half_space": {{"point": [0, 0], "normal": [0, 1]}}}},
              "left": {{"half_space": {{"point": [0, 0], "normal": [1, 0]}}}}}}}},
            {}
            "materials": [{{"name": "water", "type": "Newtonian", "density": 1000,
                            "bulk_modulus": 2e6, "dynamic_viscosity": 1e-3}}],
            "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": "water",
               "region": {{"box": {{"min": [0, 0], "max": [0.8, 0.8]}}}}}}}}],
            "external_loading_conditions": {{"gravity": [0, -9.81]}},
            "analysis": {{"end_time": 1.2}}}})",
        speed > 0 ? gate : "")));
    int rows = 0;
    while (!simulation.finished() && arrival == 0) {
      simulation.advance(10);
      if (speed > 0 && simulation.time() > opens / 2 && simulation.time() < opens) {
        force += simulation.history().bodies.at(0).force[0];
        ++rows;
      }
      if (speed > 0 && simulation.time() < opens) continue;
      const State now(simulation.frame());
      for (Index p = 0; p < now.size(); ++p)
        if (now.x(p, 0) > 1.6) arrival = simulation.time();
    }
    if (rows > 0) force /= rows;
  }
};

}  // namespace

TEST_CASE("rigid bodies: a gate bears the water behind it, and lets it go as fast as it opens") {
  const Water free(0), slow(1.5), fast(6);
  MESSAGE("force " << slow.force << " N/m, at 1.6 m after " << free.arrival << " s, by a gate "
                   << slow.arrival - opens << " and " << fast.arrival - opens << " s");
  CHECK(slow.force == test::within(0.03, density * gravity * depth * depth / 2));
  const double slow_delay = slow.arrival - opens - free.arrival;
  const double fast_delay = fast.arrival - opens - free.arrival;
  // The gate is open after depth / speed; the water below it flows before.
  CHECK(fast_delay > 0);
  CHECK(fast_delay < 0.7 * depth / 6);
  CHECK(slow_delay < 0.7 * depth / 1.5);
  CHECK(fast_delay < 0.5 * slow_delay);
}
