/// \file Stages as functions over a patch, the phases that they are done in, and the messages that
/// phases need.
#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "graph/stage.h"
#include "physics/particles/patch.h"
#include "runtime/patches/sum_message.h"

namespace lahar {

/// A stage and what it does to a patch, called in this order. Any of the three may be null; the
/// stage without any is the driver's own.
template <int Dim>
struct TimestepStage {
  using OnPatch = void (*)(Patch<Dim>& patch, const StepContext<Dim>& step);
  using OnBins = void (*)(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins);

  Stage stage;
  std::vector<NodeSum> takes = {};  ///< sums of neighbours, where it exchanges them
  OnPatch begin = nullptr;          ///< before any bin of the phase: nodes
  OnBins bins = nullptr;            ///< particles, a few bins at a time
  OnPatch end = nullptr;            ///< after all bins of the phase
  bool of_next_step = false;        ///< is done for the step after the one in which it is called
};

/// The stages as graphs know them.
template <int Dim>
std::vector<Stage> stages_of(const std::vector<TimestepStage<Dim>>& list) {
  std::vector<Stage> stages;
  for (const auto& stage : list) stages.push_back(stage.stage);
  return stages;
}

/// What patches of other ranks need of a phase when it is done: what the phase after it exchanges.
struct RankMessage {
  enum class Kind { none, sums, particles } kind = Kind::none;
  /// For messages with sums, in the order of a step. Those that bring the same kind of sum again
  /// have one number: a patch sends it again only after it has been used.
  int number = 0;
  std::vector<std::size_t> sum_arrays = {};  ///< those that hold the sums
};
/// One for each phase of a list of stages; `sums` are those of message_of_sums().
template <int Dim>
std::vector<RankMessage> rank_messages(const std::vector<TimestepStage<Dim>>& stages,
                                       const std::vector<Phase>& phases, const SumMessages& sums);
/// The message that brings each kind of sum; that of number 0 for those that no stage exchanges.
/// Where patches have several lists of stages, `stages` are all of them: each kind of sum has one
/// message, whatever list it belongs to. Throws std::logic_error where that cannot be.
template <int Dim>
SumMessages message_of_sums(const std::vector<TimestepStage<Dim>>& stages);

/// Slots that a phase takes at a time. Their columns, some 50 KiB in 3D, stay in second-level cache
/// from the first stage of the phase to the last; with fewer, calls and readings of the clock cost
/// more, and with more nothing was gained (128: 5 % slower, 512: the same).
inline constexpr Local chunk_slots = 256;

/// Do the stages of one phase on a patch: whatever they do to nodes first, then all of them on one
/// chunk of bins after the other. `next` is the context of the step after. Calls `lap(stage)` after
/// each piece of work, with a stage of the phase. Stops at the stage that recorded a fault, when it
/// is through with the patch, and returns it; else the number of stages. Neither the size of a
/// chunk nor whether a phase and its rest are done as one changes any particle's bits.
template <int Dim, class Lap>
std::size_t run_phase(Patch<Dim>& patch, const std::vector<TimestepStage<Dim>>& stages,
                      const Phase& phase, const StepContext<Dim>& step,
                      const StepContext<Dim>& next, Lap lap, Local chunk = chunk_slots) {
  const std::size_t first = phase.first, last = phase.last;
  std::size_t failed = stages.size();
  const auto act = [&](std::size_t s, auto what) {
    if (s > failed) return;
    what(stages[s], stages[s].of_next_step ? next : step);
    lap(std::clamp(s, first, last - 1));
    if (patch.fault.kind != ParticleFault::Kind::none && failed == stages.size()) failed = s;
  };
  for (std::size_t s = first; s < phase.begins; ++s)
    if (stages[s].begin)
      act(s, [&](const auto& stage, const auto& context) { stage.begin(patch, context); });
  const ParticleBins all(patch.bins);
  for (std::size_t from = 0; from < all.size();) {
    std::size_t to = from;
    Local slots = 0;
    while (to < all.size() && slots < chunk) slots += all[to].end - all[to].begin, ++to;
    const ParticleBins bins = all.subspan(from, to - from);
    for (std::size_t s = first; s < last; ++s)
      if (stages[s].bins)
        act(s, [&](const auto& stage, const auto& context) { stage.bins(patch, context, bins); });
    from = to;
  }
  for (std::size_t s = phase.ends; s < last; ++s)
    if (stages[s].end)
      act(s, [&](const auto& stage, const auto& context) { stage.end(patch, context); });
  return failed;
}

/// Map all particles of a patch for the first step.
template <int Dim>
void map_first(Patch<Dim>& patch, const std::vector<TimestepStage<Dim>>& stages,
               const StepContext<Dim>& step);

}  // namespace lahar
