/// \file The driver of a simulation in 2D or 3D: it owns the parts of a run, and joins them. Its
/// run loop and what is done at rest are in simulation_driver.cpp, tasks of a step in
/// simulation_tasks.cpp, what follows when all patches have done a step in
/// simulation_completion.cpp.
#pragma once

#include <atomic>
#include <exception>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "graph/executor.h"
#include "runtime/exchange/rank_exchange.h"
#include "runtime/exchange/run_failures.h"
#include "runtime/step/checkpoint_stager.h"
#include "runtime/step/epochs.h"
#include "runtime/step/gauges.h"
#include "runtime/step/implicit_solver.h"
#include "runtime/step/load_steps.h"
#include "runtime/step/lost_particles.h"
#include "runtime/step/output_schedule.h"
#include "runtime/step/pressure_solver.h"
#include "runtime/step/rest_test.h"
#include "runtime/step/rigid_motion.h"
#include "runtime/step/run_frames.h"
#include "runtime/step/run_history.h"
#include "runtime/step/run_nodes.h"
#include "runtime/step/run_watch.h"
#include "runtime/step/simulation.h"
#include "runtime/step/slide_notice.h"
#include "runtime/step/stage_times.h"
#include "runtime/step/staging_budget.h"
#include "runtime/step/step_limits.h"
#include "runtime/step/step_trace.h"
#include "runtime/step/timestep.h"

namespace lahar {

/// Functions of the first group are those of Simulation.
template <int Dim>
class SimulationDriver {
 public:
  SimulationDriver(Model<Dim> model, ExecutionOptions options, Observer observer,
                   const SimulationState* state);
  SimulationDriver(const SimulationDriver&) = delete;
  SimulationDriver& operator=(const SimulationDriver&) = delete;
  ~SimulationDriver();

  void advance(Index steps);
  void run() { advance(time_.most_nsteps() - step_); }
  Frame frame() const { return frames_.present_of(ranks_, step_); }
  FrameSource frame_source() const { return frames_.present(step_, threads()); }
  std::optional<FramePieces> nodes() const { return nodes_.kept(step_); }
  std::vector<PatchParticles> particles_in_place() const;
  void poll();
  HistoryRow history();
  std::vector<GaugeTable> gauge_tables() const { return gauges_.tables(); }
  GaugeRows gauges();
  std::vector<double> maps() const { return gauges_.state().maps; }
  SimulationState state() const;
  Index step() const { return step_; }
  double time() const { return time_.time_at(step_); }
  bool finished() const { return step_ >= time_.nsteps(); }
  SimulationInfo info() const;
  const SolveCounts& solves() const { return solves_; }
  BalanceReport balance() const { return epochs_.balance().report(); }
  std::vector<StageTiming> timings() const { return times_.all(); }
  const TaskGraph& graph() const { return executor_->graph(); }
  std::vector<std::string> patch_names() const;
  PatchGraph patch_graph() const { return patches_.graph(); }
  std::vector<Index> patch_counts() const;
  std::vector<StageLoop> loops() const;
  std::string trace_graph() const { return lahar::trace_graph(patches_, step_); }

 private:
  // --- beginning --------------------------------------------------------------------------------

  std::vector<Stage> stages() const;
  PatchSet<Dim> make_patches(const SimulationState* state);
  /// With the model's particles, or those of the state in which another run ended.
  void start(const SimulationState* state);
  /// Go on from the numbers of a state whose patches exist already.
  void resume(const RunState& run);

  // --- at rest ----------------------------------------------------------------------------------

  void prepare_copies();
  void hand_on_large_frame();
  /// Implicit steps: find the displacement of the next one, and how long the one after it may be.
  /// Throws SimulationError where there is none.
  void find_equilibrium();
  ImplicitReport try_step();
  /// The next step is adaptive, and not yet the smallest one.
  bool can_be_cut() const {
    return time_.is_adaptive() && !load_steps_.is_smallest(time_.dt_of(step_));
  }
  std::string no_equilibrium(const ImplicitReport& report) const;
  /// Projections: the same of the pressure.
  void find_pressure();
  /// Where the graph has to drain: at `end`, or before it at what needs all patches at rest.
  Step drain_step(Step end) const;
  /// All particles that have left the mesh since the last call, on all ranks alike: in an order
  /// that does not depend on when this is called.
  void take_removed();
  bool removes_particles() const {
    return model_.analysis.remove_leaving_particles || model_.changes.takes_time();
  }
  /// Deliver the particles that are on their way: what the first stage of the next step would do.
  void settle();
  /// While no particle is on its way: then nobody needs the log of injections so far.
  void take_dense_ids();
  /// What the last step did and no other looked at.
  void check_end();
  /// dt of the next step, which the drained graph did not get to.
  void plan_next_step();
  void change_patches();
  /// End the run here where it has come to rest.
  void test_rest();
  void write_checkpoint();

  // --- tasks ------------------------------------------------------------------------------------

