/// \file Steps made by hand, phase by phase and patch by patch, so that tests can look between.
#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "physics/kernels/kernels.h"
#include "runtime/patches/patch_set.h"
#include "runtime/step/snapshot.h"
#include "runtime/step/timestep.h"
#include "tests/runtime/step/models.h"

namespace lahar::test {

/// Patches that all do one phase before any does the next. Patches are not created or dropped; time
/// steps are fixed.
template <int Dim>
struct ByHand {
  Model<Dim> model;
  PatchSet<Dim> patches;
  std::vector<TimestepStage<Dim>> stages;
  std::vector<Phase> phases;
  Index steps = 0;
  Local chunk = chunk_slots;
  /// Called after all patches that are not idle, `active`, have done a phase of a step.
  std::function<void(const Phase& phase, const std::vector<int>& active)> after =
      [](const auto&, const auto&) {};

  /// `cut`: phases end where they give the time step, as on several ranks.
  explicit ByHand(Model<Dim> model_in, int rings = 0, bool cut = false)
      : model(std::move(model_in)),
        patches(model, rings, node_sum_copies(model.analysis)),
        stages(timestep<Dim>(model.analysis)) {
    std::vector<Stage> list;
    for (const auto& stage : stages) list.push_back(stage.stage);
    phases = phases_of(list, cut);
    for (int p = 0; p < patches.size(); ++p) receive(patches[p]);
    for (int p = 0; p < patches.size(); ++p) map_first(patches[p], stages, context(0));
  }
  ByHand(const ByHand&) = delete;

  StepContext<Dim> context(Index step) const {
    const double dt = model.analysis.step.dt;
    return {&model, &patches.partition(), step, static_cast<double>(step) * dt, dt};
  }

  /// A task: one phase of one patch, of any step.
  void task(const Phase& phase, int p, Index step) {
    if (phase.first > 0 && patches[p].idle) return;
    run_phase(
        patches[p], stages, phase, context(step), context(step + 1), [](std::size_t) {}, chunk);
  }

  void step() {
    for (const Phase& phase : phases) {
      std::vector<int> active;
      for (int p = 0; p < patches.size(); ++p)
        if (phase.first == 0 || !patches[p].idle) active.push_back(p);
      for (const int p : active) task(phase, p, steps);
      after(phase, active);
    }
    ++steps;
  }

  /// All particles, as a frame after `steps` shows them; those on their way included.
  Frame frame() const {
    FramePieces all{frame_header<Dim>(patches.layout(), model), {}};
    all.header.step = steps;
    all.header.time = static_cast<double>(steps) * model.analysis.step.dt;
    for (int p = 0; p < patches.size(); ++p) all.pieces.push_back(snapshot(patches[p], model));
    return join(all);
  }
};

}  // namespace lahar::test
