#include <algorithm>
#include <ctime>
#include <optional>
#include <utility>

#include "graph/distributed_flow.h"
#include "graph/local_flow.h"
#include "physics/kernels/kernels.h"
#include "runtime/step/simulation_impl.h"
#include "runtime/step/simulation_trace.h"

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
void Simulation<Dim>::Impl::build_executor() {
  TaskGraph graph = make_task_graph(tasks_of(phases), patches.neighbours(), ranks.several(),
                                    static_cast<int>(patches.elsewhere().size()));
  const auto n = static_cast<std::size_t>(patches.size());
  poisoned.assign(n, 0);
  balance.begin(patches);
  timing.resize(n * stages.size());
  TaskBodies bodies{[this](int phase, int p, Step step) { run_task(phase, p, step); },
                    [this](Step step) {
                      TraceSpan trace(TraceKind::dt, step);
                      trace.set_ready(executor->ready_at(executor->graph().dt_task()));
                      set_dt(step);
                    },
                    [this](Step step) { complete(step); },
                    &trace_looking,
                    [this](int phase, int p, Step step) { run_task(phase, p, step, true); },
                    &trace_clock};
  record_graph();
  switch (options.mode) {
    case ExecutionOptions::Mode::serial:
      executor = make_serial_executor(std::move(graph), std::move(bodies));
      break;
    case ExecutionOptions::Mode::random_order:
      executor = make_random_executor(std::move(graph), std::move(bodies), options.seed);
      break;
    case ExecutionOptions::Mode::bulk:
      connect_ranks();
      executor =
          make_bulk_executor(std::move(graph), std::move(bodies), options.threads, exchange.get());
      break;
    case ExecutionOptions::Mode::flow_graph:
      connect_ranks();
      executor = exchange ? make_distributed_flow(std::move(graph), std::move(bodies),
                                                  options.threads, options.verify, *exchange)
                          : make_local_flow(std::move(graph), std::move(bodies), options.threads,
                                            options.verify);
  }
  for (std::size_t f = 0; f + 1 < phases.size(); ++f)
    if (phases[f + 1].task.is_rest) whole = joined(phases[f], phases[f + 1]);
  first_dt_stage = 0;
  for (std::size_t s = 0; s < stages.size(); ++s) {
    if (stages[s].stage.needs_dt && first_dt_stage == 0) first_dt_stage = s;
    if (stages[s].stage.name == locate_stage) locate_index = s;
    if (stages[s].stage.name == output_stage) output_index = s;
  }
}

template <int Dim>
void Simulation<Dim>::Impl::connect_ranks() {
  if (!ranks.several()) return;
  // Receives of the one before must be cancelled on all ranks before any sends by the new one.
  exchange.reset();
  ranks.wait_for_all();
  if (!groups) groups.emplace(ranks, options.threads);
  exchange = std::make_unique<RankExchange<Dim>>(
      *groups, patches, rank_messages(stages, phases), step,
      ExchangeCalls{.give = [this](Step s) { return give(s); },
                    .take = [this](Step s, const Agreement& found) { agreed[s] = found; },
                    .give_limit = [this] { return own_limit(); },
                    .take_limit = [this](Step s, double limit) { agreed_limit[s] = limit; },
                    .failed_step = [this] { return failed_step.load(); },
                    .failure_elsewhere = [this](Step s) { learn_of_failure(s); },
                    .others = [this] { poll(); }},
      InjectedLatency{options.latency}, options.shared_memory);
}

template <int Dim>
void Simulation<Dim>::Impl::poll() {
  if (!observer.poll || poll_failure) return;
  try {
    observer.poll();
  } catch (...) {  // a full disk, for example
    poll_failure = std::current_exception();
    stop_asked = true;
  }
}

template <int Dim>
void Simulation<Dim>::Impl::run_task(int phase, int p, Step step, bool with_rest) {
  TraceRecorder* const recorder = TraceRecorder::active(step);
  const bool own = p < patches.size();
  std::optional<TraceFound> found;
  if (!own) found.emplace();
  const int task = executor->graph().task(phase, p);
  TraceRecord record{.begin = ticks(), .ready = recorder ? executor->ready_at(task) : 0};
  record.step = step;
  const auto f = static_cast<std::size_t>(phase);
  if (!own) {
    exchange->unpack(phase, p - patches.size(), step);
    if (recorder) record_unpacked(*recorder, record, phase, p);
  } else {
    // Clocks of CPU time are system calls, which take longer than the tasks of empty patches.
    const bool samples = patches[p].count > 0 && balance.samples(step, p);
    const std::int64_t begin = samples ? thread_nanoseconds() : 0;
    StageClock clock(&timing[static_cast<std::size_t>(p) * stages.size()]);
    const Phase& all = with_rest ? *whole : phases[f];
    run_own_task(all, p, step, clock);
    if (recorder) record_own_task(*recorder, record, phase, p, with_rest, clock);
    clock.finish(all.first, all.last);
    if (samples) balance.add(step, p, thread_nanoseconds() - begin, patches[p].count);
  }
  if (with_rest) ++phase;
  if (!own || !exchange || !exchange->sends(phase, p)) return;
  if (options.delays.late_rank == ranks.rank()) waste_time(options.delays.late, step);
  exchange->send(phase, p, step);
}

