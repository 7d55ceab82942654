/// \file What a simulation consists of, for the files that implement it: beginning and what users
/// see (simulation.cpp), time (simulation_time.cpp), tasks of a step (simulation_tasks.cpp), what
/// leaves it (simulation_output.cpp), and what is done while no step is taken
/// (simulation_epochs.cpp, simulation_checkpoints.cpp).
#pragma once

#include <array>
#include <atomic>
#include <cmath>
#include <exception>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "graph/executor.h"
#include "physics/particles/patch_split.h"
#include "runtime/base/stage_clock.h"
#include "runtime/patches/patch_set.h"
#include "runtime/step/failure.h"
#include "runtime/step/injection_log.h"
#include "runtime/step/output_times.h"
#include "runtime/step/rank_exchange.h"
#include "runtime/step/simulation.h"
#include "runtime/step/timestep.h"
#include "runtime/step/watchdog.h"
#include "runtime/trace/record/recorder.h"

namespace lahar {

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

inline bool is_parallel(const ExecutionOptions& options) {
  return options.mode == ExecutionOptions::Mode::flow_graph ||
         options.mode == ExecutionOptions::Mode::bulk;
}

template <int Dim>
class SimulationDriver {
 public:
  SimulationDriver(Model<Dim> model_in, ExecutionOptions options_in, Observer observer_in,
                   const SimulationState* state = nullptr);
  SimulationDriver(const SimulationDriver&) = delete;
  SimulationDriver& operator=(const SimulationDriver&) = delete;
  ~SimulationDriver();

  /// Take all steps of the scenario.
  void run() { advance(nsteps - step); }
  Frame frame() const { return of_all_ranks(join(present_frame())); }
  void poll_outside_tasks();
  SimulationInfo info() const;
  std::vector<Index> patch_counts() const;
  std::vector<std::string> patch_names() const;

  PatchSet<Dim> make_patches(const SimulationState* state);
  void measure_frame();
  void need_memory_of_copies() const;
  void start();
  /// Steps between rows of history.csv: about 1 % of the run where the scenario does not say.
  Index history_interval(double first_dt) const;

  // --- state ------------------------------------------------------------------------------------

  /// Go on from the numbers of a state whose patches exist already.
  void restore(const RunState& run);
  void restore_dt(double last_dt);
  /// The numbers when `at` steps are done.
  RunState run_state(Step at) const;
  SimulationState present_state() const;
  /// [bytes] of the states of this rank's patches.
  std::size_t state_bytes() const;

  // --- checkpoints ------------------------------------------------------------------------------

  /// Whether the state after so many steps is to be kept.
  bool checkpoint_due(Step at) const {
    const Index every = model.output.checkpoint_steps;
    return observer.checkpoint &&
           (at == requested_checkpoint.load() || (every > 0 && at % every == 0));
  }
  /// Tasks copy the state of their patch at the beginning of `at`, when its particles have come.
  /// (At rest, what is due is not copied by tasks.)
  bool keeps(Step at) const { return copies_states && at > step && checkpoint_due(at); }
  /// Before steps are taken: tasks copy states where there is memory for that, and nobody may leave
  /// the mesh, which only a drained graph tells the observer.
  void begin_keeping();
  void keep(int p, Step at);
  /// All patches have done keep().
  void hand_on_kept(Step at);
  /// One was asked for, as all ranks hear after `step`.
  void plan_checkpoint(Step step);
  /// At rest.
  void write_checkpoint();
  void checkpoint_is_written(Step at);

  // --- time -------------------------------------------------------------------------------------

  /// The smallest limit of all patches; `where` receives a description of the limiting particle.
  double present_limit(std::string* where = nullptr) const;

  /// The text of the first rank that has it.
  void of_one_rank(bool has, std::string& text) const {
    const auto rank = static_cast<Index>(ranks.rank());
    const Index first = ranks.min(has ? rank : static_cast<Index>(ranks.size()));
    if (first < ranks.size()) ranks.broadcast(text, static_cast<int>(first));
  }

  double adaptive_dt(double limit) const {
    return std::min(model.analysis.step.safety * limit, model.analysis.step.dt);
  }

