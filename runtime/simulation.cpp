#include "runtime/simulation.h"

#include <fmt/format.h>
#if defined(__GLIBC__)
#include <malloc.h>
#endif

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <optional>

#include "graph/executor.h"
#include "physics/error.h"
#include "physics/kernels.h"
#include "physics/law.h"
#include "runtime/exact_sum.h"
#include "runtime/failure.h"
#include "runtime/injection_log.h"
#include "runtime/patch_set.h"
#include "runtime/patch_state.h"
#include "runtime/rank_exchange.h"
#include "runtime/snapshot.h"
#include "runtime/stage_clock.h"
#include "runtime/timestep.h"

namespace lahar {

namespace {

/// Values that belong to a step: patches may be max_lead steps apart, and dt of the next is set
/// early.
template <class T>
class PerStep {
 public:
  T& operator[](Step step) { return values_[static_cast<std::size_t>(step) % values_.size()]; }
  const T& operator[](Step step) const {
    return values_[static_cast<std::size_t>(step) % values_.size()];
  }

 private:
  std::array<T, max_lead + 2> values_{};
};

/// An end time that is missed by this share of a step is reached: sums of steps are rounded.
constexpr double rounding_of_time = 1e-9;

/// A fixed step is compared with its limit where speeds might have lowered it, and every so many
/// steps for slow changes of density: computing the limit costs as much as a stage.
constexpr Step limit_check_steps = 16;
/// Wave speeds may grow by this factor, as densities fall, between two of these checks.
constexpr double wave_speed_margin = 1.1;

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
    thread_local NodeArray velocity, acceleration;
    velocity.swap(patch_.velocity);
    acceleration.swap(patch_.acceleration);
  }

  Patch<Dim>& patch_;
};

bool is_parallel(const ExecutionOptions& options) {
  return options.mode == ExecutionOptions::Mode::flow_graph ||
         options.mode == ExecutionOptions::Mode::bulk;
}

ExecutionOptions with_threads(ExecutionOptions options) {
  if (options.threads <= 0) options.threads = available_threads();
  return options;
}

/// CPU time of this thread [ns]: others on the same core do not count.
std::int64_t thread_nanoseconds() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec;
}

/// The sums of a history row, each exact, as elements that are added over patches and ranks in any
/// order.
class RowSums {
 public:
  static constexpr std::size_t n_sums = 8;
  static constexpr std::size_t n_elements = 1 + n_sums * ExactSum::size;
  void add(const HistoryRow& row) {
    particles_ += row.particles;
    const std::array<double, n_sums> terms{row.mass,        row.momentum[0], row.momentum[1],
                                           row.momentum[2], row.kinetic,     row.internal,
                                           row.external,    row.damping};
    for (std::size_t k = 0; k < n_sums; ++k) sums_[k] += terms[k];
  }
  std::vector<Index> elements() const {
    std::vector<Index> all{particles_};
    for (const ExactSum& sum : sums_)
      all.insert(all.end(), sum.elements().begin(), sum.elements().end());
    return all;
  }
  static HistoryRow row(std::span<const Index> elements, double max_speed) {
    std::array<double, n_sums> value;
    for (std::size_t k = 0; k < n_sums; ++k)
      value[k] = ExactSum(elements.subspan(1 + k * ExactSum::size).first<ExactSum::size>()).value();
    HistoryRow row;
    row.particles = elements[0];
    row.mass = value[0];
    row.momentum = {value[1], value[2], value[3]};
    row.kinetic = value[4];
    row.internal = value[5];
    row.external = value[6];
    row.damping = value[7];
    row.max_speed = max_speed;
    return row;
  }

 private:
  Index particles_ = 0;
  std::array<ExactSum, n_sums> sums_;
};

/// A history row about every 1 % of the run where the scenario does not say.
Index history_interval(const OutputPlan& plan, double steps) {
  return plan.history_steps > 0 ? plan.history_steps
                                : std::max<Index>(1, static_cast<Index>(steps / 100));
}

}  // namespace

template <int Dim>
struct Simulation<Dim>::Impl {
  Impl(Model<Dim> model_in, ExecutionOptions options_in, Observer observer_in,
       const SimulationState* state = nullptr)
      : options(with_threads(options_in)),
        observer(std::move(observer_in)),
        model(std::move(model_in)),
        stages(timestep<Dim>(model.analysis, !model.injections.empty())),
        phases(phases_of(stage_list())),
        ranks(options.ranks),
        injection_limits(limits_of_injections(model)),
        patches(make_patches(state)),
        balance(ranks, options.balance, static_cast<int>(ranks.min(Index{options.threads}))) {
    seconds_per_tick();  // from now on
    nsteps = model.analysis.nsteps;
    for (const Material& material : model.materials)
      wave_speed_bound =
          std::max(wave_speed_bound,
                   wave_speed_margin * std::sqrt(wave_modulus(material.law) / material.density));
    if (ranks.several() && !is_parallel(options))
      throw InputError("only the task graph runs on several ranks; leave out --serial");
    measure_frame();
    log = InjectionLog(model.injections, state ? state->run.next_id : patches.next_id());
    if (state)
      restore(state->run);
    else
      start();
#if defined(__GLIBC__)
    malloc_trim(0);  // what the model's tables took goes back to the system
#endif
  }

