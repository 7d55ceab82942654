// Water that sloshed in a tank comes to rest with the volume that it had, and makes no energy.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>
#include <string>
#include <variant>

#include "tests/runtime/step/models.h"
#include "tests/verification/case.h"
#include "tests/within.h"

using namespace lahar;
using namespace lahar::verification;

namespace {

/// With native defaults but for `functions`: a column of water, 0.1 m by 0.2 m, fills half of a
/// tank 0.2 m wide.
Model<2> tank(const std::string& functions, double cell, double safety) {
  const std::string text = fmt::format(
      R"({{
    "mesh": {{"structured": {{"cell_size": {}, "extent": [0.2, 0.6]}},
              "boundary_conditions": {{"velocity_constraints": [
                {{"nset": "walls", "dir": "x", "velocity": 0}},
                {{"nset": "ends", "dir": "y", "velocity": 0}}]}}}},
    "sets": {{"nodes": {{
      "walls": {{"union": [{{"half_space": {{"point": [0, 0], "normal": [1, 0]}}}},
                           {{"half_space": {{"point": [0.2, 0], "normal": [-1, 0]}}}}]}},
      "ends": {{"union": [{{"half_space": {{"point": [0, 0], "normal": [0, 1]}}}},
                          {{"half_space": {{"point": [0, 0.6], "normal": [0, -1]}}}}]}}}}}},
    "materials": [{{"name": "water", "type": "Newtonian", "density": 1000, "bulk_modulus": 4e5,
                    "dynamic_viscosity": 1e-3}}],
    "particles": [{{"generator": {{"type": "region", "per_cell": 3, "material": "water",
                    "region": {{"box": {{"min": [0, 0], "max": [0.1, 0.2]}}}}}}}}],
    "external_loading_conditions": {{"gravity": [0, -9.81]}},
    "analysis": {{{}"time_step": {{"safety": {}}}, "end_time": 3}}}})",
      cell, functions.empty() ? "" : fmt::format("\"shape_functions\": \"{}\", ", functions),
      safety);
  return std::get<Model<2>>(read_scenario_text(text, LAHAR_SOURCE_DIR).model);
}

struct Rest {
  double depth;    ///< twice the mean height, over what the volume fills
  double made;     ///< energy that came from the water's stress, over what gravity put in
  double kinetic;  ///< over the same
};

Rest come_to_rest(const std::string& functions, double cell, double safety) {
  Simulation simulation(tank(functions, cell, safety));
  simulation.run();
  const State state(simulation.frame());
  const HistoryRow end = simulation.history();
  const double height = mean(
      state, [](Index) { return true; }, [&](Index p) { return state.x(p, 1); });
  return {2 * height / 0.1, -end.internal / end.external, end.kinetic / end.external};
}

}  // namespace

TEST_CASE("water that sloshed comes to rest as high as its volume, and makes no energy") {
  for (const char* functions : {"", "element"}) {
    const std::string which = *functions ? functions : "default";
    CAPTURE(which);
    const Rest coarse = come_to_rest(functions, 0.02, 0.4);
    const Rest small_steps = come_to_rest(functions, 0.02, 0.2);
    const Rest fine = come_to_rest(functions, 0.01, 0.4);
    for (const Rest& rest : {coarse, small_steps, fine}) {
      MESSAGE(which << ": depth " << rest.depth << ", made " << rest.made << ", kinetic "
                    << rest.kinetic);
      CHECK(rest.depth == test::within(0.05, 1));
      CHECK(rest.made < 0.01);
      CHECK(rest.kinetic < 0.02);
    }
    CHECK(small_steps.depth == test::within(0.02, coarse.depth));
    CHECK(fine.depth == test::within(0.03, coarse.depth));
  }
}

namespace {

/// Energy that water without viscosity stores, over what its stress took from the flow.
template <int Dim>
double stored_of_work(Model<Dim> model) {
  auto& water = std::get<Newtonian>(model.materials[0].law);
  water.dynamic_viscosity = 0;
  water.bulk_modulus = 4e6;  // volumes hardly change
  model.analysis.scheme = Scheme::musl;
  model.analysis.opening = false;
  model.analysis.step.dt /= 50;
  model.analysis.nsteps = 400;
  Simulation simulation(model);
  simulation.run();
  const State state(simulation.frame());
  double stored = 0;
  for (Index p = 0; p < state.size(); ++p) {
    const double pressure = state.get("pressure", p);
    stored += state.get("volume", p) * pressure * pressure / (2 * water.bulk_modulus);
  }
  return stored / simulation.history().internal;
}

}  // namespace

TEST_CASE("what forces of water take from its motion is the energy of its pressure") {
  CHECK(stored_of_work(test::dam_break()) == test::within(0.02, 1));
  CHECK(stored_of_work(test::distorted(test::dam_break(), 0.02)) == test::within(0.02, 1));
  CHECK(stored_of_work(test::dam_break_3d()) == test::within(0.02, 1));
  CHECK(stored_of_work(test::distorted(test::dam_break_3d(), 0.03)) == test::within(0.02, 1));
}
