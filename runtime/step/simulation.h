/// \file A simulation: the model cut into patches, stepped by an executor of the task graph.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "graph/executor.h"
#include "graph/stage_loop.h"
#include "io/base/memory_limit.h"
#include "io/frames/frame.h"
#include "io/run/gauge_rows.h"
#include "io/run/history.h"
#include "physics/model/model.h"
#include "physics/particles/removed_particle.h"
#include "runtime/comm/communicator.h"
#include "runtime/patches/changed_particles.h"
#include "runtime/patches/rank_balance.h"
#include "runtime/patches/rank_partition.h"
#include "runtime/patches/simulation_state.h"
#include "runtime/solve/solve_result.h"
#include "runtime/step/patch_particles.h"

namespace lahar {

/// Time lost on purpose, to see what it does to a run; results stay the same.
struct StudyDelays {
  Index slow_patch = -1;   ///< number of a patch whose tasks take `slow_factor` times their time
  double slow_factor = 1;  ///< at least 1
  int late_rank = -1;      ///< rank whose threads wait `late` before each message
  double late = 0;         ///< [s]
  double serial = 0;       ///< [s] per step in which nothing else happens on a rank
};

/// How the timestep's tasks are executed. Results are bitwise the same for all of them.
struct ExecutionOptions {
  using Mode = ExecutionMode;
  Mode mode = Mode::flow_graph;
  int threads = 0;  ///< flow graph and bulk; 0 = all cores this process may use
  /// Flow graph and bulk. Each has a share of the patches, and all of them make the simulation and
  /// call its member functions, apart from step(), time(), finished(), timings() and graph(),
  /// together.
  Communicator ranks = {};
  BalanceOptions balance = {};
  double latency = 0;  ///< [s] held back from each message between ranks, for studies
  /// Messages between ranks of a machine do not go through MPI, except for many particles at once.
  bool shared_memory = true;
  StudyDelays delays = {};
  std::uint64_t seed = 1;  ///< random order only
  int support_rings = 0;   ///< extra layers of nodes that patches exchange; 0 suits linear elements
  bool verify = false;     ///< check at every task that exactly what its edges promise was done
  /// Frames, and states for checkpoints, up to this size [bytes], of the rank that has most of it,
  /// are copied by the tasks; of frames a few at a time. For larger ones there is no memory to
  /// spare: the computation waits while Observer::large_frame or Observer::checkpoint takes them
  /// from where the particles are. (So it does for states of runs that particles may leave.)
  std::size_t staging_bytes = default_staging_bytes;
  /// That this process may take; the same on all ranks. Throws InputError where it does not suffice
  /// for patches and particles.
  MemoryLimit memory = {};
};

/// Receives what a simulation produces while it runs; called from worker threads, one call at a
/// time each. With several ranks frames are those of the rank, history and progress are the same on
/// all.
struct Observer {
  /// When OutputPlan says so; pieces are this rank's patches, ascending.
  std::function<void(FramePieces&&)> frame;
  std::function<void(const HistoryRow&)> history;  ///< when OutputPlan says so
  /// Instead of `frame` for frames above ExecutionOptions::staging_bytes; good during the
  /// call, which all ranks make while no step is taken. Without this all frames are copied.
  std::function<void(const FrameSource&)> large_frame;
  /// After every step, in order: steps done and time [s]. Return false to stop soon.
  std::function<bool(Index step, double time)> progress;
  /// The state to be kept: after every OutputPlan::checkpoint_steps, and soon after
  /// `checkpoint_wanted`, asked after every step, said so. Good during the call, which all ranks
  /// make while no step is taken; or a copy (SimulationState::copied), and called while steps are
  /// taken.
  std::function<void(const SimulationState&)> checkpoint;
  std::function<bool()> checkpoint_wanted;
  /// Several ranks only: may call MPI and must not wait; called again and again while steps are
  /// taken, and by whoever waits for other ranks. What it throws ends the run.
  std::function<void()> poll;
  /// Particles that left the mesh since the last call, ascending by step and id, the same on all
  /// ranks; while no step is taken, before a checkpoint of that step.
  std::function<void(std::span<const RemovedParticle>)> removed;
  /// Something that the user should know; the same on all ranks, while steps are taken.
  std::function<void(const std::string&)> warning;
  /// Rows of gauges, when OutputPlan::measured says so; without this nothing is measured. The same
  /// on all ranks.
  std::function<void(const GaugeRows&)> gauges;
  /// The nodes (OutputPlan::node_fields) after a frame, large or not, of the same step; pieces are
  /// those of this rank's patches, and nodes that patches share are in the pieces of all of them.
  std::function<void(FramePieces&&)> nodes;
};

/// Time spent in one stage, summed over its tasks.
struct StageTiming {
  std::string name;
  Index calls = 0;
  double total = 0, shortest = 0, longest = 0;  ///< [s]; shortest and longest of one task
};

/// What implicit steps and projections took.
struct SolveCounts {
  Index steps = 0;
  Index iterations = 0;              ///< of Newton's method; projections have none
  Index in_parts = 0;                ///< steps whose loads could only be reached in parts
  Index cuts = 0;                    ///< of adaptive implicit steps (LoadSteps)
  Index linear_iterations = 0;       ///< direct solves have none
  double linearize = 0, linear = 0;  ///< [s] to find linear systems, and to solve them
  ProductCost products;              ///< of this rank
};

/// What a generator has injected since the simulation was made, and what its velocity would bring.
struct InjectedMass {
  double mass = 0;      ///< [kg]
  double expected = 0;  ///< [kg] by the area of its cells, but for what fills them at first
  double once = 0;      ///< [kg] that comes at a time
};

/// What a simulation consists of, for reports.
struct SimulationInfo {
  int threads = 1;
  SolveCounts solves = {};
  RestState rest = {};            ///< with Analysis::until
  ChangedParticles changed = {};  ///< by the stage, when it began
  Index cells = 0, nodes = 0, particles = 0, removed = 0;
  Index divided = 0;  ///< increments that materials could only do in parts, since the start
  int patches = 0, tasks_per_step = 0;
  Index cells_per_patch = 0;
  Index splits = 0;                         ///< of patches, since the start
  std::vector<InjectedMass> injected = {};  ///< by generator, where that is asked (Injection::flow)
  double mass_at_start = 0;                 ///< [kg]
  Index particles_at_start = 0;
  double energy_scale = 0;  ///< [J] of the watchdog: most that was put in; 0 without one
  double dt_limit = 0;      ///< [s] smallest h / (c + |v|) at present
  double dt = 0;            ///< [s] of the next step
  std::size_t bytes = 0;    ///< of particles and nodes, of all ranks
  /// At present, of the rank that has most of it.
  std::size_t frame_bytes = 0, state_bytes = 0;
  std::size_t all_frame_bytes = 0;  ///< of a frame of all ranks
};

template <int Dim>
class SimulationDriver;

/// A simulation of a model in two or three dimensions; who uses it need not know in how many.
class Simulation {
 public:
  /// Cuts the mesh, places the particles. Throws InputError (fixed step above the limit, ...).
  explicit Simulation(AnyModel model, ExecutionOptions options = {}, Observer observer = {});
  /// Goes on from the state() of a simulation of the same model, whose nsteps, end time and output
  /// may be others: all that follows has the bits as if nothing had come between. Throws InputError
  /// where the state is not one of this model, IoError where it is damaged.
  Simulation(AnyModel model, ExecutionOptions options, Observer observer,
             const SimulationState& state);
  Simulation(Simulation&&) noexcept;
  ~Simulation();

