#include <algorithm>
#include <ctime>
#include <limits>
#include <optional>
#include <utility>

#include "physics/kernels/kernels.h"
#include "physics/kernels/node_supports.h"
#include "runtime/step/simulation_driver.h"
#include "runtime/step/snapshot.h"

namespace lahar {

namespace {

/// State of the nodes of the patch that a thread works on, where no other phase needs it: it stays
/// in the thread's cache, and patches need no memory for it.
template <int Dim>
class BorrowedNodalState {
 public:
  explicit BorrowedNodalState(Patch<Dim>& patch) : patch_(patch) { exchange(); }
  ~BorrowedNodalState() { exchange(); }
  BorrowedNodalState(const BorrowedNodalState&) = delete;
  BorrowedNodalState& operator=(const BorrowedNodalState&) = delete;

 private:
  void exchange() {
    thread_local NodeArray velocity, acceleration, transfer, held;
    velocity.swap(patch_.velocity);
    acceleration.swap(patch_.acceleration);
    transfer.swap(patch_.transfer);
    held.swap(patch_.held);
  }

  Patch<Dim>& patch_;
};

/// The stages [first, last) of a phase.
Phase part_of(Phase phase, std::size_t first, std::size_t last) {
  phase.first = first;
  phase.last = last;
  phase.begins = std::min(phase.begins, last);
  phase.ends = std::max(phase.ends, first);
  return phase;
}

/// CPU time of this thread [ns]: others on the same core do not count.
std::int64_t thread_nanoseconds() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec;
}

}  // namespace

template <int Dim>
void SimulationDriver<Dim>::build_executor() {
  TaskGraph graph = make_task_graph(tasks_of(phases_), patches_.neighbours(), ranks_.several(),
                                    static_cast<int>(patches_.elsewhere().size()));
  failures_.begin(patches_.size());
  epochs_.balance().begin(patches_);
  times_.begin(patches_.size());
  TaskBodies bodies{[this](int phase, int p, Step step) { run_task(phase, p, step, false); },
                    [this](Step step) {
                      TraceSpan trace(TraceKind::dt, step);
                      trace.set_ready(executor_->ready_at(executor_->graph().dt_task()));
                      if (!exchange_ && rigid_.any_free()) rigid_.take(step, rigid_.sums(patches_));
                      set_dt(step, exchange_ ? agreed_limit_[step] : limits_.of_last_step());
                    },
                    [this](Step step) { attempt([&] { finish_step(step); }); },
                    &trace_looking,
                    [this](int phase, int p, Step step) { run_task(phase, p, step, true); },
                    &trace_clock};
  if (TraceRecorder* recorder = TraceRecorder::active()) recorder->add_graph(trace_graph());
  connect_ranks();
  // Steps that begin with a solve are taken one at a time: in one their tasks wait for nothing.
  executor_ = make_executor(std::move(graph), std::move(bodies),
                            {.mode = options_.mode,
                             .threads = options_.threads,
                             .verify = options_.verify && !begins_with_solve(model_.analysis),
                             .seed = options_.seed},
                            exchange_.get());
  build_solver();
  for (std::size_t f = 0; f + 1 < phases_.size(); ++f)
    if (phases_[f + 1].task.is_rest) whole_ = joined(phases_[f], phases_[f + 1]);
  first_dt_stage_ = 0;
  for (std::size_t s = 0; s < stages_.size(); ++s) {
    if (stages_[s].stage.needs_dt && first_dt_stage_ == 0) first_dt_stage_ = s;
    if (stages_[s].stage.name == locate_stage) locate_index_ = s;
    if (stages_[s].stage.name == output_stage) output_index_ = s;
  }
}

template <int Dim>
void SimulationDriver<Dim>::build_solver() {
  const RoundOptions rounds{.executor = {.mode = options_.mode,
                                         .threads = threads(),
                                         .verify = options_.verify,
                                         .seed = options_.seed},
                            .latency = options_.latency,
                            .shared_memory = options_.shared_memory,
                            .others = [this] { poll_observer(); }};
  const auto build = [&](auto& solver, auto& groups) {
    solver.reset();
    if (ranks_.several() && !groups) groups.emplace(ranks_, options_.threads);
    solver.emplace(model_, patches_, ranks_, rounds, groups ? &*groups : nullptr);
  };
  if (is_implicit(model_.analysis)) build(implicit_, implicit_groups_);
  if (is_projection(model_.analysis)) build(pressure_, pressure_groups_);
}

