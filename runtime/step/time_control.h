/// \file How long the steps of a run are, and which is the last one.
#pragma once

#include <algorithm>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "physics/model/model.h"
#include "runtime/exchange/per_step.h"

namespace lahar {

/// When particles of a generator come in, and the limit of the time step that they have then.
struct InjectionLimit {
  double start, end, limit;  ///< [s]
};

/// The time of a run. Limits are what particles allow: the smallest of all patches and ranks. Those
/// of implicit steps are lengths that LoadSteps finds.
class TimeControl {
 public:
  /// A particle in words, asked for only when a run is refused.
  using Describe = std::function<std::string()>;

  TimeControl(const Analysis& analysis, const OutputPlan& output,
              std::vector<InjectionLimit> injections);

  /// Steps are taken from the start. Throws InputError where a fixed step is above the limit, or an
  /// adaptive one would be nothing. Returns the adaptive step before output shortens it.
  double begin(double limit, const Describe& limiting);
  /// Steps are taken from `step` on, at `time`, after one of `last_dt`. An adaptive step is still
  /// to be planned where one is left. Throws InputError where the run has ended before.
  void resume(Step step, double time, double last_dt, double limit);

  struct Planned {
    double stable;  ///< [s] of the step before output shortens it
    bool limited;   ///< by particles
    bool last;      ///< the step is the last one
  };
  /// dt of an adaptive step and, with it, the time at which the next one begins: shortened so that
  /// steps end at times of output and at the end.
  Planned plan(Step step, double limit);
  /// The same of an implicit step of `dt`, whose limit is set, and again where that is cut.
  void set_dt(Step step, double dt);
  /// Adaptive steps that begin before `time` [s] are not longer than `dt` [s].
  void shorten_until(double time, double dt) {
    shorter_until_ = time;
    shorter_dt_ = dt;
  }
  /// The run ends with the steps that are done.
  void end_at(Step done) { nsteps_ = std::min<Index>(nsteps_, done); }
  /// No particle is on its way: the limit of the step that is next.
  void set_limit(Step step, double limit) { limit_[step] = limit; }

  bool is_adaptive() const { return step_.adaptive; }
  Index nsteps() const { return nsteps_; }  ///< that the run has at its end, as far as known
  /// That it may have: a step that was to be the last one may be cut.
  Index most_nsteps() const { return most_nsteps_; }
  double end_time() const { return end_time_; }
  /// The steps that `dt` makes of the run, as far as known.
  double steps_of(double dt) const;
  double time_at(Step step) const {
    return step_.adaptive ? start_time_[step] : static_cast<double>(step) * step_.dt;
  }
  double dt_of(Step step) const { return step_.adaptive ? dt_[step] : step_.dt; }
  double last_dt(Step at) const { return at > 0 ? dt_of(at - 1) : 0.0; }
  /// From which dt is taken; infinite for fixed steps.
  double limit_of(Step step) const {
    return step_.adaptive ? limit_[step] : std::numeric_limits<double>::infinity();
  }

 private:
  void check_fixed(double limit, const Describe& limiting) const;
  double adaptive_dt(double limit) const;
  double limit_with_injections(Step step, double limit) const;
  bool place(Step step, double stable);
  void limit_steps_by_time();

  TimeStep step_;
  double end_time_, frame_dt_, history_dt_, gauge_dt_;
  double shorter_until_ = 0, shorter_dt_ = 0;
  Index most_nsteps_, nsteps_;
  std::vector<InjectionLimit> injections_;
  PerStep<double> dt_, start_time_, limit_;
};

}  // namespace lahar
