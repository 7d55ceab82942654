// The example of CONTRIBUTING.md is a stage: it compiles, and does what it says in every scheme.
#include "tests/contributing.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "tests/runtime/step/by_hand.h"
#include "tests/runtime/step/contributing_stage.h"

using namespace lahar;
using namespace lahar::test;

namespace {

constexpr Scheme schemes[] = {Scheme::usf, Scheme::usl, Scheme::musl};

/// A block of 1000 kg that flies across cells and patches, along nodes of a floor that moves.
Model<2> flying_block(Scheme scheme) {
  Model<2> model = model_of_text<2>(R"({
    "mesh": {"structured": {"cell_size": 0.25, "extent": [4, 2]},
             "boundary_conditions": {"velocity_constraints": [
               {"nset": "floor", "dir": "x", "velocity": 0.5}]}},
    "sets": {"nodes": {"floor": {"half_space": {"point": [0, 0.5], "normal": [0, 1]}}}},
    "materials": [{"type": "LinearElastic", "density": 1000, "youngs_modulus": 1e5,
                   "poisson_ratio": 0.3}],
    "particles": [{"generator": {"type": "region", "per_cell": 2, "material": 0,
                                 "velocity": [3, 0],
                                 "region": {"box": {"min": [0.5, 0.5], "max": [1.5, 1.5]}}}}],
    "analysis": {"dt": 2e-3, "nsteps": 100, "patch_particles": 16}})");
  model.analysis.scheme = scheme;
  model.analysis.sudden_velocities = false;  // of the floor, which does not move as the block
  return model;
}

/// A model whose time step has the stage of the example behind `integrate`.
struct Damped : ByHand<2> {
  explicit Damped(const Model<2>& from) : ByHand<2>(from) {
    const auto integrate = std::find_if(stages.begin(), stages.end(), [](const auto& stage) {
      return stage.stage.name == "integrate";
    });
    const Stages<2> added = viscous_damping<2>(model.analysis);
    stages.insert(integrate + 1, added.begin(), added.end());
    const std::size_t before = phases.size();
    std::vector<Stage> list;
    for (const auto& stage : stages) list.push_back(stage.stage);
    phases = phases_of(list);
    CHECK(phases.size() == before);
  }
};

}  // namespace

TEST_CASE("the stage of CONTRIBUTING.md is the one that is compiled here") {
  CHECK(contributing_has("tests/runtime/step/contributing_stage.h"));
}

TEST_CASE("the stage of CONTRIBUTING.md slows a body in flight, and counts the work") {
  for (const Scheme scheme : schemes) {
    CAPTURE(static_cast<int>(scheme));
    Model<2> model = flying_block(scheme);
    entries_of<NodeVelocity>(model).clear();
    Damped hand(model);
    constexpr int steps = 100;
    for (int step = 0; step < steps; ++step) hand.step();
    const double v = 3 * std::pow(1 + damping_rate * model.analysis.step.dt, -steps);
    const Frame frame = hand.frame();
    REQUIRE(frame.size() == 64);
    const auto& velocity = frame.find("velocity")->values;
    for (std::size_t p = 0; p < 64; ++p) {
      CHECK(velocity[2 * p] == doctest::Approx(v).epsilon(1e-10));
      CHECK(std::abs(velocity[2 * p + 1]) < 1e-10);
    }
    double work = 0;
    for (int p = 0; p < hand.patches.size(); ++p) work += hand.patches[p].work.damping;
    CHECK(work == doctest::Approx(500 * (9 - v * v)).epsilon(1e-10));
  }
}

TEST_CASE("the stage of CONTRIBUTING.md leaves prescribed velocities as they are") {
  for (const Scheme scheme : schemes) {
    Damped hand(flying_block(scheme));
    int held = 0;
    hand.after = [&](const Phase& phase, const std::vector<int>& active) {
      if (phase.task.name.find("damping") == std::string::npos) return;
      for (const int i : active) {
        Patch<2>& patch = hand.patches[i];
        for (const auto& fixed : patch.fixed) {
          if (!patch.node_is_active[static_cast<std::size_t>(fixed.node)]) continue;
          ++held;
          CHECK(at(patch.velocity, fixed.node)[fixed.dir] == 0.5);
          CHECK(at(patch.acceleration, fixed.node)[fixed.dir] == 0.0);
        }
      }
    };
    for (int step = 0; step < 20; ++step) hand.step();
    CHECK(held > 100);
  }
}