template <int Dim>
void SimulationDriver<Dim>::connect_ranks() {
  if (!ranks_.several()) return;
  // Receives of the one before must be cancelled on all ranks before any sends by the new one.
  exchange_.reset();
  ranks_.wait_for_all();
  if (!groups_) groups_.emplace(ranks_, options_.threads);
  ExchangeCalls calls{.give = [this](Step s) { return give(s); },
                      .take = [this](Step s, const Agreement& found) { agreed_[s] = found; },
                      .give_limit = [this] { return limits_.of_last_step(); },
                      .take_limit = [this](Step s, double limit) { agreed_limit_[s] = limit; },
                      .failed_step = [this] { return failures_.first_step(); },
                      .failure_elsewhere = [this](Step s) { failures_.learn(s); },
                      .others = [this] { poll_observer(); }};
  if (rigid_.any_free()) {
    calls.give_sums = [this](Step) { return rigid_.sums(patches_); };
    calls.take_sums = [this](Step s, std::span<const Index> sums) { rigid_.take(s, sums); };
  }
  exchange_ = std::make_unique<RankExchange<Dim>>(
      *groups_, patches_,
      ExchangePlan{.messages = rank_messages(stages_, phases_, patches_.sum_messages()),
                   .first = step_},
      std::move(calls), InjectedLatency{options_.latency}, options_.shared_memory);
}

template <int Dim>
StepContext<Dim> SimulationDriver<Dim>::context(Step step, bool has_dt) const {
  return {&model_,
          &patches_.partition(),
          step,
          time_.time_at(step),
          has_dt ? time_.dt_of(step) : std::numeric_limits<double>::quiet_NaN(),
          has_dt ? rigid_.after(step) : nullptr,
          step == model_.analysis.first_step};
}

template <int Dim>
void SimulationDriver<Dim>::take_message(int phase, int p, Step step) {
  const TraceFound found;
  TraceRecorder* const recorder = TraceRecorder::active(step);
  const int task = executor_->graph().task(phase, p);
  const TraceRecord record{
      .begin = ticks(), .ready = recorder ? executor_->ready_at(task) : 0, .step = step};
  const int elsewhere = p - patches_.size();
  exchange_->unpack(phase, elsewhere, step);
  if (!recorder) return;
  const Index patch = patches_.elsewhere()[static_cast<std::size_t>(elsewhere)].patch;
  trace_.add_unpacked(*recorder, record, phase, patch, executor_->missed_at(task));
}

template <int Dim>
void SimulationDriver<Dim>::run_task(int phase, int p, Step step, bool with_rest) {
  if (p >= patches_.size()) return take_message(phase, p, step);
  TraceRecorder* const recorder = TraceRecorder::active(step);
  const int task = executor_->graph().task(phase, p);
  const TraceRecord record{
      .begin = ticks(), .ready = recorder ? executor_->ready_at(task) : 0, .step = step};
  const Patch<Dim>& patch = patches_[p];
  RankBalance<Dim>& balance = epochs_.balance();
  // Clocks of CPU time are system calls, which take longer than the tasks of empty patches.
  const bool samples = patch.count > 0 && balance.samples(step, p);
  const std::int64_t begin = samples ? thread_nanoseconds() : 0;
  StageClock clock = times_.clock(p);
  const Phase& all = with_rest ? *whole_ : phases_[static_cast<std::size_t>(phase)];
  run_own_task(all, p, step, clock);
  if (recorder)
    trace_.add_task(*recorder, record, phase, with_rest, patch.topology.patch, patch.count, clock);
  clock.finish(all.first, all.last);
  if (samples) balance.add(step, p, thread_nanoseconds() - begin, patch.count);
  if (with_rest) ++phase;
  if (!exchange_ || !exchange_->sends(phase, p)) return;
  if (options_.delays.late_rank == ranks_.rank()) waste_time(options_.delays.late, step);
  exchange_->send(phase, p, step);
}

template <int Dim>
void SimulationDriver<Dim>::run_own_task(const Phase& phase, int p, Step step, StageClock& clock) {
  const std::uint64_t begin = ticks();
  try {
    if (failures_.idles(p, step))
      idle(phase, patches_[p], step);
    else
      run_stages(phase, p, step, clock);
  } catch (const std::exception& error) {
    fail(phase.first, p, step, error.what());
  } catch (...) {
    fail(phase.first, p, step, "unknown exception");
  }
  if (options_.delays.slow_patch == patches_[p].topology.patch) {
    const auto took = static_cast<double>(ticks() - begin);
    const std::uint64_t end =
        ticks() + static_cast<std::uint64_t>(took * (options_.delays.slow_factor - 1));
    while (ticks() < end) {
    }
    clock.lap(phase.last - 1);
  }
}

/// A patch that has failed does no work but still takes part, so that everybody can stop together.
/// Nor do others in later steps, which would read what the failed patch did not write.
template <int Dim>
void SimulationDriver<Dim>::idle(const Phase& phase, Patch<Dim>& patch, Step step) const {
  if (phase.first == 0) {  // so that no particle is missing from the last state
    receive(patch);
    patch.unmapped.clear();
  }
  if (phase.task.is_rest)
    take_back_movers(patch, step);
  else if (phase.first <= locate_index_ && locates(phase))
    clear_outboxes(patch);
}

