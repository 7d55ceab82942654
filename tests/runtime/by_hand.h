/// \file Steps made by hand, stage by stage and patch by patch, so that tests can look between.
#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "physics/kernels.h"
#include "runtime/patch_set.h"
#include "runtime/timestep.h"
#include "tests/runtime/models.h"

namespace lahar::test {

/// Patches that all do one stage before any does the next, also where a run does the stages of a
/// phase chunk by chunk. Patches are not created or dropped; time steps are fixed.
template <int Dim>
struct ByHand {
  Model<Dim> model;
  PatchSet<Dim> patches;
  std::vector<TimestepStage<Dim>> stages;
  std::vector<Phase> phases;
  Index steps = 0;
  /// Called after all patches have done a stage of a step.
  std::function<void(const std::string& stage, Index step)> after = [](const auto&, Index) {};

  explicit ByHand(Model<Dim> model_in, int rings = 0)
      : model(std::move(model_in)),
        patches(model, rings, node_sum_copies(model.analysis)),
        stages(timestep<Dim>(model.analysis)) {
    std::vector<Stage> list;
    for (const auto& stage : stages) list.push_back(stage.stage);
    phases = phases_of(list);
    for (int p = 0; p < patches.size(); ++p) receive(patches[p]);
    for (int p = 0; p < patches.size(); ++p) map_first(patches[p], stages, context(0));
  }
  ByHand(const ByHand&) = delete;

  StepContext<Dim> context(Index step) const {
    const double dt = model.analysis.step.dt;
    return {&model, &patches.partition(), step, static_cast<double>(step) * dt, dt};
  }

  void step() {
    for (const Phase& phase : phases) {
      std::vector<int> active;
      for (int p = 0; p < patches.size(); ++p)
        if (phase.first == 0 || !patches[p].idle) active.push_back(p);
      for (std::size_t s = phase.first; s < phase.last; ++s) {
        for (const int p : active)
          run_phase(patches[p], stages, s, s + 1, context(steps), context(steps + 1),
                    [](std::size_t) {});
        after(stages[s].stage.name, steps);
      }
    }
    ++steps;
  }
};

}  // namespace lahar::test
