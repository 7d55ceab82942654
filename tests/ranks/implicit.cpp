// Implicit steps on several ranks and threads, and over a restart: the bits of one rank.
#include <doctest/doctest.h>

#include "tests/ranks/same_checkpoints.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// A block of soil that is held at its left end and bends under its weight until it yields.
Model<2> bending_block(bool quasi_static, LinearSolver::Method solver) {
  Model<2> model = model_of_text<2>(R"({
    "mesh": {"structured": {"cell_size": 0.25, "extent": [4, 3]},
             "boundary_conditions": {"velocity_constraints": [
               {"nset": "wall", "dir": "x", "velocity": 0},
               {"nset": "wall", "dir": "y", "velocity": 0}]}},
    "sets": {"nodes": {"wall": {"half_space": {"point": [0, 0], "normal": [1, 0]}}}},
    "materials": [{"type": "VonMises", "density": 1000, "youngs_modulus": 1e6,
                   "poisson_ratio": 0.3, "yield_stress": 30000, "hardening_modulus": 1e5}],
    "particles": [{"generator": {"type": "region", "per_cell": 2, "material": 0,
                                 "region": {"box": {"min": [0, 1.5], "max": [2, 2.5]}}}}],
    "external_loading_conditions": {"gravity": [0, -5]},
    "analysis": {"mpm_scheme": "newmark", "dt": 0.02, "nsteps": 1000, "patch_particles": 24}})");
  model.analysis.implicit.quasi_static = quasi_static;
  model.analysis.linear.method = solver;
  return model;
}

}  // namespace

TEST_CASE("adaptive implicit steps, of which some are cut") {
  for (const bool quasi_static : {true, false}) {
    CAPTURE(quasi_static);
    Model<2> model = bending_block(quasi_static, LinearSolver::Method::automatic);
    model.gravity[1] = -12;
    model.functions = {MathFunction{.x = {0, 1}, .f = {0, 1}}};
    model.gravity_function = 0;
    model.analysis.step = {.adaptive = true, .dt = 0.5, .safety = 0.2};
    model.analysis.end_time = 1;
    Simulation simulation(model, {.threads = 1, .ranks = Communicator::world()});
    simulation.run();
    CHECK(simulation.time() == 1.0);
    CHECK(simulation.info().solves.cuts > 1);
    check_same_checkpoints(model, simulation.step());
  }
}

TEST_CASE("implicit steps with a direct and an iterative solver") {
  for (const auto solver : {LinearSolver::Method::direct, LinearSolver::Method::iterative}) {
    CAPTURE(static_cast<int>(solver));
    check_same_checkpoints(bending_block(false, solver), 8);
    check_same_checkpoints(bending_block(true, solver), 2);
  }
}
