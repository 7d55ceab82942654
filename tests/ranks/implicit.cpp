// Implicit steps on several ranks and threads, and over a restart: the bits of one rank.
#include <doctest/doctest.h>

#include <string>

#include "runtime/step/restart.h"
#include "tests/ranks/checkpoint_bytes.h"
#include "tests/ranks/shared_folder.h"
#include "tests/runtime/step/models.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// A block of soil that is held at its left end and bends under its weight until it yields.
Model<2> bending_block(bool quasi_static, ImplicitSteps::Solver solver) {
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
  model.analysis.implicit.solver = solver;
  return model;
}

void check(const Model<2>& model, Index steps) {
  const Communicator ranks = Communicator::world();
  const SharedFolder folder(ranks);
  std::string middle, end;
  if (ranks.rank() == 0) try {
      Simulation simulation(model, {.threads = 1});
      simulation.advance(steps / 2);
      middle = checkpoint_of(simulation, {}, folder.path / "one");
      simulation.advance(steps - steps / 2);
      end = checkpoint_of(simulation, {}, folder.path / "one");
    } catch (const std::exception& error) {  // others wait
      FAIL_CHECK(std::string(error.what()));
    }
  ranks.broadcast(middle);
  ranks.broadcast(end);
  const CheckpointReader reader(folder.path / "one" / checkpoint_name(steps / 2));
  for (const int threads : {1, 2, 4}) {
    CAPTURE(threads);
    const auto own = folder.path / std::to_string(threads);
    const ExecutionOptions way{.threads = threads, .ranks = ranks};
    Simulation simulation(model, way);
    simulation.advance(steps / 2);
    CHECK(checkpoint_of(simulation, ranks, own) == middle);
    simulation.advance(steps - steps / 2);
    CHECK(checkpoint_of(simulation, ranks, own) == end);
    Simulation resumed(model, way, {}, state_in(reader));
    resumed.advance(steps - steps / 2);
    CHECK(checkpoint_of(resumed, ranks, folder.path / ("on" + std::to_string(threads))) == end);
  }
}

}  // namespace

TEST_CASE("implicit steps with a direct and an iterative solver") {
  for (const auto solver : {ImplicitSteps::Solver::direct, ImplicitSteps::Solver::iterative}) {
    CAPTURE(static_cast<int>(solver));
    check(bending_block(false, solver), 8);
    check(bending_block(true, solver), 2);
  }
}
