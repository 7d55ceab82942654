#include <fmt/format.h>

#include <algorithm>

#include "physics/base/error.h"
#include "physics/kernels/kernels.h"
#include "runtime/step/simulation_driver.h"

namespace lahar {

namespace {

/// An end time that is missed by this share of a step is reached: sums of steps are rounded.
constexpr double rounding_of_time = 1e-9;

/// The largest analysis.nsteps.
constexpr double most_steps = 9e15;

}  // namespace

template <int Dim>
void SimulationDriver<Dim>::restore_dt(double last_dt) {
  if (step > 0) dt[step - 1] = last_dt;
  const double left = model.analysis.end_time - start_time[step],
               rounding = last_dt * rounding_of_time;
  if (left < -rounding)
    throw InputError(
        {Problem{.where = "/analysis/end_time",
                 .message = fmt::format("the run ends at {:.6g} s, but is to go on from {:.6g} s",
                                        model.analysis.end_time, start_time[step]),
                 .hint = "raise end_time, or go on from an earlier checkpoint"}});
  if (left <= rounding) nsteps = std::min(nsteps, step);
  if (step < nsteps) set_dt(step, last_limit);
}

template <int Dim>
double SimulationDriver<Dim>::present_limit(std::string* where) const {
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < patches.size(); ++i) {
    Local p = -1;
    const double limit =
        time_step_limit<Dim>(patches[i], model, patches[i].bins, where ? &p : nullptr);
    if (limit < least && p >= 0) *where = describe_particle(patches[i].particles, p);
    least = std::min(least, limit);
  }
  const double of_all = ranks.min(least);
  if (where && ranks.several()) of_one_rank(least == of_all, *where);
  return of_all;
}

template <int Dim>
double SimulationDriver<Dim>::limit_with_injections(Step step, double limit) const {
  double any = std::numeric_limits<double>::infinity();
  for (std::size_t g = 0; g < injection_limits.size(); ++g) {
    const auto& injection = model.injections[g];
    if (injection.active(time_at(step))) limit = std::min(limit, injection_limits[g]);
    if (time_at(step) < injection.end) any = std::min(any, injection_limits[g]);
  }
  return std::isfinite(limit) ? limit : any;
}

template <int Dim>
void SimulationDriver<Dim>::check_first_dt(double limit) const {
  const TimeStep& plan = model.analysis.step;
  if (plan.accept_unstable) return;
  const auto refuse = [&](double least, const std::string& where) {
    throw InputError({Problem{.where = "/analysis/dt",
                              .message = unstable_message(plan.dt, least, where),
                              .hint = unstable_hint(least)}});
  };
  if (plan.dt > limit) {
    std::string where;  // looked for only now: that takes longer than the limit itself
    present_limit(&where);
    refuse(limit, where);
  }
  for (const double injected : injection_limits)
    if (plan.dt > injected) refuse(injected, "particles that are injected");
}

template <int Dim>
void SimulationDriver<Dim>::set_first_dt() {
  const TimeStep& plan = model.analysis.step;
  double limit = present_limit();
  if (plan.adaptive) {
    last_limit = limit;
    limit = limit_with_injections(0, limit);
  }
  start_time[0] = 0.0;
  if (plan.adaptive) {
    const double stable = adaptive_dt(limit);
    if (stable < std::numeric_limits<double>::min()) {  // time would stand still
      std::string where;
      present_limit(&where);
      throw InputError({Problem{
          .where = "/analysis",
          .message = fmt::format("the adaptive time step would be {:.3g} s: see {}", stable, where),
          .hint = "check speeds, stiffnesses and densities; units are m, kg, s, Pa"}});
    }
    watch_step(0, stable);
    if (plan_step(0, stable)) nsteps = std::min<Index>(nsteps, 1);
  } else {
    dt[0] = plan.dt;
    check_first_dt(limit);
    limit_steps_by_time();
  }
}

template <int Dim>
bool SimulationDriver<Dim>::plan_step(Step step, double stable) {
  const OutputPlan& plan = model.output;
  const double now = start_time[step], end = model.analysis.end_time;
  double target = std::numeric_limits<double>::infinity();
  for (const double interval : {plan.frame_dt, plan.history_dt})
    if (interval > 0) target = std::min(target, next_multiple(now, interval));
  const auto reached = [&](double time) { return time - now <= stable * (1 + rounding_of_time); };
  const bool last = reached(end) && end <= target * (1 + rounding_of_time);
  dt[step] = stable;
  start_time[step + 1] = now + stable;
  if (last || reached(target)) {
    start_time[step + 1] = last ? end : target;
    dt[step] = start_time[step + 1] - now;
  } else if (target < end && target - now < 2 * stable) {  // two equal ones, and no tiny one
    dt[step] = 0.5 * (target - now);
    start_time[step + 1] = now + dt[step];
  }
  return last;
}

template <int Dim>
void SimulationDriver<Dim>::limit_steps_by_time() {
  const TimeStep& plan = model.analysis.step;
  if (std::isfinite(model.analysis.end_time))
    nsteps = std::min(
        nsteps,
        static_cast<Index>(std::min(
            std::ceil(model.analysis.end_time / plan.dt * (1 - rounding_of_time)), most_steps)));
}

template <int Dim>
void SimulationDriver<Dim>::set_dt(Step step, double limit) {
  this->limit[step] = limit;
  limit = limit_with_injections(step, limit);
  // Without particles there is no limit: go on as before, or from output to output.
  const bool by_time = model.output.frame_dt > 0 || model.output.history_dt > 0;
  const bool limited = std::isfinite(limit) || step == 0;
  const double stable = limited || by_time ? adaptive_dt(limit) : dt[step - 1];
  if (limited) watch_step(step, stable);
  const bool last = plan_step(step, stable);
  if (last) nsteps = step + 1;
  // Nobody has begun the step after this one: it needs this dt.
  if (last || step_alarm_end == step + 1 || (frames_are_large() && frame_due(step)))
    executor->stop_before(step + 1);
}

template class SimulationDriver<2>;
template class SimulationDriver<3>;

}  // namespace lahar
