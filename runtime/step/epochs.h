/// \file Changes of the set of patches, and when the graph drains for them.
#pragma once

#include <atomic>
#include <functional>
#include <optional>
#include <vector>

#include "runtime/comm/rank_agreements.h"
#include "runtime/exchange/per_step.h"
#include "runtime/patches/rank_balance.h"

namespace lahar {

/// Tasks find out that patches are missing, crowded or uneven among ranks. All ranks hear of it in
/// the agreement of the step, and change their patches when the graph has drained.
template <int Dim>
class Epochs {
 public:
  /// Collective. `patches` must outlive it.
  Epochs(PatchSet<Dim>& patches, const Analysis& analysis, Communicator ranks,
         const BalanceOptions& options, int threads);

  RankBalance<Dim>& balance() { return balance_; }
  const RankBalance<Dim>& balance() const { return balance_; }
  Step split_step() const { return split_step_; }
  void resume(Step split_step) { split_step_ = split_step; }

  /// Steps are taken from now on.
  void begin() { rebuild_ = false; }
  /// By the task of a patch around which patches are missing.
  void need_surroundings() { rebuild_.store(true, std::memory_order_relaxed); }
  /// By the task of a patch that has done `step`.
  void look_at(const Patch<Dim>& patch, Step step);
  /// What this rank knows of a step that its patches have done. Nothing may be added to
  /// Agreement::sum after it.
  void give(Step step, Agreement& own);
  /// What all ranks know. True: the graph drains max_lead steps later.
  bool take(Step step, const Agreement& all);
  /// Where the graph has to drain: at `end`, or before.
  Step drain_step(Step done, Step end) const;

  /// At rest after `step`: split what was found crowded max_lead steps ago. Returns the ids of
  /// patches that are parts, whose particles are still to be mapped. Collective.
  std::optional<std::vector<Index>> split(Step step);
  /// At rest: create missing patches. True if the set of patches has changed. Collective.
  bool rebuild();
  /// At rest: give patches to other ranks where that pays, and call `changed` if any was.
  /// Collective.
  void remap(Step step, Step nsteps, const std::function<void()>& changed);

 private:
  PatchSet<Dim>& patches_;
  Index split_steps_;         ///< steps between looks for crowded patches; 0 = never
  Index most_particles_;      ///< up to which a patch is not split
  std::size_t most_removed_;  ///< particles that may wait in a patch
  Communicator ranks_;
  RankBalance<Dim> balance_;
  std::atomic<bool> rebuild_{false};
  PerStep<std::atomic<bool>> crowded_;  ///< a patch of this rank is to be split
  PerStep<std::atomic<bool>> full_;     ///< a patch has a long list of removed particles
  /// Patches are split when so many steps are done; -1 = none. This follows from what was found
  /// max_lead steps before: the step is the same for any ranks and threads, whatever else makes the
  /// graph drain.
  Step split_step_ = -1;
  bool remap_ = false;
};

}  // namespace lahar