  void set_first_dt();
  /// dt of an adaptive step, from what is stable: shortened so that steps end at times of output
  /// and at the end. The time at which the next one begins goes with it. True: it is the last.
  bool plan_step(Step step, double stable);

  /// The limit that particles have which may come in at the beginning of a step; where nothing else
  /// limits it, of those that come later, too.
  double limit_with_injections(Step step, double limit) const;
  /// Throws InputError where a fixed step is above the limit.
  void check_first_dt(double limit) const;

  /// With a fixed step, the end time is a number of steps.
  void limit_steps_by_time();

  /// The least limit that this rank's patches found in the last step.
  double own_limit() const {
    double limit = std::numeric_limits<double>::infinity();
    for (int i = 0; i < patches.size(); ++i) limit = std::min(limit, patches[i].time_step_limit);
    return limit;
  }

  /// dt of `step` and, with it, the time at which the next one begins.
  void set_dt(Step step) { set_dt(step, exchange ? agreed_limit[step] : own_limit()); }
  void set_dt(Step step, double limit);

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

  void build_executor();
  void connect_ranks();

  /// By one thread at a time, the one that may call MPI.
  void poll();
  void run_task(int phase, int p, Step step, bool with_rest = false);

  /// A task of a patch of this rank, or two: one phase, with or without its rest.
  void run_own_task(const Phase& phase, int p, Step step, StageClock& clock);
  void record_unpacked(TraceRecorder& recorder, TraceRecord record, int phase, int p) const;
  /// The records of such a task and its rest, each with the time of its stages.
  void record_own_task(TraceRecorder& recorder, TraceRecord record, int phase, int p,
                       bool with_rest, const StageClock& clock);

  /// The patches of this rank as they are now, for a trace: JSON.
  std::string trace_graph() const;
  void record_graph() const;
  void record_progress(Step step);

  /// So that no particle is missing from the last state.
  static void take_unmapped(Patch<Dim>& patch);

  /// The same for those that were taken out of their bins before a stage failed on a later chunk.
  void take_back_movers(Patch<Dim>& patch, Step step) const;
  void run_stages(const Phase& phase, int p, Step step, StageClock& clock);
  void fail(std::size_t s, int p, Step step, const std::string& cause);
  void learn_of_failure(Step step) { lower(failed_step, step); }

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
  Agreement give(Step step);

  // --- output -----------------------------------------------------------------------------------

  /// Whether a multiple of `interval` [s] comes in a step: dt is known.
  bool reaches(Step step, double interval) const {
    return multiples_by(time_at(step + 1), interval) > multiples_by(time_at(step), interval);
  }
  bool history_due(Step step) const {
    return (history_steps > 0 && (step + 1) % history_steps == 0) ||
           (model.output.history_dt > 0 && reaches(step, model.output.history_dt));
  }
  bool plans_frames() const { return model.output.frame_steps > 0 || model.output.frame_dt > 0; }
  /// Frames that are planned up to the end of a step, but for the one of the beginning.
  Index frames_by(Step step) const {
    const OutputPlan& plan = model.output;
    const Step first = model.analysis.first_step;
    if (plan.frame_dt > 0)
      return multiples_by(time_at(step + 1), plan.frame_dt) -
             (first > 0 ? multiples_by(time_at(first), plan.frame_dt) : 0);
    return (step + 1) / plan.frame_steps - first / plan.frame_steps;
  }
  /// A frame is planned after this step, whether there may be so many or not.
  bool frame_planned(Step step) const {
    const OutputPlan& plan = model.output;
    return (plan.frame_steps > 0 && (step + 1) % plan.frame_steps == 0) ||
           (plan.frame_dt > 0 && reaches(step, plan.frame_dt));
  }
  bool frame_due(Step step) const {
    return (observer.frame || observer.large_frame) && plans_frames() && frame_planned(step) &&
           frames_by(step) <= model.output.max_frames;
  }
  bool copy_due(Step step) const {
    return observer.frame && !frames_are_large() && frame_due(step);
  }

