/// \file Stages that patches do again and again until all have found what they look for: an
/// iteration of a solver is a round.
///
/// A round is executed as a step is: its phases are tasks of a graph, a phase with an exchange
/// waits for neighbours alone, and patches far apart may be in different rounds. What all patches
/// have to know of a round together are a few sums. They are reduced while the next round goes on,
/// up to the stage that needs them (Stage::needs_dt; the one that gives them has Stage::gives_dt).
/// Sums are exact, so that they have the same bits on any threads and ranks.
///
/// Where a round has one exchange, a step of the graph has two rounds (TaskGraph::rounds), and node
/// sums that it exchanges have two copies (NodeSumCopies): neighbours may still read those of the
/// round before.
#pragma once

#include <array>
#include <atomic>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "graph/executor.h"
#include "graph/stage_loop.h"
#include "runtime/base/stage_clock.h"
#include "runtime/exchange/atomic_least.h"
#include "runtime/exchange/exact_sum.h"
#include "runtime/exchange/per_step.h"
#include "runtime/exchange/rank_exchange.h"
#include "runtime/exchange/run_failures.h"
#include "runtime/exchange/timestep_stage.h"
#include "runtime/trace/record/recorder.h"

namespace lahar {

/// Sums of a round, at most.
inline constexpr int most_sums = 8;

/// What rounds ask of whoever runs them.
template <int Dim>
struct RoundCalls {
  /// What stages may read in a round; StepContext::step is its number. Any thread.
  std::function<StepContext<Dim>(Step round)> context;
  /// The terms of a patch, which are zero before: after the phase of the stage that gives. Any
  /// thread, patches at once.
  std::function<void(int patch, Step round, std::span<double> own)> give = {};
  /// Integers that are added over all ranks as well, as many on each, and perhaps others in other
  /// rounds: after give() of all patches of this rank; and their sums, before take().
  std::function<std::span<const Index>()> give_integers = {};
  std::function<void(std::span<const Index> sums)> take_integers = {};
  /// The sums of all patches of all ranks: once for each round that is taken, in order, before the
  /// stage of the next round that needs them; those of the last round at the end. False: no round
  /// is taken after the one that may have begun. Must decide alike on all ranks, from the sums;
  /// they are not numbers where a patch failed.
  std::function<bool(Step round, std::span<const double> sums)> take = {};
};

/// How rounds are executed; the same on all ranks.
struct RoundOptions {
  ExecutorOptions executor = {};
  int sums = 0;  ///< per round; needs a stage that gives and one that needs them
  /// Several ranks: for messages of these rounds alone.
  const ExchangeGroups* groups = nullptr;
  double latency = 0;  ///< [s] held back from each message between ranks, for studies
  bool shared_memory = true;
  std::function<void()> others = {};  ///< ExchangeCalls::others
  std::string name = {}, taken = {};  ///< as of StageLoop
  int loop = -1;                      ///< its number in traces, from 1 on; -1 = not recorded

  /// The same with other sums and groups.
  RoundOptions with(int of_sums, const ExchangeGroups* of_groups) const {
    RoundOptions changed = *this;
    changed.sums = of_sums;
    changed.groups = of_groups;
    return changed;
  }
  /// The same as a loop of traces and pictures.
  RoundOptions named(int as_loop, const char* as_name, const char* as_taken) const {
    RoundOptions changed = *this;
    changed.loop = as_loop;
    changed.name = as_name;
    changed.taken = as_taken;
    return changed;
  }
};

/// For the patches as they are linked now. Messages between ranks are those of
/// PatchSet::sum_messages(), which must know the stages (message_of_sums()). With several ranks,
/// functions are collective.
template <int Dim>
class Rounds {
 public:
  Rounds(PatchSet<Dim>& patches, std::vector<TimestepStage<Dim>> stages, RoundOptions options,
         RoundCalls<Dim> calls);
  Rounds(const Rounds&) = delete;
  Rounds& operator=(const Rounds&) = delete;
  ~Rounds();

  /// Take rounds until RoundCalls::take ends them, `most` at most. Returns how many were taken.
  /// Numbers of rounds go on from call to call and may leave one out. Where a stage throws or
  /// records a fault, all ranks stop together, and all throw SimulationError with what failed
  /// first; nothing may be run after that.
  Step run(Step most);
  /// The number of the first round of the next run().
  Step next_round() const { return next_step_ * graph().rounds; }
  const TaskGraph& graph() const { return executor_->graph(); }
  /// [s] that this rank's tasks have spent in a stage so far; between calls of run().
  double stage_seconds(std::size_t stage) const;
  StageLoop loop() const { return {options_.name, options_.taken, stages_of(stages_), phases_}; }

 private:
  void connect_ranks(int rounds);
  int phases() const { return static_cast<int>(phases_.size()); }
  Step rounds() const { return executor_->graph().rounds; }
  void run_task(int task_stage, int p, Step step);
  /// The task of a patch of another rank, whose message has come.
  void take_message(int task_stage, int p, Step round);
  void run_own_task(const Phase& phase, int p, Step round, StageClock& clock);
  /// Whether this is recorded: null = it is not.
  TraceRecorder* recorder() const {
    return options_.loop < 0 ? nullptr : TraceRecorder::of_present();
  }
  TraceRecord begun(const TraceRecorder& recorder, int task_stage, int p, Step round) const;
  void fail(std::size_t stage, int p, Step round, const std::string& cause);
  std::span<double> terms(int p);
  /// Those of this rank's patches.
  std::span<const Index> sum_up();
  void take_sums(std::span<const Index> elements);
  /// The sums of a round are there: end after the next one, or not.
  void decide(Step round);

  PatchSet<Dim>& patches_;
  std::vector<TimestepStage<Dim>> stages_;
  RoundOptions options_;
  RoundCalls<Dim> calls_;
  Communicator ranks_;  ///< alone where there are no groups
  std::vector<Phase> phases_;
  int giving_phase_ = -1;       ///< after which terms are given; -1 = none
  bool prepares_next_ = false;  ///< some stage is done for the round after
  RunFailures failures_{"round"};
  AtomicLeast stop_before_;  ///< a step of the graph that is not taken any more
  std::vector<std::array<double, most_sums>> terms_;  ///< of a round, by patch
  std::vector<std::vector<StageTicks>> stage_ticks_;  ///< by patch and stage
  std::vector<Index> elements_;                       ///< of this rank's sums, and its integers
  std::vector<double> sums_;                          ///< of all ranks
  PerStep<Agreement> agreed_;
  std::unique_ptr<RankExchange<Dim>> exchange_;  ///< several ranks only
  std::unique_ptr<Executor> executor_;
  std::atomic<Step> last_round_{0};  ///< that is taken, as far as is known
  Step next_step_ = 0;               ///< of the graph
};

extern template class Rounds<2>;
extern template class Rounds<3>;

}  // namespace lahar
