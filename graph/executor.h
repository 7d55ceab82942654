/// \file Executing the step graph over and over. Flow graphs, which take steps in parallel, are in
/// local_flow.h (one process) and distributed_flow.h (several ranks).
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "graph/task_graph.h"

namespace lahar {

/// How far a patch may run ahead of the slowest one, in steps. Bounds what buffers have to hold,
/// and makes "stop at the same step" possible without a barrier: a request made in step n takes
/// effect at the beginning of step n + max_lead.
inline constexpr Step max_lead = 4;

/// Threads that this process may use (affinity respected).
int available_threads();
/// TBB may use so many threads from now on, also more than there are cores. Nothing lowers the
/// limit again: TBB warns of each arena that wants more threads than the limit of that moment.
void allow_threads(int threads);

/// What the executor calls. Bodies of different tasks run concurrently where the graph allows it.
struct TaskBodies {
  /// Run `stage` of `patch` for `step`. Must not throw: failures are recorded and a stop requested.
  std::function<void(int stage, int patch, Step step)> run;
  /// What all patches have given sets dt of `step`; all stages that give it in step - 1 are done.
  /// Where steps have several rounds (TaskGraph), that of a round, and rounds are counted.
  std::function<void(Step step)> set_dt;
  /// All patches have finished `step`. Called once per step, in order, one call at a time.
  std::function<void(Step step)> completed;
  /// Several ranks: around the time in which a thread without a task looks for messages, and with
  /// what came the last time (true = it is over). For traces; may be empty.
  std::function<void(bool over)> looking = {};
  /// Run `stage` of `patch` together with the next one, its rest. Empty: they are run one by one.
  std::function<void(int stage, int patch, Step step)> run_with_rest = {};
  /// For traces: a clock, which is 0 while nothing is recorded. May be null.
  std::uint64_t (*clock)() = nullptr;
};

class Executor;

/// What connects the graph of one rank with those of the others. Any thread may call; what takes
/// time goes on while others work.
class Remote {
 public:
  virtual ~Remote() = default;
  /// Look for messages and agreements that are complete and hand them to the executor: arrived(),
  /// dt_agreed(), step_agreed(). False = there was nothing.
  virtual bool progress(Executor& executor) = 0;
  /// Send what tasks have for other ranks. Unless `all`, what takes time to send may wait for
  /// another call, or for one of progress().
  virtual void post(bool all) = 0;
  /// This rank's patches have given dt of `step` (or round): find that of all ranks, for
  /// dt_agreed(). Steps in order.
  virtual void give_dt(Step step) = 0;
  /// This rank's patches have finished `step`: find out when all ranks have, for step_agreed().
  /// Steps in order.
  virtual void give_step(Step step) = 0;
  /// Whether threads that wait have cores of their own, which nobody else wants meanwhile.
  virtual bool has_cores() const { return false; }
  /// Wait until all ranks have come here: not while steps are taken as a graph.
  virtual void wait_for_all() = 0;
};

/// Executes steps [first, end) of a step graph. Results must not depend on the kind.
class Executor {
 public:
  Executor(TaskGraph graph, TaskBodies bodies)
      : graph_(std::move(graph)), bodies_(std::move(bodies)) {}
  virtual ~Executor() = default;

  /// Returns the step after the last one taken: `end`, or earlier after request_stop().
  virtual Step run(Step first, Step end) = 0;

  /// Called from a body in `step`: all patches stop together before step + max_lead (or earlier if
  /// that was requested before). Any thread.
  void request_stop(Step step);

  /// Called from set_dt of the step before: nobody takes `step` or a later one.
  void stop_before(Step step);

  /// Several ranks: the message for a stage of a patch elsewhere (a column of the graph).
  virtual void arrived(int /*stage*/, int /*patch*/) {}
  /// Several ranks: dt of `step` (or round) can be set.
  virtual void dt_agreed(Step /*step*/) {}
  /// Several ranks: all have finished `step`, and all steps before.
  virtual void step_agreed(Step /*step*/) {}

  const TaskGraph& graph() const { return graph_; }

  /// For traces, by the body of a task of the graph: when the last of what it waited for had come;
  /// 0 = not known.
  std::uint64_t ready_at(int task) const { return noted(ready_at_, task); }
  /// The same of the task that a message fires: the beginning of the last look for messages that
  /// did not bring it.
  std::uint64_t missed_at(int task) const { return noted(missed_at_, task); }

 protected:
  /// `stage` of `patch` and its rest.
  void run_with_rest(int stage, int patch, Step step) const {
    if (bodies_.run_with_rest) return bodies_.run_with_rest(stage, patch, step);
    bodies_.run(stage, patch, step);
    bodies_.run(stage + 1, patch, step);
  }

  TaskGraph graph_;
  TaskBodies bodies_;
  std::atomic<Step> end_{0};
  /// By task; empty while nothing is recorded.
  std::vector<std::uint64_t> ready_at_, missed_at_;

 private:
  static std::uint64_t noted(const std::vector<std::uint64_t>& times, int task) {
    return times.empty() ? 0 : times[static_cast<std::size_t>(task)];
  }
};

/// Ways to execute a graph: results must not depend on it.
enum class ExecutionMode { flow_graph, bulk, serial, random_order };

struct ExecutorOptions {
  ExecutionMode mode = ExecutionMode::flow_graph;
  int threads = 1;         ///< flow graph and bulk
  bool verify = false;     ///< flow graph: as in make_local_flow()
  std::uint64_t seed = 1;  ///< random order only
};
/// For one rank's share of a graph, if there is a `remote`, which must outlive the executor.
std::unique_ptr<Executor> make_executor(TaskGraph graph, TaskBodies bodies,
                                        const ExecutorOptions& options, Remote* remote = nullptr);

/// Stage after stage, patch after patch, one thread: the reference.
std::unique_ptr<Executor> make_serial_executor(TaskGraph graph, TaskBodies bodies);

/// Ready tasks in random order, one thread: a test that the edges are all that is needed.
std::unique_ptr<Executor> make_random_executor(TaskGraph graph, TaskBodies bodies,
                                               std::uint64_t seed);

/// Phase after phase, all patches in parallel, and after each phase everybody waits for everybody,
/// as codes without a graph do: for comparison.
std::unique_ptr<Executor> make_bulk_executor(TaskGraph graph, TaskBodies bodies, int threads,
                                             Remote* remote = nullptr);

}  // namespace lahar