  /// Frames are too large to be copied.
  bool frames_are_large() const {
    return observer.large_frame && frame_size > options.staging_bytes;
  }

  /// Frames are due that are copied now, but might grow too large for that.
  bool copies_frames() const {
    return observer.large_frame && plans_frames() && !frames_are_large();
  }

  // --- watchdog ---------------------------------------------------------------------------------

  bool watch_due(Step step) const { return judge.on() && (step + 1) % watch_steps == 0; }
  bool sums_due(Step step) const { return history_due(step) || watch_due(step); }
  void begin_watch();
  void restore_watch(const WatchdogState& state);
  /// By finish_step(), when the sums after a step are known.
  void watch(Step step, const HistoryRow& row, bool strained);
  /// By set_dt(), with what is stable.
  void watch_step(Step step, double stable);
  /// At rest: end the run where the watchdog said so, with a message that is the same for any
  /// ranks.
  void end_where_watched();
  void warn_once(const WatchdogAlarm& alarm);

  /// Where the graph has to drain: at `end`, or before it at a frame or a checkpoint that is not
  /// copied.
  Step drain_step(Step end) const;
  /// The step after which the next frame by time comes, as far as that is known.
  Step step_of_frame() const;

  /// The output stage: copy what is due; nobody in the loop waits for more. (Frames too large to be
  /// copied: advance().)
  void output(int p, Step step);
  bool may_be_unstable(int p, Step step) const;
  void check_limit(int p, Step step);

