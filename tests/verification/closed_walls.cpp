// Walls whose nodes are held let nothing through, however near to them particles come.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>

#include "tests/verification/case.h"

using namespace lahar;
using namespace lahar::verification;

namespace {

/// One particle under tension that pulls the light node beside it, at a distance s [m] from the
/// right side of a cell of 0.1 m whose nodes are held, in a mesh of 3 x 3 cells. The explicit step
/// moves it by dt^2 sigma / (rho h) = 1e-4 m towards that side.
Model<2> beside_wall(const std::string& element, double side, const std::string& condition,
                     double s, const std::string& more = "") {
  Model<2> model = model_of_text<2>(fmt::format(
      R"({{
    "mesh": {{"structured": {{"cell_size": 0.1, "counts": [3, 3]}}, "cell_type": "{0}",
              "boundary_conditions": {{{1}}}}},
    "sets": {{"nodes": {{"wall": {{"box": {{"min": [{2}, 0], "max": [{3}, 0.3]}}}}}}}},
    "materials": [{{"type": "LinearElastic", "density": 1000, "youngs_modulus": 1e6,
                    "poisson_ratio": 0}}],
    "particles": [{{"generator": {{"type": "region", "per_cell": 1, "material": 0, "velocity": [0.02, 0.1],
                    "region": {{"box": {{"min": [{4}, 0.1], "max": [{5}, 0.2]}}}}}}}}],
    "analysis": {{{6}"mpm_scheme": "musl", "dt": 1e-3, "nsteps": 50}}}})",
      element, condition, side - 1e-6, side + 0.1 + 1e-6, side - 0.1, side, more));
  model.particles.x.resize(1);
  model.particles.cell.resize(1);
  model.particles.volume.resize(1);
  model.particles.material.resize(1);
  model.particles.velocity.resize(1);
  model.particles.x[0] = Vec<2>(side - s, 0.149);
  model.particles.cell[0] = model.mesh->locate(model.particles.x[0]).cell;
  Voigt stress{};
  stress[0] = 1e4;
  model.particles.stress.assign(1, stress);
  return model;
}

const char* held = R"("velocity_constraints": [{"nset": "wall", "dir": "x", "velocity": 0}])";
const char* pushing = R"("walls": [{"nset": "wall", "normal": [-1, 0], "friction": 0}])";

void check_stays(const Model<2>& model, double side) {
  Simulation simulation(model);
  simulation.advance(1);
  const State next(simulation.frame());
  CHECK(next.x(0, 0) < side);
  CHECK(next.get("velocity", 0, 0) <= 0);
  CHECK(next.get("velocity", 0, 1) == doctest::Approx(0.1));
  CHECK(next.get("displacement", 0, 0) ==
        doctest::Approx(next.x(0, 0) - model.particles.x[0][0]).epsilon(1e-9));
  simulation.run();
  CHECK(State(simulation.frame()).x(0, 0) < side);
}

}  // namespace

TEST_CASE("a particle that a light node pulls does not pass a closed side of the mesh") {
  for (const char* element : {"ED2Q4", "ED2T3", "ED2Q9"})
    for (const char* condition : {held, pushing}) {
      CAPTURE(element);
      CAPTURE(condition);
      check_stays(beside_wall(element, 0.3, condition, 1e-5), 0.3);
    }
}

TEST_CASE("a particle that a light node pulls does not enter an obstacle of nodes that are held") {
  check_stays(beside_wall("ED2Q4", 0.2, held, 1e-5), 0.2);
}

TEST_CASE("with CB-Geo's preset a particle passes a closed side of the mesh, as there") {
  Model<2> model = beside_wall("ED2Q4", 0.3, held, 1e-5, R"("preset": "cbgeo", )");
  CHECK_THROWS_AS(Simulation(model).advance(1), SimulationError);
}

TEST_CASE("a side of the mesh that is not held is open") {
  CHECK_THROWS_AS(
      check_stays(
          beside_wall("ED2Q4", 0.3,
                      R"("velocity_constraints": [{"nset": "wall", "dir": "y", "velocity": 0}])",
                      1e-5),
          0.3),
      SimulationError);
}

