// Footings on critical state soils in quasi-static steps.
#include <doctest/doctest.h>

#include <string>
#include <variant>

#include "runtime/step/simulation.h"
#include "tests/runtime/step/models.h"
#include "tests/within.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// A load on 1 m of the surface of 3 m of soil, with the symmetry's plane at x = 0. The soil begins
/// with the stresses of its weight; the load grows in `steps`.
std::string footing(const std::string& material, double load, int steps) {
  return R"({"mesh": {"structured": {"cell_size": 0.25, "extent": [6, 3.5]},
       "boundary_conditions": {"velocity_constraints": [
         {"nset": "base", "dir": "x", "velocity": 0}, {"nset": "base", "dir": "y", "velocity": 0},
         {"nset": "sides", "dir": "x", "velocity": 0}]},
       "particles_stresses": {"type": "k0", "k0": 0.6}},
     "sets": {"nodes": {
         "base": {"half_space": {"point": [0, 0], "normal": [0, 1]}},
         "sides": {"union": [{"half_space": {"point": [0, 0], "normal": [1, 0]}},
                             {"half_space": {"point": [6, 0], "normal": [-1, 0]}}]}},
       "particles": {"load": {"box": {"min": [0, 2.875], "max": [1, 3]}}}},
     "particles": [{"generator": {"type": "region", "per_cell": 2, "material": 0,
       "region": {"box": {"min": [0, 0], "max": [6, 3]}}}}],
     "materials": [)" +
         material + R"(],
     "math_functions": [{"id": 0, "type": "Linear", "xvalues": [0, 1], "fxvalues": [0, 1]}],
     "external_loading_conditions": {"gravity": {"gravity": [0, -9.81]},
       "particle_surface_traction": [{"pset": "load", "dir": 1, "math_function_id": 0,
                                      "traction": )" +
         std::to_string(-load) + R"(}]},
     "analysis": {"mpm_scheme": "newmark", "scheme_settings": {"quasi_static": true},
                  "dt": )" +
         std::to_string(1.0 / steps) + R"(, "nsteps": )" + std::to_string(steps) + "}}";
}

/// Settlement of the load [m], and iterations of Newton's method per step.
struct Settled {
  double depth, iterations;
};
Settled settle(const std::string& text, int steps) {
  const Scenario scenario = read_scenario_text(text, "");
  Simulation simulation(std::get<Model<2>>(scenario.model), {.threads = 2});
  simulation.run();
  REQUIRE(simulation.step() == steps);
  const Frame frame = simulation.frame();
  const auto& displacement = frame.find("displacement")->values;
  double deepest = 0;
  for (std::size_t p = 0; p < frame.id.size(); ++p)
    deepest = std::min(deepest, displacement[2 * p + 1]);
  const SolveCounts solves = simulation.info().solves;
  CHECK(solves.in_parts == 0);
  return {-deepest, static_cast<double>(solves.iterations) / steps};
}

}  // namespace

TEST_CASE("a footing on Cam-Clay or NorSand: few iterations a step, and half the step leaves it") {
  const std::string clay =
      R"({"type": "ModifiedCamClay", "density": 1800, "youngs_modulus": 1e7, "poisson_ratio": 0.3,
          "p_ref": 1e5, "e_ref": 1.12, "pc0": 1e5, "ocr": 1, "m": 1.2, "lambda": 0.1,
          "kappa": 0.03})";
  const std::string sand =
      R"({"type": "NorSand", "density": 1800, "poisson_ratio": 0.3, "reference_pressure": 1e5,
          "friction_cs": 32, "N": 0.3, "lambda": 0.03, "kappa": 0.006, "gamma": 0.9, "chi": 3.5,
          "hardening_modulus": 200, "void_ratio_initial": 0.7, "p_image_initial": 60e3})";
  for (const std::string& soil : {clay, sand}) {
    CAPTURE(soil);
    const Settled whole = settle(footing(soil, 4e4, 10), 10),
                  half = settle(footing(soil, 4e4, 20), 20);
    CHECK(whole.iterations < 7);
    CHECK(half.iterations < 7);
    CHECK(whole.depth > 0.005);
    CHECK(whole.depth == within(0.02, half.depth));
  }
}
