// Slopes that come to rest under their weight in quasi-static steps, on meshes and with soils on
// which Newton's method went to and fro.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <string>
#include <variant>
#include <vector>

#include "runtime/step/simulation.h"
#include "runtime/step/slide_notice.h"
#include "tests/runtime/step/models.h"
#include "tests/within.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// A slope with its crest at x = `crest` and a height and a length, on a layer, in a domain of some
/// length; [m]. Gravity grows in ten steps.
struct Slope {
  double cell, length, crest, height, run, layer;
  double friction, dilation, cohesion, tension_cutoff, youngs_modulus;

  std::string text() const {
    return fmt::format(
        R"({{"mesh": {{"structured": {{"cell_size": {0}, "extent": [{1}, {2}]}},
             "boundary_conditions": {{"velocity_constraints": [
               {{"nset": "base", "dir": "x", "velocity": 0}},
               {{"nset": "base", "dir": "y", "velocity": 0}},
               {{"nset": "sides", "dir": "x", "velocity": 0}}]}}}},
           "sets": {{"nodes": {{
             "base": {{"half_space": {{"point": [0, 0], "normal": [0, 1]}}}},
             "sides": {{"union": [{{"half_space": {{"point": [0, 0], "normal": [1, 0]}}}},
                                  {{"half_space": {{"point": [{1}, 0], "normal": [-1, 0]}}}}]}}}}}},
           "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": 0,
             "region": {{"polygon": {{"points": [[0, 0], [{1}, 0], [{1}, {3}], [{4}, {3}],
                                                 [{5}, {6}], [0, {6}]]}}}}}}}}],
           "materials": [{{"type": "MohrCoulomb", "density": 2000, "youngs_modulus": {7},
             "poisson_ratio": 0.3, "friction": {8}, "dilation": {9}, "cohesion": {10},
             "tension_cutoff": {11}}}],
           "external_loading_conditions": {{"gravity": {{"gravity": [0, -9.81],
                                                         "ramping_time": 1}}}},
           "analysis": {{"mpm_scheme": "newmark", "scheme_settings": {{"quasi_static": true}},
                         "dt": 0.1, "nsteps": 10}}}})",
        cell, length, layer + height + 1, layer, crest + run, crest, layer + height, youngs_modulus,
        friction, dilation, cohesion, tension_cutoff);
  }
};

/// 2 m, 63 degrees. In the last step its foot moves by 4 cm.
constexpr Slope sliding_slope = {.cell = 0.25,
                                 .length = 10,
                                 .crest = 2,
                                 .height = 2,
                                 .run = 1,
                                 .layer = 1,
                                 .friction = 25,
                                 .dilation = 0,
                                 .cohesion = 3e3,
                                 .tension_cutoff = 0,
                                 .youngs_modulus = 2e7};

/// What a run says.
std::vector<std::string> warnings_of(const Slope& slope) {
  std::vector<std::string> said;
  Observer observer;
  observer.warning = [&](const std::string& text) { said.push_back(text); };
  const Scenario scenario = read_scenario_text(slope.text(), "");
  Simulation simulation(std::get<Model<2>>(scenario.model), {.threads = 2}, observer);
  simulation.run();
  return said;
}

}  // namespace