  /// Take `steps` steps (fewer where the end time comes first, or progress() asked to stop).
  /// Throws SimulationError; step() is then that of the failure, and patches are where they were
  /// when they learned of it, some of them up to max_lead steps ahead. (Not where it is a
  /// WatchdogError: all patches are then at step().)
  void advance(Index steps);
  /// Take all steps of the scenario.
  void run();

  Frame frame() const;  ///< present state of all ranks as frames have it, ascending particle id
  /// That of this rank without a copy, by patches; good until the next call of advance().
  FrameSource frame_source() const;
  /// The nodes of this rank after the last step, as Observer::nodes gets them; nothing where the
  /// scenario does not want them, or no step was taken to get here.
  std::optional<FramePieces> nodes() const;
  /// Particles as kernels see them, column by column; good until the next call of advance().
  std::vector<PatchParticles> particles_in_place() const;
  /// Several ranks: call Observer::poll when nobody else calls MPI. For whoever waits, while steps
  /// are taken or not. Throws what that threw, then and in all later calls: it is not called any
  /// more, and who waits for it would wait for ever.
  void poll();
  HistoryRow history() const;                    ///< present sums
  std::vector<GaugeTable> gauge_tables() const;  ///< what rows of gauges have
  /// Rows of the present state, which count as those of a step. Collective.
  GaugeRows gauges() const;
  /// Rasters as the last row left them, by MapKind; empty without maps.
  std::vector<double> maps() const;
  /// Present state, without a copy: good until the next call of advance().
  SimulationState state() const;
  Index step() const;     ///< steps done
  double time() const;    ///< [s]
  bool finished() const;  ///< no step left to take

  SimulationInfo info() const;
  SolveCounts solves() const;     ///< a part of info() that costs nothing
  BalanceReport balance() const;  ///< what balancing the ranks did
  std::vector<StageTiming> timings() const;
  const TaskGraph& graph() const;
  std::vector<std::string> patch_names() const;
  PatchGraph patch_graph() const;           ///< at present, with the work that was not measured yet
  std::vector<Index> patch_counts() const;  ///< particles of each of its patches
  /// What is executed as a graph: the time step, and before it what its solver does, in order.
  std::vector<StageLoop> loops() const;
  std::string trace_graph() const;  ///< this rank's patches, as in traces: JSON

 private:
  std::variant<std::unique_ptr<SimulationDriver<2>>, std::unique_ptr<SimulationDriver<3>>> driver_;
};

}  // namespace lahar