TEST_CASE(
    "water that breaks on a column stays in its tank, at the default step and at half of it") {
  for (const double safety : {0.5, 0.25}) {
    Model<3> model = model_of_text<3>(fmt::format(
        R"({{
    "mesh": {{"structured": {{"cell_size": 0.05, "extent": [1.6, 0.6, 0.6]}},
      "boundary_conditions": {{"velocity_constraints": [
        {{"nset": "column", "dir": "x", "velocity": 0}},
        {{"nset": "column", "dir": "y", "velocity": 0}},
        {{"nset": "column", "dir": "z", "velocity": 0}},
        {{"nset": "ends", "dir": "x", "velocity": 0}},
        {{"nset": "sides", "dir": "y", "velocity": 0}},
        {{"nset": "bottom", "dir": "z", "velocity": 0}}]}}}},
    "sets": {{"nodes": {{
      "column": {{"box": {{"min": [0.9, 0.25, 0], "max": [1.0, 0.35, 0.4]}}}},
      "bottom": {{"union": [{{"half_space": {{"point": [0, 0, 0], "normal": [0, 0, 1]}}}},
                            {{"half_space": {{"point": [0, 0, 0.6], "normal": [0, 0, -1]}}}}]}},
      "ends": {{"union": [{{"half_space": {{"point": [0, 0, 0], "normal": [1, 0, 0]}}}},
                          {{"half_space": {{"point": [1.6, 0, 0], "normal": [-1, 0, 0]}}}}]}},
      "sides": {{"union": [{{"half_space": {{"point": [0, 0, 0], "normal": [0, 1, 0]}}}},
                           {{"half_space": {{"point": [0, 0.6, 0], "normal": [0, -1, 0]}}}}]}}}}}},
    "materials": [{{"type": "Newtonian", "density": 1000, "bulk_modulus": 6e5,
                    "dynamic_viscosity": 1e-3}}],
    "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": 0,
                    "region": {{"box": {{"max": [0.4, 0.6, 0.3]}}}}}}}}],
    "external_loading_conditions": {{"gravity": [0, 0, -9.81]}},
    "analysis": {{"mpm_scheme": "musl", "pressure_smoothing": true, "nsteps": 100000,
                  "time_step": {{"adaptive": true, "safety": {}}}, "end_time": 1.0}}}})",
        safety));
    const Index n = model.particles.size();
    Simulation simulation(std::move(model));
    simulation.run();
    const State end(simulation.frame());
    CHECK(end.size() == n);
    Index inside = 0;
    for (Index p = 0; p < end.size(); ++p)
      inside += end.x(p, 0) > 0.9 && end.x(p, 0) < 1.0 && end.x(p, 1) > 0.25 &&
                end.x(p, 1) < 0.35 && end.x(p, 2) < 0.4;
    CAPTURE(safety);
    CHECK(inside == 0);
  }
}

TEST_CASE("water that breaks on a box does not come into it, with any functions") {
  for (const char* const functions : {"element", "gimp", "quadratic_spline", "cubic_spline"}) {
    Model<2> model = model_of_text<2>(fmt::format(
        R"({{
    "mesh": {{"structured": {{"cell_size": 0.02, "extent": [0.8, 0.6]}},
      "boundary_conditions": {{"velocity_constraints": [
        {{"nset": "box", "dir": "x", "velocity": 0}}, {{"nset": "box", "dir": "y", "velocity": 0}},
        {{"nset": "ends", "dir": "x", "velocity": 0}},
        {{"nset": "bottom", "dir": "y", "velocity": 0}}]}}}},
    "sets": {{"nodes": {{
      "box": {{"box": {{"min": [0.4, 0], "max": [0.5, 0.08]}}}},
      "bottom": {{"half_space": {{"point": [0, 0], "normal": [0, 1]}}}},
      "ends": {{"union": [{{"half_space": {{"point": [0, 0], "normal": [1, 0]}}}},
                          {{"half_space": {{"point": [0.8, 0], "normal": [-1, 0]}}}}]}}}}}},
    "materials": [{{"type": "Newtonian", "density": 1000, "bulk_modulus": 4e5,
                    "dynamic_viscosity": 1e-3}}],
    "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": 0,
                    "region": {{"box": {{"max": [0.2, 0.2]}}}}}}}}],
    "external_loading_conditions": {{"gravity": [0, -9.81]}},
    "analysis": {{"mpm_scheme": "musl", "shape_functions": "{}",
                  "velocity_update_settings": {{"relaxation": 0.05}},
                  "time_step": {{"adaptive": true, "safety": 0.4}}, "end_time": 0.7}}}})",
        functions));
    Simulation simulation(std::move(model));
    Index inside = 0, over = 0;
    while (!simulation.finished()) {
      simulation.advance(50);
      const State state(simulation.frame());
      for (Index p = 0; p < state.size(); ++p) {
        inside += state.x(p, 0) > 0.4 && state.x(p, 0) < 0.5 && state.x(p, 1) < 0.08;
        over += state.x(p, 0) > 0.5;
      }
    }
    CAPTURE(functions);
    CHECK(inside == 0);
    CHECK(over > 0);
  }
}
