/// \file The watchdog in a run: what it looks at, when it warns, and the step with which it ends.
#pragma once

#include <array>
#include <atomic>
#include <functional>
#include <string>
#include <vector>

#include "runtime/exchange/per_step.h"
#include "runtime/patches/patch_set.h"
#include "runtime/step/watchdog.h"

namespace lahar {

template <int Dim>
class RunWatch {
 public:
  using Warn = std::function<void(const std::string&)>;

  /// For a model that still has its particles, and the patches that will have them; both must
  /// outlive it. `warn` is called while steps are taken. Collective.
  RunWatch(const Model<Dim>& model, const PatchSet<Dim>& patches, Communicator ranks, Warn warn)
      : model_(model),
        patches_(patches),
        ranks_(ranks),
        judge_(model.watchdog, speed_scales(model, ranks)),
        warn_(std::move(warn)) {}

  /// With the row of the start. Collective.
  void begin(const HistoryRow& start);
  void resume(const WatchdogState& state);
  const WatchdogState& state() const { return judge_.state; }
  /// What WatchdogJudge::energy_scale() returns. It is 0 without a watchdog.
  double energy_scale(double mass) const { return judge_.on() ? judge_.energy_scale(mass) : 0.0; }

  /// Whether sums and volumes are looked at after a step.
  bool due(Step step) const { return judge_.on() && (step + 1) % watch_steps == 0; }
  /// By the task of a patch that has done a step for which this is due.
  void look_at(const Patch<Dim>& patch, Step step) {
    if (is_strained(patch, model_)) strained_[step] = true;
  }
  /// Whether a patch of this rank has a particle beyond its bounds.
  bool take_strained(Step step) { return strained_[step].exchange(false); }
  /// The sums after a step are known, on all ranks. True: the run ends max_lead steps later.
  bool judge(Step step, const HistoryRow& row, double kinetic_at_start, bool strained);
  /// An adaptive step that begins at `time`, before output shortened it. True: the run ends with
  /// it.
  bool judge_step(Step step, double time, double stable);
  /// What judge_step() found, by a thread that may warn.
  void warn_of_step() {
    if (step_alarm_is_new_.exchange(false)) warn_once(step_alarm_);
  }

  /// The step with which the run ends, if that is after `done`; else `end`.
  Step end_step(Step done, Step end) const;
  /// At rest after `done` of `nsteps`: end the run where an alarm says so, with a message that is
  /// the same for any ranks. Collective.
  void throw_alarm(Step done, Step nsteps) const;

 private:
  void warn_once(const WatchdogAlarm& alarm);
  /// Of free rigid bodies that have left the mesh, once each.
  void warn_of_lost_bodies(const HistoryRow& row);
  std::string worst_particle(WatchdogAlarm::Kind kind) const;

  const Model<Dim>& model_;
  const PatchSet<Dim>& patches_;
  Communicator ranks_;
  WatchdogJudge judge_;
  Warn warn_;
  WatchdogAlarm step_alarm_;  ///< of the time step; its step is -1 where there is none
  Step step_alarm_end_ = -1;  ///< at which it ends the run; -1 = it does not
  std::atomic<bool> step_alarm_is_new_{false};
  std::array<bool, 4> warned_{};         ///< by WatchdogAlarm::Kind
  std::vector<bool> lost_;               ///< rigid bodies that warn_of_lost_bodies() told of
  PerStep<std::atomic<bool>> strained_;  ///< by step: a patch of this rank has such a particle
};

}  // namespace lahar
