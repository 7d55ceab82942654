#include "runtime/step/run_watch.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "runtime/exchange/failure.h"
#include "runtime/exchange/sum_over_ranks.h"

namespace lahar {

template <int Dim>
void RunWatch<Dim>::begin(const HistoryRow& start) {
  if (!judge_.on()) return;
  ExactSum stored;
  for (int p = 0; p < patches_.size(); ++p) stored += stored_energy(patches_[p], model_);
  judge_.state = {};
  judge_.state.stored = sum_over_ranks(stored, ranks_);
  judge_.state.speed = start.max_speed;
}

template <int Dim>
void RunWatch<Dim>::resume(const WatchdogState& state) {
  judge_.state = state;
  // The user may have changed the bounds since.
  if (!judge_.stops() || judge_.allows(state.alarm)) judge_.state.end_step = -1;
}

template <int Dim>
bool RunWatch<Dim>::judge(Step step, const HistoryRow& row, double kinetic_at_start,
                          bool strained) {
  warn_of_lost_bodies(row);
  auto alarm = judge_.judge(row, kinetic_at_start, strained);
  if (!alarm || judge_.state.end_step >= 0) return false;
  if (judge_.stops()) {
    judge_.state.alarm = std::move(*alarm);
    judge_.state.end_step = step + max_lead;  // no patch has begun that step
  } else {
    warn_once(*alarm);
  }
  return judge_.stops();
}

template <int Dim>
bool RunWatch<Dim>::judge_step(Step step, double time, double stable) {
  if (!judge_.on() || step_alarm_.step >= 0) return false;
  auto alarm = judge_.judge_step(step, time, stable);
  if (!alarm) return false;
  step_alarm_ = std::move(*alarm);
  if (judge_.stops())
    step_alarm_end_ = step + 1;
  else
    step_alarm_is_new_ = true;
  return judge_.stops();
}

template <int Dim>
void RunWatch<Dim>::warn_once(const WatchdogAlarm& alarm) {
  if (!std::exchange(warned_[static_cast<std::size_t>(alarm.kind)], true))
    warn_(watchdog_warning(alarm));
}

template <int Dim>
void RunWatch<Dim>::warn_of_lost_bodies(const HistoryRow& row) {
  if (row.bodies.empty()) return;
  const auto [low, high] = model_.mesh->bounds();
  lost_.resize(row.bodies.size());
  for (std::size_t k = 0; k < row.bodies.size(); ++k) {
    if (model_.rigid_bodies[k].motion != RigidBody<Dim>::Motion::free) continue;
    for (int d = 0; d < Dim && !lost_[k]; ++d) {
      const double x = row.bodies[k].place[static_cast<std::size_t>(d)];
      lost_[k] = x < low[d] || x > high[d];
      if (!lost_[k]) continue;
      warn_(
          fmt::format("rigid body '{}' has left the mesh: its {} is {:.6g} m. `lahar check` "
                      "names the sides of the mesh that hold rigid bodies. What should hold it "
                      "elsewhere has to be a rigid body, too.",
                      row.bodies[k].name, "xyz"[d], x));
    }
  }
}

template <int Dim>
Step RunWatch<Dim>::end_step(Step done, Step end) const {
  for (const Step own : {step_alarm_end_, judge_.state.end_step})
    if (own > done) end = std::min(end, own);
  return end;
}

template <int Dim>
void RunWatch<Dim>::throw_alarm(Step done, Step nsteps) const {
  const auto is_due = [&](Step end) { return end >= 0 && (done >= end || done >= nsteps); };
  const bool by_step = is_due(step_alarm_end_);
  if (!by_step && !is_due(judge_.state.end_step)) return;
  const WatchdogAlarm& alarm = by_step ? step_alarm_ : judge_.state.alarm;
  throw WatchdogError(watchdog_message(alarm, done, worst_particle(alarm.kind), model_));
}

/// The one of all ranks that shows best what is wrong, in words.
template <int Dim>
std::string RunWatch<Dim>::worst_particle(WatchdogAlarm::Kind kind) const {
  WatchedParticle best;
  for (int p = 0; p < patches_.size(); ++p) {
    WatchedParticle own = watched_particle(kind, patches_[p], model_);
    if (own.measure > best.measure || (own.measure == best.measure && own.id < best.id))
      best = std::move(own);
  }
  const double most = ranks_.max(best.measure);
  constexpr Index none = std::numeric_limits<Index>::max();
  const Index id = ranks_.min(best.measure == most ? best.id : none);
  take_first_text(ranks_, best.measure == most && best.id == id, best.text);
  return best.text;
}

template class RunWatch<2>;
template class RunWatch<3>;

}  // namespace lahar