  void build_executor();
  void connect_ranks();
  void build_solver();
  /// What the stages of a step may read, but for dt where it may not be known yet.
  StepContext<Dim> context(Step step, bool has_dt = false) const;
  /// The task of a patch of another rank, whose message has come.
  void take_message(int phase, int p, Step step);
  void run_task(int phase, int p, Step step, bool with_rest);
  /// A task of a patch of this rank, or two: one phase, with or without its rest.
  void run_own_task(const Phase& phase, int p, Step step, StageClock& clock);
  void idle(const Phase& phase, Patch<Dim>& patch, Step step) const;
  void run_stages(const Phase& phase, int p, Step step, StageClock& clock);
  /// The stages of a phase that are kernels. Returns the one that recorded a fault.
  std::size_t run_kernels(const Phase& phase, int p, Step step, StageClock& clock);
  bool locates(const Phase& phase) const { return phase.last > locate_index_; }
  /// So that no particle is missing from the last state: those that were taken out of their bins
  /// before a stage failed on a later chunk.
  void take_back_movers(Patch<Dim>& patch, Step step) const;
  void fail_with_fault(std::size_t stage, int p, Step step);
  void fail(std::size_t stage, int p, Step step, const std::string& cause);
  /// By a task of a step: patches stop together max_lead steps later, those of other ranks because
  /// they hear of it when they agree that the step is done.
  void request_stop(Step step);
  /// Before anybody integrates in a step: its dt where it is adaptive, from the limit of all
  /// particles or that of LoadSteps, and where free rigid bodies move in it.
  void set_dt(Step step, double limit);
  bool sets_dt() const { return time_.is_adaptive() || rigid_.any_free(); }
  /// The output stage: copy what is due; nobody in the loop waits for more. (Frames too large to be
  /// copied: advance().)
  void output(int p, Step step);

  // --- completion of a step ---------------------------------------------------------------------

  /// What this rank knows when its patches have done `step`.
  Agreement give(Step step);
  /// All patches are done with `step`. Steps arrive in order, one call at a time.
  void finish_step(Step step);
  /// One was asked for, as all ranks hear after `step`.
  void plan_checkpoint(Step step);
  /// What was injected in `step`, as all ranks know. Where copies of frames or states may have
  /// outgrown the memory for them, the graph drains, and their sizes are found anew.
  void take_injected(Step step);
  void hand_on_row(Step step);
  void hand_on_gauges(Step step);
  void hand_on_copies(Step step);
  void ask_observer(Step step);
  /// The numbers when `at` steps are done, but for those that a part of a run fills in.
  RunState run_state(Step at) const;
  /// By one thread at a time, the one that may call MPI.
  void poll_observer();
  /// What fails on one rank, as on a full disk, must not keep it from what all ranks do.
  void attempt(auto action) {
    try {
      action();
    } catch (...) {
      failures_.keep(std::current_exception());
      stop_asked_ = true;
    }
  }
  void warn(const std::string& text) {
    if (observer_.warning) attempt([&] { observer_.warning(text); });
  }

  bool is_parallel() const {
    return options_.mode == ExecutionOptions::Mode::flow_graph ||
           options_.mode == ExecutionOptions::Mode::bulk;
  }
  int threads() const { return is_parallel() ? options_.threads : 1; }
  bool sums_due(Step step) const { return schedule_.history_due(step) || watch_.due(step); }
  bool gauges_due(Step step) const {
    return observer_.gauges && gauges_.any() && schedule_.gauges_due(step);
  }
  bool frames_are_large() const {
    return observer_.large_frame && !budget_.has_room_for(frames_.bytes());
  }
  bool frame_due(Step step) const {
    return (observer_.frame || observer_.large_frame) && schedule_.frame_due(step);
  }
  bool copy_due(Step step) const {
    return observer_.frame && !frames_are_large() && frame_due(step);
  }

  ExecutionOptions options_;
  Observer observer_;
  Model<Dim> model_;
  std::vector<TimestepStage<Dim>> stages_;
  Communicator ranks_;
  std::vector<Phase> phases_;   ///< the tasks of a patch
  std::optional<Phase> whole_;  ///< the one that has a rest, with it
  std::size_t locate_index_ = 0, output_index_ = 0, first_dt_stage_ = 0;
  RunWatch<Dim> watch_;
  LostParticles<Dim> lost_;
  PatchSet<Dim> patches_;
  RestTest<Dim> rest_;
  InjectionLog log_;
  double begin_time_ = 0;  ///< [s] when this simulation was made
  StepLimits<Dim> limits_;
  TimeControl time_;
  LoadSteps load_steps_;
  RigidMotion<Dim> rigid_;
  OutputSchedule schedule_;
  RunHistory history_;
  Gauges<Dim> gauges_;
  RunFrames<Dim> frames_;
  RunNodes<Dim> nodes_;
  CheckpointStager<Dim> stager_;
  StagingBudget budget_;
  Epochs<Dim> epochs_;
  StepTrace trace_;
  StageTimes times_;
  RunFailures failures_;
  std::optional<ExchangeGroups> groups_;         ///< several ranks only
  std::unique_ptr<RankExchange<Dim>> exchange_;  ///< several ranks only
  std::unique_ptr<Executor> executor_;
  // Implicit steps and projections only; groups on several ranks only.
  std::optional<ImplicitGroups> implicit_groups_;
  std::optional<PressureGroups> pressure_groups_;
  std::optional<ImplicitSolver<Dim>> implicit_;
  std::optional<PressureSolver<Dim>> pressure_;
  SolveCounts solves_;
  SlideNotice slides_;
  PerStep<Agreement> agreed_;
  PerStep<double> agreed_limit_;
  PerStep<std::vector<std::vector<Index>>> injected_;  ///< events, by patch
  Step step_ = 0;                                      ///< steps done
  std::atomic<bool> stop_asked_{false};                ///< of this rank
  std::atomic<bool> stops_{false};                     ///< all ranks know of it
  AtomicLeast stop_before_;                            ///< a step that is not taken any more
};

}  // namespace lahar