  /// All patches are done with `step`. Steps arrive in order, one call at a time.
  void complete(Step step) {
    attempt([&] { finish_step(step); });
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

  void finish_step(Step step);

  /// Turn sums since the last row into sums since the start.
  void finish_row(HistoryRow& row, Step step);
  void complete_row(HistoryRow& row, Step step, const PatchWork& since_start) const;

  /// Sums at rest (between calls of advance()), leaving the patches' work untouched.
  HistoryRow present_row();
  FrameHeader header_at(Step at) const;
  Frame of_all_ranks(Frame own) const;
  FrameSource present_frame() const;

  /// Whether patches with too many particles are looked for after `step`.
  bool split_due(Step step) const {
    return model.analysis.split_steps > 0 && (step + 1) % model.analysis.split_steps == 0;
  }
  /// Particles up to which a patch is not split.
  Index most_particles() const { return split_factor * model.analysis.patch_particles; }

  // --- epochs -----------------------------------------------------------------------------------

  /// Between two calls the graph drains only where patches have to be created, split or moved, or
  /// where a frame or a checkpoint is written that is not copied.
  void advance(Index steps);

  /// The message of the failure that comes first of all ranks.
  std::string first_failure() const;

  /// On all ranks, with the message of the rank that failed first.
  void stop_where_failed();

  /// Deliver the particles that are on their way: what the first stage of the next step would do.
  void settle();

  /// What was injected in `step`, as all ranks know. Where copies of frames or states may have
  /// outgrown the memory for them, the graph drains, and their sizes are found anew.
  void take_injected(Step step);

  /// While no particle is on its way: then nobody needs the log of injections so far.
  void take_dense_ids();

  /// What the last step did and no other looked at.
  void check_end();

  /// Also where a particle came near in the last step.
  bool needs_surroundings() const;
  /// Split what was found crowded max_lead steps ago. True if anything was.
  bool split_patches();
  void rebuild();
  /// Map the particles of patches that a split has made.
  void map_parts(const std::vector<Index>& parts);
  void remap();
  /// All particles that have left the mesh since the last call, on all ranks alike: in an order
  /// that does not depend on when this is called.
  void take_removed();
  void keep_timings() {
    kept_timing = timings();
    timing.clear();
  }

  std::vector<StageTiming> timings() const;

  ExecutionOptions options;
  Observer observer;
  Model<Dim> model;
  std::vector<TimestepStage<Dim>> stages;
  Communicator ranks;
  SpeedScales speeds;
  std::vector<Phase> phases;   ///< the tasks of a patch
  std::optional<Phase> whole;  ///< the one that has a rest, with it
  PatchSet<Dim> patches;
  std::vector<double> injection_limits;  ///< [s] by generator
  InjectionLog log;
  RankBalance<Dim> balance;
  bool remap_needed = false;
  std::optional<ExchangeGroups> groups;         ///< several ranks only
  std::unique_ptr<RankExchange<Dim>> exchange;  ///< several ranks only
  std::unique_ptr<Executor> executor;
  PerStep<Agreement> agreed;
  PerStep<double> agreed_limit;
  std::size_t locate_index = 0, output_index = 0, first_dt_stage = 0;
  Index nsteps = 0;
  Index history_steps = 1;      ///< 0 = rows come by time
  std::size_t frame_size = 0;   ///< [bytes] of a frame, of the rank with most of it
  double wave_speed_bound = 0;  ///< [m/s] of all materials
  Step step = 0;                ///< steps done
  PerStep<double> dt, start_time;
  PerStep<double> limit;  ///< [s] from which dt was taken; adaptive runs
  /// [s] least of all particles in the last step, when the graph is drained; adaptive runs.
  double last_limit = std::numeric_limits<double>::infinity();
  std::vector<char> poisoned;
  FailureList failures;
  std::atomic<Step> failed_step{std::numeric_limits<Step>::max()};
  std::exception_ptr output_failure, poll_failure;
  std::atomic<bool> rebuild_needed{false};
  /// By step: a patch of this rank is to be split.
  PerStep<std::atomic<bool>> crowded;
  /// By step: the list of removed particles of a patch is to be written.
  PerStep<std::atomic<bool>> full;
  /// Patches are split when so many steps are done, which follows from what was found max_lead
  /// steps before: the same step for any ranks and threads, whatever else makes the graph drain. -1
  /// = none.
  Step split_step = -1;
  WatchdogJudge judge;
  WatchdogAlarm step_alarm;  ///< of the time step, by set_dt(); its step is -1 where there is none
  Step step_alarm_end = -1;  ///< at which it ends the run; -1 = it does not
  std::atomic<bool> step_alarm_is_new{false};  ///< for finish_step() to warn
  std::array<bool, 4> warned{};                ///< by WatchdogAlarm::Kind
  PerStep<std::atomic<bool>> strained;        ///< by step: a patch of this rank has such a particle
  std::atomic<bool> stop_asked{false};        ///< of this rank
  std::atomic<bool> stop_requested{false};    ///< all ranks know of it
  std::atomic<bool> checkpoint_asked{false};  ///< of this rank
  std::atomic<Step> stop_step{std::numeric_limits<Step>::max()};  ///< not taken any more
  bool copies_states = false;                                     ///< for checkpoints, by tasks
  /// [bytes] of the largest copy of a rank, as measured at rest when the last id was this one.
  std::size_t largest_copy = 0;
  Index measured_ids = 0;
  /// The state after so many steps was asked for, as all ranks know; -1 = none. Steps that end
  /// earlier than `next_request` do not ask for another.
  std::atomic<Step> requested_checkpoint{-1};
  Step next_request = 0;
  RunState kept_run;                         ///< of the state that is being copied
  Index all_particles = 0, all_removed = 0;  ///< of all ranks, where tasks copy states
  Index removed = 0;
  HistoryRow start_row;
  PatchWork work;  ///< since the start, up to the last history row
  PerStep<std::vector<HistoryRow>> rows;
  PerStep<std::vector<Frame>> pieces;
  std::shared_ptr<SparePieces> spare = std::make_shared<SparePieces>();
  PerStep<std::vector<std::vector<std::byte>>> kept;  ///< for checkpoints, by patch
  PerStep<std::vector<std::vector<Index>>> injected;  ///< events, by patch
  std::vector<StageTicks> timing;                     ///< per patch and stage
  std::vector<StageTiming> kept_timing;               ///< of patch sets before
  // For traces.
  PerStep<std::atomic<Index>> active_particles;  ///< of this rank's patches
  Index counted_particles = -1;                  ///< the last that was recorded
  std::uint64_t next_counters = 0;               ///< ticks when counters are due
};

}  // namespace lahar
