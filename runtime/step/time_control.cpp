#include "runtime/step/time_control.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "physics/base/error.h"
#include "runtime/exchange/failure.h"
#include "runtime/step/output_times.h"

namespace lahar {

namespace {

/// An end time that is missed by this share of a step is reached: sums of steps are rounded.
constexpr double rounding_of_time = 1e-9;

/// The largest analysis.nsteps.
constexpr double most_steps = 9e15;

constexpr double no_time = std::numeric_limits<double>::infinity();  ///< [s] before an event

}  // namespace

TimeControl::TimeControl(const Analysis& analysis, const OutputPlan& output,
                         std::vector<InjectionLimit> injections)
    : step_(analysis.step),
      end_time_(analysis.end_time),
      frame_dt_(output.frame_dt),
      history_dt_(output.history_dt),
      gauge_dt_(output.measured.any() ? output.measured.dt : 0.0),
      most_nsteps_(analysis.nsteps),
      nsteps_(analysis.nsteps),
      injections_(std::move(injections)) {}

double TimeControl::begin(double limit, const Describe& limiting) {
  start_time_[0] = 0.0;
  if (!step_.adaptive) {
    check_fixed(limit, limiting);
    limit_steps_by_time();
    return step_.dt;
  }
  limit_[0] = limit;
  const double stable = adaptive_dt(limit_with_injections(0, limit));
  if (stable < std::numeric_limits<double>::min())  // time would stand still
    throw InputError(
        {Problem{.where = "/analysis",
                 .message = fmt::format("the adaptive time step would be {:.3g} s: see {}", stable,
                                        limiting()),
                 .hint = "check speeds, stiffnesses and densities; units are m, kg, s, Pa"}});
  if (place(0, stable)) nsteps_ = std::min<Index>(nsteps_, 1);
  return stable;
}

void TimeControl::resume(Step step, double time, double last_dt, double limit) {
  start_time_[step] = time;
  limit_[step] = limit;
  if (!step_.adaptive) {
    limit_steps_by_time();
  } else {
    if (step > 0) dt_[step - 1] = last_dt;
    const double left = end_time_ - time, rounding = last_dt * rounding_of_time;
    if (left < -rounding)
      throw InputError(
          {Problem{.where = "/analysis/end_time",
                   .message = fmt::format("the run ends at {:.6g} s, but is to go on from {:.6g} s",
                                          end_time_, time),
                   .hint = "raise end_time, or go on from an earlier checkpoint"}});
    if (left <= rounding) nsteps_ = std::min(nsteps_, step);
  }
  if (step > nsteps_)
    throw InputError(
        {Problem{.where = "/analysis/nsteps",
                 .message = fmt::format("the run ends with step {}, but is to go on from step {}",
                                        nsteps_, step),
                 .hint = "raise nsteps, or go on from an earlier checkpoint"}});
}

TimeControl::Planned TimeControl::plan(Step step, double limit) {
  limit_[step] = limit;
  limit = limit_with_injections(step, limit);
  // Without particles there is no limit: go on as before, or from output to output.
  const bool by_time = frame_dt_ > 0 || history_dt_ > 0 || gauge_dt_ > 0;
  const bool limited = std::isfinite(limit) || step == 0;
  const double stable = limited || by_time ? adaptive_dt(limit) : dt_[step - 1];
  const bool last = place(step, stable);
  if (last) nsteps_ = step + 1;
  return {stable, limited, last};
}

void TimeControl::set_dt(Step step, double dt) {
  dt = std::min(dt, step_.dt);
  const double left = end_time_ - start_time_[step];
  if (dt * (1 + rounding_of_time) < left && left < 2 * dt) dt = 0.5 * left;  // no tiny last step
  nsteps_ = place(step, dt) ? step + 1 : most_nsteps_;
}

double TimeControl::steps_of(double dt) const {
  return std::min(static_cast<double>(nsteps_), end_time_ / dt);
}

void TimeControl::check_fixed(double limit, const Describe& limiting) const {
  if (step_.accept_unstable) return;
  const auto refuse = [&](double least, const std::string& where) {
    throw InputError({Problem{.where = "/analysis/dt",
                              .message = unstable_message(step_.dt, least, where),
                              .hint = unstable_hint(least)}});
  };
  if (step_.dt > limit) refuse(limit, limiting());
  for (const InjectionLimit& injected : injections_)
    if (step_.dt > injected.limit) refuse(injected.limit, "particles that are injected");
}

double TimeControl::adaptive_dt(double limit) const {
  return std::min(step_.safety * limit, step_.dt);
}

/// The limit that particles have which may come in at the beginning of a step; where nothing else
/// limits it, of those that come later, too.
double TimeControl::limit_with_injections(Step step, double limit) const {
  const double time = time_at(step);
  double any = no_time;
  for (const InjectionLimit& one : injections_) {
    if (one.start <= time && time < one.end) limit = std::min(limit, one.limit);
    if (time < one.end) any = std::min(any, one.limit);
  }
  return std::isfinite(limit) ? limit : any;
}

/// Put a step of the length that is stable, or shorter, where output and the end want it. True: it
/// is the last.
bool TimeControl::place(Step step, double stable) {
  const double now = start_time_[step];
  if (now < shorter_until_) stable = std::min(stable, shorter_dt_);
  double target = no_time;
  for (const double interval : {frame_dt_, history_dt_, gauge_dt_})
    if (interval > 0) target = std::min(target, next_multiple(now, interval));
  const auto reached = [&](double time) { return time - now <= stable * (1 + rounding_of_time); };
  const bool last = reached(end_time_) && end_time_ <= target * (1 + rounding_of_time);
  dt_[step] = stable;
  start_time_[step + 1] = now + stable;
  if (last || reached(target)) {
    start_time_[step + 1] = last ? end_time_ : target;
    dt_[step] = start_time_[step + 1] - now;
  } else if (target < end_time_ && target - now < 2 * stable) {  // two equal ones, and no tiny one
    dt_[step] = 0.5 * (target - now);
    start_time_[step + 1] = now + dt_[step];
  }
  return last;
}

/// With a fixed step, the end time is a number of steps.
void TimeControl::limit_steps_by_time() {
  if (!std::isfinite(end_time_)) return;
  const double steps = std::ceil(end_time_ / step_.dt * (1 - rounding_of_time));
  nsteps_ = std::min(nsteps_, static_cast<Index>(std::min(steps, most_steps)));
}

}  // namespace lahar
