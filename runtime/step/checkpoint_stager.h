/// \file States for checkpoints. Tasks copy those of their patches while steps are taken: at the
/// beginning of a step, when a patch's particles have come and nothing else of the step is done, a
/// patch is as it would be if the graph had drained. What cannot be copied so is taken from a
/// drained graph.
#pragma once

#include <atomic>
#include <cstddef>
#include <vector>

#include "runtime/exchange/per_step.h"
#include "runtime/patches/patch_set.h"
#include "runtime/step/injection_log.h"

namespace lahar {

/// `at` is a number of steps that are done.
template <int Dim>
class CheckpointStager {
 public:
  /// A state is due every so many steps; 0 = only on request. `patches` must outlive it.
  CheckpointStager(const PatchSet<Dim>& patches, Index every) : patches_(patches), every_(every) {}

  /// [bytes] of the states of this rank's patches.
  std::size_t bytes() const;
  /// The state at rest, without a copy: good until steps are taken. `removed`: particles, of all
  /// ranks. Collective.
  SimulationState present(RunState run, Index removed, const Communicator& ranks) const;

  /// Steps are taken from `step` on, and tasks copy states if `copies`. Collective.
  void begin(Step step, bool copies, Index removed, const Communicator& ranks);
  void add_particles(Index n) { particles_ += n; }  ///< they came in, on all ranks

  bool due(Step at) const { return at == requested_ || (every_ > 0 && at % every_ == 0); }
  bool copies() const { return copies_; }
  /// Whether tasks copy their patches then. (At rest, what is due is not copied by tasks.)
  bool copies(Step at) const { return copies_ && at > begun_ && due(at); }
  /// By the task of a patch.
  void copy(int patch, Step at);
  /// The numbers of the state that is copied next.
  void set_run(RunState run);
  /// What all patches have copied. The log says which ids particles have in files.
  SimulationState take(Step at, double dt_limit, std::vector<RigidBodyState> bodies,
                       const InjectionLog& log);

  /// By any thread: a state is wanted soon.
  void ask() { asked_ = true; }
  bool is_asked() const { return asked_; }
  /// All ranks hear after `step` that a state was asked for. True: it is due max_lead steps later.
  bool plan(Step step);
  bool is_planned_after(Step at) const { return requested_ > at; }
  void is_written(Step at);
  void is_written_at_rest(Step at) {
    requested_ = -1;
    is_written(at);
  }
  /// Where the graph has to drain: at `end`, or before it at a state that is not copied.
  Step drain_step(Step done, Step end) const;

 private:
  const PatchSet<Dim>& patches_;
  Index every_;
  bool copies_ = false;
  Step begun_ = 0;
  RunState run_;                                         ///< of the state that is being copied
  Index particles_ = 0, removed_ = 0;                    ///< of all ranks, where tasks copy states
  PerStep<std::vector<std::vector<std::byte>>> copied_;  ///< by patch
  std::atomic<bool> asked_{false};                       ///< of this rank
  /// The state after so many steps was asked for, as all ranks know; -1 = none. Steps that end
  /// earlier than `next_request_` do not ask for another.
  std::atomic<Step> requested_{-1};
  Step next_request_ = 0;
};

}  // namespace lahar
