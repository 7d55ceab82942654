#include "runtime/step/output_schedule.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "runtime/step/output_times.h"

namespace lahar {

namespace {

constexpr Step never = std::numeric_limits<Step>::max();

}  // namespace

void OutputSchedule::begin(double dt, Index before) {
  if (plan_.history_dt > 0)
    history_steps_ = 0;
  else if (plan_.history_steps > 0)
    history_steps_ = plan_.history_steps;
  else if (before > 0)
    history_steps_ = before;
  else
    history_steps_ = std::max<Index>(1, static_cast<Index>(time_.steps_of(dt) / 100));
}

bool OutputSchedule::history_due(Step step) const {
  return (history_steps_ > 0 && (step + 1) % history_steps_ == 0) ||
         (plan_.history_dt > 0 && reaches(step, plan_.history_dt));
}

bool OutputSchedule::gauges_due(Step step) const {
  const GaugePlan& plan = plan_.measured;
  if (plan.dt > 0) return reaches(step, plan.dt);
  return plan.steps > 0 ? (step + 1) % plan.steps == 0 : history_due(step);
}

std::string OutputSchedule::no_more_frames(Step step) const {
  return fmt::format(
      "step {} (t = {:.6g} s): no more frames are written but the last one; "
      "post_processing.max_frames is the largest number of them.",
      step + 1, time_.time_at(step + 1));
}

Step OutputSchedule::next_frame(Step step) const {
  const Index every = plan_.frame_steps;
  return std::min(every > 0 ? (step / every + 1) * every : never,
                  plan_.frame_dt > 0 ? next_frame_by_time(step) : never);
}

/// Whether a multiple of `interval` [s] comes in a step.
bool OutputSchedule::reaches(Step step, double interval) const {
  return multiples_by(time_.time_at(step + 1), interval) >
         multiples_by(time_.time_at(step), interval);
}

/// A frame is planned after this step, whether there may be so many or not.
bool OutputSchedule::frame_planned(Step step) const {
  return (plan_.frame_steps > 0 && (step + 1) % plan_.frame_steps == 0) ||
         (plan_.frame_dt > 0 && reaches(step, plan_.frame_dt));
}

/// Frames that are planned up to the end of a step, but for the one of the beginning.
Index OutputSchedule::frames_by(Step step) const {
  const auto by = [&](Step at) {
    return plan_.frame_dt > 0 ? multiples_by(time_.time_at(at), plan_.frame_dt)
                              : at / plan_.frame_steps;
  };
  return by(step + 1) - (first_step_ > 0 ? by(first_step_) : 0);
}

Step OutputSchedule::next_frame_by_time(Step step) const {
  if (time_.is_adaptive()) return frame_due(step) ? step + 1 : never;  // a later one is seen then
  const double interval = plan_.frame_dt, now = time_.time_at(step);
  const double steps = next_multiple(now, interval) / time_.dt_of(step);
  if (steps > 1e18) return never;
  Step at = std::max(step + 1, static_cast<Step>(steps) - 1);
  while (at < time_.nsteps() &&
         multiples_by(time_.time_at(at), interval) == multiples_by(now, interval))
    ++at;
  return at;
}

}  // namespace lahar
