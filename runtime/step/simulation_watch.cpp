/// \file What the watchdog does in a simulation.
#include <algorithm>
#include <limits>

#include "runtime/step/exact_sum.h"
#include "runtime/step/simulation_driver.h"

namespace lahar {

template <int Dim>
void SimulationDriver<Dim>::begin_watch() {
  if (!judge.on()) return;
  ExactSum stored;
  for (int p = 0; p < patches.size(); ++p) stored += stored_energy(patches[p], model);
  std::vector<Index> elements(stored.elements().begin(), stored.elements().end());
  ranks.sum(elements);
  judge.state = {};
  judge.state.stored = ExactSum(std::span<const Index, ExactSum::size>(elements)).value();
  judge.state.speed = start_row.max_speed;
}

template <int Dim>
void SimulationDriver<Dim>::restore_watch(const WatchdogState& state) {
  judge.state = state;
  // The user may have changed the bounds since.
  if (!judge.stops() || judge.allows(state.alarm)) judge.state.end_step = -1;
}

template <int Dim>
void SimulationDriver<Dim>::watch(Step step, const HistoryRow& row, bool strained) {
  auto alarm = judge.judge(row, start_row.kinetic, strained);
  if (!alarm || judge.state.end_step >= 0) return;
  if (!judge.stops()) return warn_once(*alarm);
  judge.state.alarm = std::move(*alarm);
  judge.state.end_step = step + max_lead;  // which nobody has begun
  executor->stop_before(judge.state.end_step);
}

template <int Dim>
void SimulationDriver<Dim>::watch_step(Step step, double stable) {
  if (!judge.on() || step_alarm.step >= 0) return;
  auto alarm = judge.judge_step(step, start_time[step], stable);
  if (!alarm) return;
  step_alarm = std::move(*alarm);
  if (judge.stops())
    step_alarm_end = step + 1;
  else
    step_alarm_is_new = true;
}

template <int Dim>
void SimulationDriver<Dim>::warn_once(const WatchdogAlarm& alarm) {
  if (std::exchange(warned[static_cast<std::size_t>(alarm.kind)], true) || !observer.warning)
    return;
  attempt([&] { observer.warning(watchdog_warning(alarm)); });
}

template <int Dim>
void SimulationDriver<Dim>::end_where_watched() {
  const auto is_due = [&](Step end_step) {
    return end_step >= 0 && (step >= end_step || step >= nsteps);
  };
  const bool by_step = is_due(step_alarm_end);
  if (!by_step && !is_due(judge.state.end_step)) return;
  const WatchdogAlarm& alarm = by_step ? step_alarm : judge.state.alarm;
  WatchedParticle best;
  for (int p = 0; p < patches.size(); ++p) {
    WatchedParticle own = watched_particle(alarm.kind, patches[p], model);
    if (own.measure > best.measure || (own.measure == best.measure && own.id < best.id))
      best = std::move(own);
  }
  const double most = ranks.max(best.measure);
  constexpr Index none = std::numeric_limits<Index>::max();
  const Index id = ranks.min(best.measure == most ? best.id : none);
  of_one_rank(best.measure == most && best.id == id, best.text);
  throw WatchdogError(watchdog_message(alarm, step, best.text, model));
}

template class SimulationDriver<2>;
template class SimulationDriver<3>;

}  // namespace lahar