  static std::vector<double> limits_of_injections(const Model<Dim>& model) {
    std::vector<double> limits;
    for (const auto& injection : model.injections)
      limits.push_back(lahar::injection_limit(injection, model));
    return limits;
  }

  void measure_frame() {
    const std::size_t own = frame_bytes(patches.layout(), model, patches.particles());
    frame_size = static_cast<std::size_t>(ranks.max(static_cast<Index>(own)));
  }

  PatchSet<Dim> make_patches(const SimulationState* state) {
    const int threads = is_parallel(options) ? options.threads : 1;
    const NodeSumCopies copies = node_sum_copies(model.analysis);
    const SumMessages messages = message_of_sums(stages);
    return state ? PatchSet<Dim>(model, options.support_rings, copies, *state, threads, ranks,
                                 messages)
                 : PatchSet<Dim>(model, options.support_rings, copies, threads, ranks, messages);
  }

  void start() {
    step = model.analysis.first_step;
    start_row = present_row();
    set_first_dt();
    for (int p = 0; p < patches.size(); ++p) map_first(patches[p], stages, context(step));
    balance.share(patches, step);
    history_steps = history_interval(
        model.output, std::min(static_cast<double>(nsteps), model.analysis.end_time / dt[0]));
    build_executor();
  }

  // --- state ------------------------------------------------------------------------------------

  /// Go on from the numbers of a state whose patches exist already.
  void restore(const RunState& run) {
    step = run.step;
    removed = ranks.rank() == 0 ? run.removed : 0;
    work = run.work;
    start_row.kinetic = run.kinetic_at_start;
    history_steps = model.output.history_steps > 0 ? model.output.history_steps : run.history_steps;
    start_time[step] = run.time;
    last_limit = run.dt_limit;
    build_executor();
    if (model.analysis.step.adaptive)
      restore_dt(run.dt);
    else
      limit_steps_by_time();
    if (step > nsteps)
      throw InputError(
          {Problem{.where = "/analysis/nsteps",
                   .message = fmt::format("the run ends with step {}, but is to go on from step {}",
                                          nsteps, step),
                   .hint = "raise nsteps, or go on from an earlier checkpoint"}});
  }

