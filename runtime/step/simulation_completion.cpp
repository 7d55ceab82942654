/// \file What a simulation does when all patches have done a step: ranks agree on what they know,
/// and what is due goes to the observer.
#include <span>
#include <utility>

#include "runtime/patches/patch_state.h"
#include "runtime/step/simulation_driver.h"

namespace lahar {

template <int Dim>
Agreement SimulationDriver<Dim>::give(Step step) {
  if (stop_asked_) stop_before_.give(step + max_lead);
  Agreement own;
  own.least.stop_before = stop_before_.get();
  own.least.failed_step = failures_.first_step();
  own.least.checkpoint = stager_.is_asked() ? -1 : 0;
  own.least.stop = stop_asked_ ? -1 : 0;
  if (watch_.due(step)) own.least.strained = watch_.take_strained(step) ? -1 : 0;
  if (sums_due(step)) history_.give(step, own);
  if (log_.due(time_.time_at(step))) {
    std::vector<Index> events;
    std::vector<ExactSum> beyond(gauges_.n_planes());
    for (std::size_t i = 0; i < injected_[step].size(); ++i) {
      const std::vector<Index> of_patch = std::exchange(injected_[step][i], {});
      gauges_.add_injected(patches_[static_cast<int>(i)], of_patch, beyond);
      events.insert(events.end(), of_patch.begin(), of_patch.end());
    }
    const std::vector<Index> elements = log_.elements(events);
    own.sum.insert(own.sum.end(), elements.begin(), elements.end());
    for (const ExactSum& sum : beyond)
      own.sum.insert(own.sum.end(), sum.elements().begin(), sum.elements().end());
  }
  if (gauges_due(step)) gauges_.give(step, own);
  epochs_.give(step, own);
  return own;
}

template <int Dim>
void SimulationDriver<Dim>::finish_step(Step step) {
  const TraceSpan trace(TraceKind::completed, step);
  trace_.add_progress(step);
  if (options_.delays.serial > 0) waste_time(options_.delays.serial, step);
  if (!exchange_) agreed_[step] = give(step);
  const Agreement::Least& least = agreed_[step].least;
  executor_->stop_before(least.stop_before);
  if (least.checkpoint < 0) plan_checkpoint(step);
  if (least.stop < 0) stops_ = true;
  failures_.learn(least.failed_step);
  // All ranks find the same, and nobody has begun the step before which they stop.
  if (epochs_.take(step, agreed_[step])) executor_->stop_before(step + max_lead);
  if (log_.due(time_.time_at(step))) take_injected(step);
  // Patches that are ahead may have failed in a later step: this one is still good.
  const bool is_good = least.failed_step > step;
  if (is_good && sums_due(step)) hand_on_row(step);
  if (is_good && gauges_due(step)) hand_on_gauges(step);
  watch_.warn_of_step();
  if (is_good) hand_on_copies(step);
  if (stager_.copies(step + 1)) stager_.set_run(run_state(step + 1));
  ask_observer(step);
}

template <int Dim>
void SimulationDriver<Dim>::plan_checkpoint(Step step) {
  if (stager_.plan(step) && !stager_.copies()) executor_->stop_before(step + max_lead);
}

template <int Dim>
void SimulationDriver<Dim>::take_injected(Step step) {
  const Index before = log_.next_id();
  const auto sums = std::span(std::as_const(agreed_[step].sum))
                        .subspan(sums_due(step) ? history_.n_elements() : 0);
  log_.take(step, sums.first(log_.n_elements()));
  gauges_.take_injected(
      sums.subspan(log_.n_elements(), gauges_.n_planes() * std::size_t{ExactSum::size}));
  stager_.add_particles(log_.next_id() - before);
  // In a state, without sums of nodes.
  const auto particle = static_cast<std::size_t>(patches_.layout().rows() + 2) * sizeof(double);
  if (budget_.is_outgrown(log_.next_id(), particle)) executor_->stop_before(step + max_lead);
}

template <int Dim>
void SimulationDriver<Dim>::hand_on_row(Step step) {
  HistoryRow row = history_.take(step, agreed_[step]);
  rigid_.describe(step, time_.time_at(step + 1), row);
  if (schedule_.history_due(step) && observer_.history) attempt([&] { observer_.history(row); });
  if (!watch_.due(step)) return;
  const bool strained = agreed_[step].least.strained < 0;
  if (watch_.judge(step, row, history_.start().kinetic, strained))
    executor_->stop_before(step + max_lead);
}

template <int Dim>
void SimulationDriver<Dim>::hand_on_gauges(Step step) {
  const Agreement& all = agreed_[step];
  std::size_t before = sums_due(step) ? history_.n_elements() : 0;
  if (log_.due(time_.time_at(step)))
    before += log_.n_elements() + gauges_.n_planes() * std::size_t{ExactSum::size};
  const GaugeRows rows =
      gauges_.take(step, time_.time_at(step + 1),
                   std::span(all.sum).subspan(before, gauges_.n_sums()), all.lowest);
  attempt([&] { observer_.gauges(rows); });
}

template <int Dim>
void SimulationDriver<Dim>::hand_on_copies(Step step) {
  if (copy_due(step)) attempt([&] { observer_.frame(frames_.take(step)); });
  if (copy_due(step) && nodes_.any() && observer_.nodes)
    attempt([&] { observer_.nodes(nodes_.take(step)); });
  if (schedule_.frames_end(step)) warn(schedule_.no_more_frames(step));
  if (!stager_.copies(step)) return;
  const SimulationState state =
      stager_.take(step, time_.limit_of(step), rigid_.state(step, time_.time_at(step)), log_);
  attempt([&] { observer_.checkpoint(state); });
}

template <int Dim>
void SimulationDriver<Dim>::ask_observer(Step step) {
  const bool asks = observer_.checkpoint && observer_.checkpoint_wanted;
  if (asks && observer_.checkpoint_wanted()) stager_.ask();
  if (observer_.progress && !observer_.progress(step + 1, time_.time_at(step + 1)))
    stop_asked_ = true;
  if (exchange_) return;  // another rank has to hear of it first
  if (stager_.is_asked()) plan_checkpoint(step);
  if (!stop_asked_) return;
  stops_ = true;
  executor_->request_stop(step);
}

template <int Dim>
RunState SimulationDriver<Dim>::run_state(Step at) const {
  return {.dim = Dim,
          .step = at,
          .time = time_.time_at(at),
          .dt = time_.last_dt(at),
          .next_id = log_.next_id(),
          .history_steps = schedule_.history_steps(),
          .work = history_.work(),
          .kinetic_at_start = history_.start().kinetic,
          .cells_per_patch = patches_.target_cells(),
          .least_mass = patches_.least_mass(),
          .columns = column_text(patches_.layout()),
          .splits = patches_.splits(),
          .split_step = epochs_.split_step(),
          .watchdog = watch_.state(),
          .rest = rest_.state(),
          .gauges = gauges_.state()};
}

template <int Dim>
void SimulationDriver<Dim>::poll_observer() {
  if (!observer_.poll || failures_.of_poll()) return;
  try {
    observer_.poll();
  } catch (...) {  // a full disk, for example
    failures_.keep_of_poll(std::current_exception());
    stop_asked_ = true;
  }
}

template <int Dim>
void SimulationDriver<Dim>::poll() {
  if (!exchange_) return;
  const auto lock = exchange_->lock_mpi();
  poll_observer();
  if (failures_.of_poll()) std::rethrow_exception(failures_.of_poll());
}

}  // namespace lahar

#include "runtime/step/simulation_driver_instances.h"