TEST_CASE(
    "slopes of sand, and of soil with little tension or none, come to rest in quasi-static steps") {
  const Slope slopes[] = {
      // One particle bulges into an empty cell at the toe and begins to yield there.
      {.cell = 0.25,
       .length = 40,
       .crest = 12,
       .height = 8,
       .run = 8,
       .layer = 2,
       .friction = 20,
       .dilation = 0,
       .cohesion = 2e4,
       .tension_cutoff = 2e3,
       .youngs_modulus = 2e7},
      // Without tension: where the stress returned to was no continuous function of the increment.
      {.cell = 0.5,
       .length = 10,
       .crest = 2,
       .height = 4,
       .run = 4,
       .layer = 1,
       .friction = 20,
       .dilation = 0,
       .cohesion = 5e3,
       .tension_cutoff = 0,
       .youngs_modulus = 5e6},
      // Dry sand. At the start all of its stresses are at the tip of the yield surface.
      {.cell = 0.25,
       .length = 10,
       .crest = 1,
       .height = 2,
       .run = 4,
       .layer = 1,
       .friction = 40,
       .dilation = 0,
       .cohesion = 0,
       .tension_cutoff = 0,
       .youngs_modulus = 2e7},
      // Fails, and stands again. Each change of the displacement has to make what is not in balance
      // smaller: with twice as much allowed there was no end.
      sliding_slope};
  for (const Slope& slope : slopes) {
    CAPTURE(slope.cohesion);
    CAPTURE(slope.tension_cutoff);
    const Scenario scenario = read_scenario_text(slope.text(), "");
    Simulation simulation(std::get<Model<2>>(scenario.model), {.threads = 2});
    REQUIRE_NOTHROW(simulation.run());
    CHECK(simulation.step() == 10);
    // Virtual work of the field (0, y): what stresses do is what weights do.
    const Frame frame = simulation.frame();
    const auto& mass = frame.find("mass")->values;
    const auto& volume = frame.find("volume")->values;
    const auto& stress = frame.find("stress")->values;
    double weights = 0, stresses = 0;
    for (std::size_t p = 0; p < frame.id.size(); ++p) {
      weights += -9.81 * mass[p] * frame.coordinates[2 * p + 1];
      stresses += volume[p] * stress[6 * p + 1];
    }
    CHECK(stresses == within(5e-3, weights));
  }
}

TEST_CASE("a run warns of a slope that slid into another equilibrium, not of one that stands") {
  Slope stands = sliding_slope;
  stands.cohesion = 5e3;
  CHECK(warnings_of(stands).empty());
  const auto said = warnings_of(sliding_slope);
  REQUIRE(said.size() == 1);
  CAPTURE(said[0]);
  CHECK(said[0].starts_with("step 10 (t = 1 s): the next equilibrium was 0.0"));
  CHECK(said[0].find("the material failed where it was, and slid") != std::string::npos);
}

TEST_CASE("a slide is told once: far in cells, and far beside the steps before") {
  const LongestMove small{.metres = 1e-3, .cells = 2e-3}, far{.metres = 0.1, .cells = 0.2};
  SUBCASE("a slide") {
    SlideNotice notice;
    for (Step k = 1; k <= 3; ++k) CHECK_FALSE(notice.add(k, 0.1, 0.1, small));
    CHECK(notice.add(4, 0.4, 0.1, far));
    CHECK_FALSE(notice.add(5, 0.5, 0.1, {.metres = 10, .cells = 20}));
  }
  SUBCASE("less than a tenth of a cell") {
    SlideNotice notice;
    notice.add(1, 0.1, 0.1, small);
    CHECK_FALSE(notice.add(2, 0.2, 0.1, {.metres = 0.04, .cells = 0.08}));
  }
  SUBCASE("always far") {
    SlideNotice notice;
    for (Step k = 1; k <= 10; ++k) CHECK_FALSE(notice.add(k, 0.1, 0.1, far));
  }
  SUBCASE("steps that are not alike") {
    SlideNotice longer, shorter;
    for (Step k = 1; k <= 3; ++k) {
      CHECK_FALSE(longer.add(k, 0.1, 0.001, small));
      CHECK_FALSE(shorter.add(k, 0.1, 0.1, far));
    }
    CHECK_FALSE(longer.add(4, 0.2, 0.1, far));     // as fast as before
    CHECK_FALSE(shorter.add(4, 0.4, 0.001, far));  // as far as before
  }
  SUBCASE("loads that begin late") {
    SlideNotice notice;
    notice.add(1, 0.1, 0.1, {});
    CHECK_FALSE(notice.add(2, 0.2, 0.1, far));
  }
}