  void restore_dt(double last_dt) {
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

  RunState run_state() const {
    return {.dim = Dim,
            .step = step,
            .time = time_at(step),
            .dt = step > 0 ? dt_of(step - 1) : 0.0,
            .dt_limit = last_limit,
            .particles = ranks.sum(patches.particles()),
            .removed = ranks.sum(removed),
            .next_id = log.next_id(),
            .history_steps = history_steps,
            .work = work,
            .kinetic_at_start = start_row.kinetic,
            .cells_per_patch = patches.target_cells(),
            .least_mass = patches.least_mass(),
            .columns = column_text(patches.layout())};
  }

  SimulationState present_state() const {
    SimulationState state{.run = run_state(), .patches = {}, .sizes = {}, .bytes = {}};
    std::vector<int> position;
    for (int i = 0; i < patches.size(); ++i) {
      if (!has_state(patches[i])) continue;
      position.push_back(i);
      state.patches.push_back(patches[i].topology.patch);
      state.sizes.push_back(static_cast<Index>(packed_bytes(patches[i])));
    }
    state.bytes = [this, position](std::size_t i) { return pack(patches[position[i]], step); };
    return state;
  }

  bool checkpoint_due() const {
    const Index every = model.output.checkpoint_steps;
    return observer.checkpoint && (checkpoint_requested || (every > 0 && step % every == 0));
  }

  void write_checkpoint() {
    checkpoint_asked = false;
    checkpoint_requested = false;
    observer.checkpoint(present_state());
  }

  // --- time -------------------------------------------------------------------------------------

  /// The smallest limit of all patches; `where` receives a description of the limiting particle.
  double present_limit(std::string* where = nullptr) const {
    double least = std::numeric_limits<double>::infinity();
    for (int i = 0; i < patches.size(); ++i) {
      Local p = -1;
      const double limit =
          time_step_limit<Dim>(patches[i], model, patches[i].runs, where ? &p : nullptr);
      if (limit < least && p >= 0) *where = describe_particle(patches[i].particles, p);
      least = std::min(least, limit);
    }
    const double of_all = ranks.min(least);
    if (where && ranks.several()) of_one_rank(least == of_all, *where);
    return of_all;
  }

  /// The text of the first rank that has it.
  void of_one_rank(bool has, std::string& text) const {
    const auto rank = static_cast<Index>(ranks.rank());
    const Index first = ranks.min(has ? rank : static_cast<Index>(ranks.size()));
    if (first < ranks.size()) ranks.broadcast(text, static_cast<int>(first));
  }

  double adaptive_dt(double limit) const {
    return std::min(model.analysis.step.safety * limit, model.analysis.step.dt);
  }

  /// The limit that particles have which may come in at the beginning of a step; where nothing else
  /// limits it, of those that come later, too.
  double limit_with_injections(Step step, double limit) const {
    double any = std::numeric_limits<double>::infinity();
    for (std::size_t g = 0; g < injection_limits.size(); ++g) {
      const auto& injection = model.injections[g];
      if (injection.active(time_at(step))) limit = std::min(limit, injection_limits[g]);
      if (time_at(step) < injection.end) any = std::min(any, injection_limits[g]);
    }
    return std::isfinite(limit) ? limit : any;
  }

  void check_first_dt(double limit) const {
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

  void set_first_dt() {
    const TimeStep& plan = model.analysis.step;
    double limit = present_limit();
    if (plan.adaptive) last_limit = limit;
    if (plan.adaptive) limit = limit_with_injections(0, limit);
    dt[0] = plan.adaptive ? std::min(adaptive_dt(limit), model.analysis.end_time) : plan.dt;
    start_time[0] = 0.0;
    start_time[1] = dt[0];
    if (plan.adaptive && dt[0] >= model.analysis.end_time) nsteps = std::min<Index>(nsteps, 1);
    if (!plan.adaptive) {
      check_first_dt(limit);
      limit_steps_by_time();
    }
  }

  /// With a fixed step, the end time is a number of steps.
  void limit_steps_by_time() {
    const TimeStep& plan = model.analysis.step;
    if (std::isfinite(model.analysis.end_time))
      nsteps = std::min(nsteps, static_cast<Index>(std::ceil(model.analysis.end_time / plan.dt *
                                                             (1 - rounding_of_time))));
  }

  /// The least limit that this rank's patches found in the last step.
  double own_limit() const {
    double limit = std::numeric_limits<double>::infinity();
    for (int i = 0; i < patches.size(); ++i) limit = std::min(limit, patches[i].time_step_limit);
    return limit;
  }

  /// dt of `step` and, with it, the time at which the next one begins.
  void set_dt(Step step) {
    set_dt(step, exchange ? agreed_limit[step] : own_limit());
  }
  void set_dt(Step step, double limit) {
    limit = limit_with_injections(step, limit);
    // Without particles there is no limit: go on as before.
    dt[step] = std::isfinite(limit) || step == 0 ? adaptive_dt(limit) : dt[step - 1];
    const double left = model.analysis.end_time - start_time[step];
    const bool last = left <= dt[step] * (1 + rounding_of_time);
    if (last) dt[step] = left;
    start_time[step + 1] = start_time[step] + dt[step];
    if (last) {  // nobody has begun the step after this one: it needs this dt
      nsteps = step + 1;
      executor->stop_before(step + 1);
    }
  }

  double time_at(Step step) const {
    return model.analysis.step.adaptive ? start_time[step]
                                        : static_cast<double>(step) * model.analysis.step.dt;
  }

  double dt_of(Step step) const {
    return model.analysis.step.adaptive ? dt[step] : model.analysis.step.dt;
  }

  /// What the stages of a step may read, but for dt where it may not be known yet.
  StepContext<Dim> context(Step step, bool has_dt = false) const {
    return {&model, &patches.partition(), step, time_at(step),
            has_dt ? dt_of(step) : std::numeric_limits<double>::quiet_NaN()};
  }

  // --- tasks ------------------------------------------------------------------------------------

  std::vector<Stage> stage_list() const {
    std::vector<Stage> list;
    for (const auto& stage : stages) list.push_back(stage.stage);
    return list;
  }

  void build_executor() {
    TaskGraph graph = make_task_graph(tasks_of(phases), patches.neighbours(), ranks.several(),
                                      static_cast<int>(patches.elsewhere().size()));
    const auto n = static_cast<std::size_t>(patches.size());
    poisoned.assign(n, 0);
    balance.begin(patches);
    timing.resize(n * stages.size());
    TaskBodies bodies{[this](int phase, int p, Step step) { run_task(phase, p, step); },
                      [this](Step step) { set_dt(step); }, [this](Step step) { complete(step); }};
    switch (options.mode) {
      case ExecutionOptions::Mode::serial:
        executor = make_serial_executor(std::move(graph), std::move(bodies));
        break;
      case ExecutionOptions::Mode::random_order:
        executor = make_random_executor(std::move(graph), std::move(bodies), options.seed);
        break;
      case ExecutionOptions::Mode::bulk:
        connect_ranks();
        executor = make_bulk_executor(std::move(graph), std::move(bodies), options.threads,
                                      exchange.get());
        break;
      case ExecutionOptions::Mode::flow_graph:
        connect_ranks();
        executor = make_flow_executor(std::move(graph), std::move(bodies), options.threads,
                                      options.verify, exchange.get());
    }
    first_dt_stage = 0;
    for (std::size_t s = 0; s < stages.size(); ++s) {
      if (stages[s].stage.needs_dt && first_dt_stage == 0) first_dt_stage = s;
      if (stages[s].stage.name == locate_stage) locate_index = s;
      if (stages[s].stage.name == output_stage) output_index = s;
    }
  }

  void connect_ranks() {
    if (!ranks.several()) return;
    // Receives of the one before must be cancelled on all ranks before any sends by the new one.
    exchange.reset();
    ranks.wait_for_all();
    if (!groups) groups.emplace(ranks);
    exchange = std::make_unique<RankExchange<Dim>>(
        *groups, patches, rank_messages(stages, phases), step,
        ExchangeCalls{.give = [this](Step s) { return give(s); },
                      .take = [this](Step s, const Agreement& found) { agreed[s] = found; },
                      .give_limit = [this] { return own_limit(); },
                      .take_limit = [this](Step s, double limit) { agreed_limit[s] = limit; },
                      .failed_step = [this] { return failed_step.load(); },
                      .failure_elsewhere = [this](Step s) { learn_of_failure(s); },
                      .others = [this] { poll(); }},
        InjectedLatency{options.latency});
  }

  /// By one thread at a time, the one that may call MPI.
  void poll() {
    if (!observer.poll || poll_failure) return;
    try {
      observer.poll();
    } catch (...) {  // a full disk, for example
      poll_failure = std::current_exception();
      stop_asked = true;
    }
  }

  void run_task(int phase, int p, Step step) {
    if (p >= patches.size()) {
      exchange->unpack(phase, p - patches.size(), step);
      return;
    }
    if (balance.samples(step)) {
      const std::int64_t begin = thread_nanoseconds();
      run_own_task(phase, p, step);
      balance.add(step, p, thread_nanoseconds() - begin, patches[p].count);
    } else {
      run_own_task(phase, p, step);
    }
    if (exchange) exchange->send(phase, p, step);
  }

  /// A task: one phase of one patch.
  void run_own_task(int phase_index, int p, Step step) {
    const Phase& phase = phases[static_cast<std::size_t>(phase_index)];
    Patch<Dim>& patch = patches[p];
    char& poison = poisoned[static_cast<std::size_t>(p)];
    StageClock clock(&timing[static_cast<std::size_t>(p) * stages.size()]);
    try {
      if (poison || step > failed_step.load()) {
        // A failed patch does no work but still takes part, so that everybody can stop together.
        // Nor do others in later steps, which would read what the failed patch did not write.
        if (phase.first == 0) take_unmapped(patch);
        if (phase.first <= locate_index && locate_index < phase.last) clear_outboxes(patch);
      } else {
        run_stages(phase, p, step, clock);
      }
    } catch (const std::exception& error) {
      fail(phase.first, p, step, error.what());
    } catch (...) {
      fail(phase.first, p, step, "unknown exception");
    }
    clock.finish(phase.first, phase.last);
  }

  /// So that no particle is missing from the last state.
  static void take_unmapped(Patch<Dim>& patch) {
    receive(patch);
    patch.late.clear();
  }

  /// The same for those that were taken out of their runs before a stage failed on a later chunk.
  void take_back_movers(Patch<Dim>& patch, Step step) const {
    place_movers(patch, context(step));
    patch.mark = {};
  }

  void run_stages(const Phase& phase, int p, Step step, StageClock& clock) {
    Patch<Dim>& patch = patches[p];
    if (phase.first == 0 || !patch.idle) {
      const bool has_dt = !model.analysis.step.adaptive || phase.first >= first_dt_stage;
      const bool locates = phase.last > locate_index;  // then dt of this step is known
      std::optional<BorrowedNodalState<Dim>> borrowed;
      if (phase.first > 0 && !keeps_nodal_state(model.analysis)) borrowed.emplace(patch);
      const std::size_t failed = run_phase(
          patch, stages, phase.first, phase.last, context(step, has_dt),
          locates ? context(step + 1) : StepContext<Dim>{}, [&](std::size_t s) { clock.lap(s); });
      if (patch.mark.kind != Mark::Kind::none) {
        fail(failed, p, step, describe_mark(patch.mark, Dim));
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
      if (patch.mark.kind != Mark::Kind::none)
        fail(output_index, p, step, describe_mark(patch.mark, Dim));
    }
  }

  void fail(std::size_t s, int p, Step step, const std::string& cause) {
    poisoned[static_cast<std::size_t>(p)] = 1;
    patches[p].mark = {};
    failures.add({step, static_cast<int>(s), stages[s].stage.name, time_at(step),
                  patches[p].topology.patch, cause});
    learn_of_failure(step);
    request_stop(step);
  }

  void learn_of_failure(Step step) {
    lower(failed_step, step);
  }

  static void lower(std::atomic<Step>& value, Step to) {
    Step present = value.load();
    while (to < present && !value.compare_exchange_weak(present, to)) {
    }
  }

  /// By a task of a step: patches stop together max_lead steps later, those of other ranks because
  /// they hear of it when they agree that the step is done.
  void request_stop(Step step) {
    lower(stop_step, step + max_lead);
    executor->request_stop(step);
  }

  // --- agreement --------------------------------------------------------------------------------

  /// What this rank knows when its patches have done `step`.
  Agreement give(Step step) {
    if (stop_asked.load() || checkpoint_asked.load()) lower(stop_step, step + max_lead);
    Agreement own;
    own.least.stop_before = stop_step.load();
    own.least.failed_step = failed_step.load();
    own.least.rebuild = rebuild_needed.load() ? -1 : 0;
    own.least.checkpoint = checkpoint_asked.load() ? -1 : 0;
    own.least.stop = stop_asked.load() ? -1 : 0;
    if (history_due(step)) {
      RowSums sums;
      double fastest = 0;
      for (const HistoryRow& part : rows[step]) {
        sums.add(part);
        fastest = std::max(fastest, part.max_speed);
      }
      own.least.minus_speed = -std::bit_cast<Index>(fastest);
      own.sum = sums.elements();
    }
    if (log.due(time_at(step))) {
      std::vector<Index> events;
      for (auto& of_patch : injected[step])
        for (const Index event : std::exchange(of_patch, {})) events.push_back(event);
      const std::vector<Index> elements = log.elements(events);
      own.sum.insert(own.sum.end(), elements.begin(), elements.end());
    }
    balance.finish(step);
    if (balance.is_due(step)) {
      const Index work = balance.work();
      own.least.minus_work = -work;
      own.sum.push_back(work);
    }
    return own;
  }

  // --- output -----------------------------------------------------------------------------------

  bool history_due(Step step) const {
    return (step + 1) % history_steps == 0;
  }
  bool frame_due(Step step) const {
    return (observer.frame || observer.large_frame) && model.output.frame_steps > 0 &&
           (step + 1) % model.output.frame_steps == 0;
  }
  bool copy_due(Step step) const {
    return observer.frame && !frames_are_large() && frame_due(step);
  }

  /// Frames are too large to be copied.
  bool frames_are_large() const {
    return observer.large_frame && frame_size > options.copied_frame_bytes;
  }

  /// Where the graph has to drain: at `end`, or before it at a frame that is not copied or at a
  /// checkpoint.
  Step drain_step(Step end) const {
    end = std::min<Step>(end, nsteps);  // dt of the last step may have shown that it is the last
    const auto before = [&](bool drains, Index every) {
      if (drains && every > 0) end = std::min<Step>(end, (step / every + 1) * every);
    };
    before(frames_are_large(), model.output.frame_steps);
    before(static_cast<bool>(observer.checkpoint), model.output.checkpoint_steps);
    before(balance.forced_every() > 0, balance.forced_every());
    return end;
  }

  /// The output stage: copy what is due; nobody in the loop waits for more. (Frames too large to be
  /// copied: advance().)
  void output(int p, Step step) {
    const auto i = static_cast<std::size_t>(p);
    if (may_be_unstable(p, step)) check_limit(p, step);
    if (history_due(step) || frame_due(step)) check_finite(patches[p]);
    if (history_due(step)) rows[step][i] = sums(patches[p]);
    if (copy_due(step)) pieces[step][i] = snapshot(patches[p], model);
  }

  bool may_be_unstable(int p, Step step) const {
    const TimeStep& plan = model.analysis.step;
    if (plan.adaptive || plan.accept_unstable) return false;
    const Patch<Dim>& patch = patches[p];
    return (step + 1) % limit_check_steps == 0 || step + 1 == nsteps ||
           plan.dt * (wave_speed_bound + patch.max_speed) > patch.smallest_cell;
  }

  void check_limit(int p, Step step) {
    const double used = dt_of(step);
    if (!(used > time_step_limit<Dim>(patches[p], model, patches[p].runs))) return;
    Local limiting = -1;
    const double limit = time_step_limit<Dim>(patches[p], model, patches[p].runs, &limiting);
    fail(output_index, p, step,
         unstable_message(used, limit, describe_particle(patches[p].particles, limiting)) + " " +
             unstable_hint(limit));
  }

  /// All patches are done with `step`. Steps arrive in order, one call at a time.
  void complete(Step step) {
    attempt([&] { hand_on(step); });
  }

  /// What fails on one rank, as on a full disk, must not keep it from what all ranks do.
  void attempt(auto action) {
    try {
      action();
    } catch (...) {
      if (!output_failure) output_failure = std::current_exception();
      stop_asked = true;
    }
  }

  void hand_on(Step step) {
    if (!exchange) agreed[step] = give(step);
    const Agreement::Least& least = agreed[step].least;
    executor->stop_before(least.stop_before);
    if (least.rebuild < 0) rebuild_needed = true;
    if (least.checkpoint < 0) checkpoint_requested = true;
    if (least.stop < 0) stop_requested = true;
    learn_of_failure(least.failed_step);
    // All ranks find the same, and nobody has begun the step before which they stop.
    if (balance.is_due(step) && balance.is_uneven(-least.minus_work, agreed[step].sum.back())) {
      remap_needed = true;
      executor->stop_before(step + max_lead);
    }
    if (log.due(time_at(step)))
      log.take(step, std::span(std::as_const(agreed[step].sum))
                         .subspan(history_due(step) ? RowSums::n_elements : 0, log.n_elements()));
    // Patches that are ahead may have failed in a later step: this one is still good.
    const bool failed = least.failed_step <= step;
    if (history_due(step) && !failed) {
      HistoryRow row = RowSums::row(agreed[step].sum, std::bit_cast<double>(-least.minus_speed));
      finish_row(row, step + 1);
      if (observer.history) attempt([&] { observer.history(row); });
    }
    if (copy_due(step) && !failed) {
      for (Frame& piece : pieces[step]) log.make_dense(piece.id);
      attempt([&] { observer.frame({header_at(step + 1), std::move(pieces[step])}); });
      pieces[step].assign(static_cast<std::size_t>(patches.size()), {});
    }
    if (observer.checkpoint_wanted && observer.checkpoint_wanted()) checkpoint_asked = true;
    if (observer.progress && !observer.progress(step + 1, time_at(step + 1))) stop_asked = true;
    if (!exchange && (stop_asked || checkpoint_asked)) {  // no other rank has to hear of it first
      stop_requested = stop_asked.load();
      checkpoint_requested = checkpoint_asked.load();
      executor->request_stop(step);
    }
  }

  /// Turn sums since the last row into sums since the start.
  void finish_row(HistoryRow& row, Step step) {
    work += PatchWork{row.internal, row.external, row.damping};
    complete_row(row, step, work);
  }

  void complete_row(HistoryRow& row, Step step, const PatchWork& since_start) const {
    row.step = step;
    row.time = time_at(step);
    row.dt = step > 0 ? dt_of(step - 1) : 0.0;
    row.internal = since_start.internal;
    row.external = since_start.external;
    row.damping = since_start.damping;
    row.balance = row.kinetic + row.internal + row.damping - row.external - start_row.kinetic;
  }

  /// Sums at rest (between calls of advance()), leaving the patches' work untouched.
  HistoryRow present_row() {
    RowSums all;
    double fastest = 0;
    for (int i = 0; i < patches.size(); ++i) {
      const PatchWork kept = patches[i].work;
      const HistoryRow part = sums(patches[i]);
      patches[i].work = kept;
      all.add(part);
      fastest = std::max(fastest, part.max_speed);
    }
    std::vector<Index> elements = all.elements();
    ranks.sum(elements);
    HistoryRow row = RowSums::row(elements, ranks.max(fastest));
    PatchWork since_start = work;
    since_start += PatchWork{row.internal, row.external, row.damping};
    complete_row(row, step, since_start);
    return row;
  }

  FrameHeader header_at(Step at) const {
    FrameHeader header = frame_header<Dim>(patches.layout(), model);
    header.step = at;
    header.time = time_at(at);
    return header;
  }

  Frame of_all_ranks(Frame own) const {
    if (!ranks.several()) return own;
    const auto gather = [&](auto& values) {
      values = ranks.gather_all(std::span(std::as_const(values)));
    };
    gather(own.id);
    gather(own.material);
    gather(own.coordinates);
    for (FrameColumn& column : own.columns) gather(column.values);
    sort_by_id(own);
    return own;
  }

  FrameSource present_frame() const {
    std::vector<const Patch<Dim>*> all;
    for (int i = 0; i < patches.size(); ++i) all.push_back(&patches[i]);
    FrameSource frame = lahar::frame_source(all, header_at(step), model);
    if (!log.empty())
      frame.piece = [this, piece = std::move(frame.piece)](std::size_t i) {
        Frame one = piece(i);
        log.make_dense(one.id);
        return one;
      };
    if (is_parallel(options)) frame.threads = options.threads;
    return frame;
  }

  // --- epochs -----------------------------------------------------------------------------------

  /// Between two calls the graph drains only where patches have to be created, or where a frame is
  /// written that is too large to be copied.
  void advance(Index steps) {
    const Step end = std::min<Step>(step + steps, nsteps);
    stop_requested = false;
    stop_asked = false;
    while (step < end && step < nsteps && !stop_requested) {
      const auto n = static_cast<std::size_t>(patches.size());
      for (Step s = 0; s < max_lead + 2; ++s) {
        rows[s].assign(n, {});
        pieces[s].assign(n, {});
        injected[s].assign(n, {});
      }
      rebuild_needed = false;
      stop_step = std::numeric_limits<Step>::max();
      step = executor->run(step, drain_step(end));
      count_removed();
      stop_where_failed();
      // Before particles are delivered: then it is in the order of frames that were copied.
      if (frames_are_large() && frame_due(step - 1)) observer.large_frame(present_frame());
      settle();
      take_dense_ids();
      if (step >= nsteps) check_end();
      // dt of the next step, which the drained graph did not get to.
      if (model.analysis.step.adaptive) last_limit = ranks.min(own_limit());
      if (model.analysis.step.adaptive && step < nsteps) set_dt(step, last_limit);
      if (ranks.any(rebuild_needed || needs_surroundings())) rebuild();
      if (std::exchange(remap_needed, false) || balance.is_forced(step)) remap();
      if (checkpoint_due()) write_checkpoint();
    }
  }

  /// The message of the failure that comes first of all ranks.
  std::string first_failure() const {
    constexpr Index none = std::numeric_limits<Index>::max();
    const bool own = failures.by(step);
    const Failure first = own ? failures.earliest() : Failure{};
    const Index stage = ranks.min(own ? Index{first.stage_index} : none);
    const bool in_stage = own && first.stage_index == stage;
    const Index patch = ranks.min(in_stage ? first.patch : none);
    const Index failed = ranks.sum(failures.count(step));
    std::string message = own ? failure_message(first, ranks.rank(), failed) : "";
    of_one_rank(in_stage && first.patch == patch, message);
    return message;
  }

  /// On all ranks, with the message of the rank that failed first.
  void stop_where_failed() {
    if (ranks.any(!failures.empty())) {
      step = ranks.min(failed_step.load());
      throw SimulationError(first_failure());
    }
    if (!output_failure) output_failure = poll_failure;
    if (!ranks.any(static_cast<bool>(output_failure))) return;
    if (output_failure) std::rethrow_exception(output_failure);
    throw IoError("another rank could not write its part of the results");
  }

  /// Deliver the particles that are on their way: what the first stage of the next step would do.
  void settle() {
    for (int p = 0; p < patches.size(); ++p) stages[0].begin(patches[p], context(step));
    for (int p = 0; p < patches.size(); ++p) clear_outboxes(patches[p]);
    for (RemotePatch<Dim>& from : patches.elsewhere()) clear(from);
  }

  /// While no particle is on its way: then a checkpoint needs no log of injections, and what has
  /// been written so far is forgotten.
  void take_dense_ids() {
    if (log.empty()) return;
    for (int p = 0; p < patches.size(); ++p) log.make_dense(patches[p].particles.id);
    log.clear();
    measure_frame();
  }

  /// What the last step did and no other looked at.
  void check_end() {
    for (int p = 0; p < patches.size(); ++p) {
      check_finite(patches[p]);
      if (patches[p].mark.kind != Mark::Kind::none)
        fail(output_index, p, step - 1, describe_mark(patches[p].mark, Dim));
    }
    stop_where_failed();
  }

  /// Also where a particle came near in the last step.
  bool needs_surroundings() const {
    for (int p = 0; p < patches.size(); ++p)
      if (patches[p].needs_surroundings) return true;
    return false;
  }

  void rebuild() {
    keep_timings();
    patches.rebuild();
    build_executor();
  }

  void remap() {
    if (step >= nsteps || !balance.remap(patches, step, nsteps - step)) return;
    keep_timings();
    build_executor();
  }

  void count_removed() {
    for (int i = 0; i < patches.size(); ++i) {
      removed += patches[i].removed;
      patches[i].removed = 0;
    }
  }

  void keep_timings() {
    kept_timing = timings();
    timing.clear();
  }

  std::vector<StageTiming> timings() const {
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

  ExecutionOptions options;
  Observer observer;
  Model<Dim> model;
  std::vector<TimestepStage<Dim>> stages;
  std::vector<Phase> phases;
  Ranks ranks;
  std::vector<double> injection_limits;  ///< [s] by generator
  PatchSet<Dim> patches;
  InjectionLog log;
  RankBalance<Dim> balance;
  bool remap_needed = false;
  std::optional<ExchangeGroups> groups;         ///< several ranks only
  std::unique_ptr<RankExchange<Dim>> exchange;  ///< several ranks only
  std::unique_ptr<Executor> executor;
  PerStep<Agreement> agreed;
  PerStep<double> agreed_limit;
  std::size_t locate_index = 0, output_index = 0, first_dt_stage = 0;

  Index nsteps = 0, history_steps = 1;
  std::size_t frame_size = 0;   ///< [bytes] of a frame, of the rank with most of it
  double wave_speed_bound = 0;  ///< [m/s] of all materials
  Step step = 0;                ///< steps done
  PerStep<double> dt, start_time;
  /// [s] least of all particles in the last step, when the graph is drained; adaptive runs.
  double last_limit = std::numeric_limits<double>::infinity();

  std::vector<char> poisoned;
  FailureList failures;
  std::atomic<Step> failed_step{std::numeric_limits<Step>::max()};
  std::exception_ptr output_failure, poll_failure;
  std::atomic<bool> rebuild_needed{false};
  std::atomic<bool> stop_asked{false};                            ///< of this rank
  std::atomic<bool> stop_requested{false};                        ///< all ranks know of it
  std::atomic<bool> checkpoint_asked{false};                      ///< of this rank
  std::atomic<bool> checkpoint_requested{false};                  ///< all ranks know of it
  std::atomic<Step> stop_step{std::numeric_limits<Step>::max()};  ///< not taken any more
  Index removed = 0;

  HistoryRow start_row;
  PatchWork work;  ///< since the start, up to the last history row
  PerStep<std::vector<HistoryRow>> rows;
  PerStep<std::vector<Frame>> pieces;
  PerStep<std::vector<std::vector<Index>>> injected;  ///< events, by patch
  std::vector<StageTicks> timing;                     ///< per patch and stage
  std::vector<StageTiming> kept_timing;               ///< of patch sets before
};

template <int Dim>
Simulation<Dim>::Simulation(Model<Dim> model, ExecutionOptions options, Observer observer)
    : impl_(std::make_unique<Impl>(std::move(model), options, std::move(observer))) {}

template <int Dim>
Simulation<Dim>::Simulation(Model<Dim> model, ExecutionOptions options, Observer observer,
                            const SimulationState& state)
    : impl_(std::make_unique<Impl>(std::move(model), options, std::move(observer), &state)) {}

template <int Dim>
Simulation<Dim>::~Simulation() = default;

template <int Dim>
void Simulation<Dim>::advance(Index steps) {
  impl_->advance(steps);
}

template <int Dim>
void Simulation<Dim>::run() {
  impl_->advance(impl_->nsteps - impl_->step);
}

template <int Dim>
Frame Simulation<Dim>::frame() const {
  return impl_->of_all_ranks(join(impl_->present_frame()));
}

template <int Dim>
FrameSource Simulation<Dim>::frame_source() const {
  return impl_->present_frame();
}

template <int Dim>
void Simulation<Dim>::poll() {
  if (!impl_->exchange) return;
  const auto lock = impl_->exchange->lock_mpi();
  if (impl_->observer.poll) impl_->observer.poll();
}

template <int Dim>
HistoryRow Simulation<Dim>::history() const {
  return impl_->present_row();
}

template <int Dim>
SimulationState Simulation<Dim>::state() const {
  return impl_->present_state();
}

template <int Dim>
Index Simulation<Dim>::step() const {
  return impl_->step;
}

template <int Dim>
double Simulation<Dim>::time() const {
  return impl_->time_at(impl_->step);
}

template <int Dim>
bool Simulation<Dim>::finished() const {
  return impl_->step >= impl_->nsteps;
}

template <int Dim>
SimulationInfo Simulation<Dim>::info() const {
  SimulationInfo info;
  info.threads = is_parallel(impl_->options) ? impl_->options.threads : 1;
  info.cells = impl_->model.mesh->n_cells();
  info.nodes = impl_->model.mesh->n_nodes();
  const Ranks& ranks = impl_->ranks;
  info.particles = ranks.sum(impl_->patches.particles());
  info.removed = ranks.sum(impl_->removed);
  info.patches = static_cast<int>(impl_->patches.all_patches().size());
  info.tasks_per_step = static_cast<int>(impl_->phases.size()) * info.patches +
                        (impl_->executor->graph().has_dt ? 1 : 0);
  info.cells_per_patch = impl_->patches.target_cells();
  info.dt_limit = impl_->present_limit();
  info.dt = impl_->dt_of(impl_->step);
  const auto bytes = static_cast<Index>(impl_->patches.bytes());
  info.bytes = static_cast<std::size_t>(ranks.sum(bytes));
  info.most_bytes = static_cast<std::size_t>(ranks.max(bytes));
  return info;
}

template <int Dim>
const BalanceReport& Simulation<Dim>::balance() const {
  return impl_->balance.report();
}

template <int Dim>
std::vector<StageTiming> Simulation<Dim>::timings() const {
  return impl_->timings();
}

template <int Dim>
const TaskGraph& Simulation<Dim>::graph() const {
  return impl_->executor->graph();
}

template <int Dim>
PatchGraph Simulation<Dim>::patch_graph() const {
  return impl_->patches.graph();
}

template <int Dim>
std::vector<std::string> Simulation<Dim>::patch_names() const {
  std::vector<std::string> names;
  for (int i = 0; i < impl_->patches.size(); ++i) {
    const auto& patch = impl_->patches[i];
    names.push_back(fmt::format("patch {}: {} cells, {} particles", patch.topology.patch,
                                patch.topology.cells.size(), patch.count));
  }
  return names;
}

template class Simulation<2>;
template class Simulation<3>;

}  // namespace lahar