template <int Dim>
void Simulation<Dim>::Impl::run_own_task(const Phase& phase, int p, Step step, StageClock& clock) {
  Patch<Dim>& patch = patches[p];
  char& poison = poisoned[static_cast<std::size_t>(p)];
  const std::uint64_t begin = ticks();
  try {
    if (poison || step > failed_step.load()) {
      // A failed patch does no work but still takes part, so that everybody can stop together.
      // Nor do others in later steps, which would read what the failed patch did not write.
      if (phase.first == 0) take_unmapped(patch);
      if (phase.task.is_rest)
        take_back_movers(patch, step);
      else if (phase.first <= locate_index && locate_index < phase.last)
        clear_outboxes(patch);
    } else {
      run_stages(phase, p, step, clock);
    }
  } catch (const std::exception& error) {
    fail(phase.first, p, step, error.what());
  } catch (...) {
    fail(phase.first, p, step, "unknown exception");
  }
  if (options.delays.slow_patch == patch.topology.patch) {
    const auto took = static_cast<double>(ticks() - begin);
    const std::uint64_t end =
        ticks() + static_cast<std::uint64_t>(took * (options.delays.slow_factor - 1));
    while (ticks() < end) {
    }
    clock.lap(phase.last - 1);
  }
}

template <int Dim>
void Simulation<Dim>::Impl::take_unmapped(Patch<Dim>& patch) {
  receive(patch);
  patch.unmapped.clear();
}

template <int Dim>
void Simulation<Dim>::Impl::take_back_movers(Patch<Dim>& patch, Step step) const {
  place_movers(patch, context(step));
  patch.fault = {};
}

template <int Dim>
void Simulation<Dim>::Impl::run_stages(const Phase& phase, int p, Step step, StageClock& clock) {
  Patch<Dim>& patch = patches[p];
  if (phase.first == 0 || !patch.idle) {
    const bool has_dt = !model.analysis.step.adaptive || phase.first >= first_dt_stage;
    const bool locates = phase.last > locate_index;  // then dt of this step is known
    std::optional<BorrowedNodalState<Dim>> borrowed;
    if (phase.first > 0 && !keeps_nodal_state(model.analysis)) borrowed.emplace(patch);
    const auto run = [&](const Phase& some) {
      return run_phase(patch, stages, some, context(step, has_dt),
                       locates ? context(step + 1) : StepContext<Dim>{},
                       [&](std::size_t s) { clock.lap(s); });
    };
    std::size_t failed = 0;
    if (phase.first == 0 && keeps(step)) {
      failed = run(part_of(phase, 0, 1));  // arrivals
      if (patch.fault.kind == ParticleFault::Kind::none) {
        keep(p, step);
        clock.lap(0);
        failed = run(part_of(phase, 1, phase.last));
      }
    } else {
      failed = run(phase);
    }
    if (patch.fault.kind != ParticleFault::Kind::none) {
      fail(failed, p, step, describe_fault(patch.fault, model, patches.next_id()));
      if (locates) take_back_movers(patch, step);
      return;
    }
  }
  if (phase.first == 0 && !patch.injected.empty())
    injected[step][static_cast<std::size_t>(p)] = std::exchange(patch.injected, {});
  if (phase.first == 0 && patch.needs_surroundings) {
    rebuild_needed.store(true, std::memory_order_relaxed);
    request_stop(step);
  }
  if (phase.last > output_index) {
    output(p, step);
    clock.lap(output_index);
    if (patch.fault.kind != ParticleFault::Kind::none)
      fail(output_index, p, step, describe_fault(patch.fault, model, patches.next_id()));
  }
}

template <int Dim>
void Simulation<Dim>::Impl::fail(std::size_t s, int p, Step step, const std::string& cause) {
  poisoned[static_cast<std::size_t>(p)] = 1;
  patches[p].fault = {};
  failures.add({step, static_cast<int>(s), stages[s].stage.name, time_at(step),
                patches[p].topology.patch, cause});
  learn_of_failure(step);
  request_stop(step);
}

template <int Dim>
std::vector<StageTiming> Simulation<Dim>::Impl::timings() const {
  std::vector<StageTiming> all = kept_timing;
  all.resize(stages.size());
  for (std::size_t s = 0; s < stages.size(); ++s) all[s].name = stages[s].stage.name;
  const double second = seconds_per_tick();
  for (std::size_t i = 0; i < timing.size(); ++i) {
    const StageTicks& t = timing[i];
    StageTiming& sum = all[i % stages.size()];
    if (t.calls == 0) continue;
    const double shortest = second * static_cast<double>(t.shortest);
    sum.shortest = sum.calls == 0 ? shortest : std::min(sum.shortest, shortest);
    sum.longest = std::max(sum.longest, second * static_cast<double>(t.longest));
    sum.calls += t.calls;
    sum.total += second * static_cast<double>(t.total);
  }
  return all;
}

template struct Simulation<2>::Impl;
template struct Simulation<3>::Impl;

}  // namespace lahar