template <int Dim>
void SimulationDriver<Dim>::take_back_movers(Patch<Dim>& patch, Step step) const {
  place_movers(patch, context(step));
  patch.fault = {};
}

template <int Dim>
void SimulationDriver<Dim>::run_stages(const Phase& phase, int p, Step step, StageClock& clock) {
  Patch<Dim>& patch = patches_[p];
  if (phase.first == 0 || !patch.idle) {
    const std::size_t failed = run_kernels(phase, p, step, clock);
    if (patch.fault.kind != ParticleFault::Kind::none) {
      fail_with_fault(failed, p, step);
      if (locates(phase)) take_back_movers(patch, step);
      return;
    }
  }
  if (phase.first == 0 && !patch.injected.empty())
    injected_[step][static_cast<std::size_t>(p)] = std::exchange(patch.injected, {});
  if (phase.first == 0 && patch.needs_surroundings) {
    epochs_.need_surroundings();
    request_stop(step);
  }
  if (phase.last > output_index_) {
    output(p, step);
    clock.lap(output_index_);
    if (patch.fault.kind != ParticleFault::Kind::none) fail_with_fault(output_index_, p, step);
  }
}

template <int Dim>
std::size_t SimulationDriver<Dim>::run_kernels(const Phase& phase, int p, Step step,
                                               StageClock& clock) {
  Patch<Dim>& patch = patches_[p];
  const bool has_dt = !sets_dt() || phase.first >= first_dt_stage_;
  std::optional<BorrowedNodalState<Dim>> borrowed;
  if (phase.first > 0 && !keeps_nodal_state(model_.analysis)) borrowed.emplace(patch);
  const auto run = [&](const Phase& some) {
    return run_phase(patch, stages_, some, context(step, has_dt),
                     locates(phase) ? context(step + 1) : StepContext<Dim>{},  // dt is known then
                     [&](std::size_t s) { clock.lap(s); });
  };
  if (phase.first > 0 || !stager_.copies(step)) return run(phase);
  const std::size_t failed = run(part_of(phase, 0, 1));  // arrivals
  if (patch.fault.kind != ParticleFault::Kind::none) return failed;
  stager_.copy(p, step);
  clock.lap(0);
  return run(part_of(phase, 1, phase.last));
}

template <int Dim>
void SimulationDriver<Dim>::fail_with_fault(std::size_t stage, int p, Step step) {
  fail(stage, p, step, describe_fault(patches_[p].fault, model_, patches_.next_id()));
}

template <int Dim>
void SimulationDriver<Dim>::fail(std::size_t stage, int p, Step step, const std::string& cause) {
  patches_[p].fault = {};
  failures_.add(p, {step, static_cast<int>(stage), stages_[stage].stage.name, time_.time_at(step),
                    patches_[p].topology.patch, cause});
  request_stop(step);
}

template <int Dim>
void SimulationDriver<Dim>::request_stop(Step step) {
  stop_before_.give(step + max_lead);
  executor_->request_stop(step);
}

template <int Dim>
void SimulationDriver<Dim>::set_dt(Step step, double limit) {
  if (implicit_ && time_.is_adaptive()) {
    time_.set_dt(step, limit);
  } else if (time_.is_adaptive()) {
    const auto planned = time_.plan(step, limit);
    const bool alarm =
        planned.limited && watch_.judge_step(step, time_.time_at(step), planned.stable);
    // Nobody has begun the step after this one: it needs this dt.
    if (planned.last || alarm || (frames_are_large() && frame_due(step)))
      executor_->stop_before(step + 1);
  }
  rigid_.move(step, time_.time_at(step), time_.dt_of(step));
}

template <int Dim>
void SimulationDriver<Dim>::output(int p, Step step) {
  Patch<Dim>& patch = patches_[p];
  const std::string problem = limits_.problem(patch, step, time_.nsteps());
  if (!problem.empty()) fail(output_index_, p, step, problem);
  if (!patch.impulses.empty()) add_impulses(patch, context(step, true));
  const bool needs_sums = sums_due(step);
  if (needs_sums || frame_due(step) || gauges_due(step)) check_finite(patch);
  if (needs_sums) history_.add(p, step, sums(patch, model_));
  if (gauges_due(step)) gauges_.add(patch, step, time_.time_at(step) + time_.dt_of(step));
  if (watch_.due(step)) watch_.look_at(patch, step);
  if (copy_due(step)) {
    frames_.copy(p, step);
    nodes_.copy(p, step);
  }
  epochs_.look_at(patch, step);
}

}  // namespace lahar

#include "runtime/step/simulation_driver_instances.h"
