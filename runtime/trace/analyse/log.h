/// \file The trace of a run, read back from the files of all ranks and put together: times of all
/// ranks on one clock, messages with both their ends, tasks with what they waited for.
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "graph/stage.h"
#include "runtime/trace/record/record.h"

namespace lahar {

/// A run and its timestep, as the heads of its trace files say.
struct TraceRun {
  struct PhaseInfo {
    std::string name = {};      ///< "multiply"; of a solver's loop "solve: multiply"
    std::string exchange = {};  ///< what it takes from neighbours; empty = nothing
    bool gives_dt = false, needs_dt = false;
    std::vector<std::string> stages = {};
  };
  /// A list of stages that is a graph of its own: the time step, or one of its solver. Its turns
  /// are steps, or rounds.
  struct Loop {
    std::string name = {};
    int first = 0, last = 0;  ///< phases [first, last)
    int phases() const { return last - first; }
  };
  std::string id = {};  ///< the same in all files of a run
  std::string version, title, scheme, executor;
  int ranks = 1;
  std::vector<int> threads = {};  ///< workers, by rank
  std::vector<std::string> hosts = {};
  bool adaptive = false;               ///< has a dt task
  double latency = 0;                  ///< [s] injected per message
  std::vector<PhaseInfo> phases = {};  ///< of all loops, one after the other
  std::vector<Loop> loops = {};        ///< that of the time step first
  Step first = 0, last = 0;            ///< steps of which tasks were recorded
  double wall = 0;                     ///< [s] of the recorded steps
  double clock_bound = 0;  ///< [s] by which times of two ranks may be wrong against each other

  int loop_of(int phase) const;
  /// Steps begin with a solve: the graph of each loop is drained before another one begins.
  bool has_solves() const { return loops.size() > 1; }
};

/// A patch from a step on (balancing moves patches, splitting makes new ones).
struct TracePatch {
  int number = 0, rank = 0;
  std::int64_t cells = 0, particles = 0;  ///< at that time
  std::vector<int> neighbours = {};       ///< numbers
};

/// Patches of all ranks for the steps from `first` on.
struct TraceGraph {
  Step first = 0;
  std::map<int, TracePatch> patches = {};  ///< by number
};

/// A task that ran. Times in seconds since the first one of the run.
struct TraceTask {
  TraceKind kind = TraceKind::task;  ///< task, unpack or dt
  Step step = 0;
  Step round = -1;  ///< of a solver's loop, counted over the run
  /// Phase in the run's list; dt: the first one of its loop.
  int rank = 0, thread = 0, phase = 0, patch = 0;
  double ready = 0;  ///< when it could begin: noted by the executor, else `inputs_done`
  double begin = 0, end = 0;
  double released = 0;        ///< when its worker had posted its messages, too
  bool noted = false;         ///< `ready` is the executor's
  bool known_inputs = false;  ///< something that it waited for is in the trace
  bool from_rest = false;     ///< it waited for all tasks of the graph before: `last_input` is the
                              ///< last one of these
  double inputs_done = 0;     ///< when the last of these had ended, or come
  int last_input = -1;        ///< the task that this was, or -1
  int last_message = -1;      ///< the message that this was, or -1
  double without_last = 0;    ///< when it would have been ready without the last input
  double missed = 0;          ///< unpack: when the last look for its message began that did not
                              ///< find it; 0 = not known
  std::array<float, trace_stages> stage{};  ///< [s]

  Step turn() const { return round >= 0 ? round : step; }
};

/// A message between ranks, from a phase of a patch.
struct TraceMessage {
  Step step = 0;
  Step round = -1;  ///< as of tasks
  int phase = 0, patch = 0, from = 0, to = 0;
  std::int64_t bytes = 0;
  double packed = 0, sent = 0;    ///< packing begun and done
  double posted = 0;              ///< on its way, perhaps together with later ones
  double arrived = 0, given = 0;  ///< found; handed to the graph
  double there = 0;               ///< the earliest that it can have come: not before the last look
                                  ///< that did not find it; else `given`
  int sender = -1, unpack = -1;   ///< tasks

  Step turn() const { return round >= 0 ? round : step; }
};

/// Everything else that has a beginning and an end.
struct TraceInterval {
  TraceKind kind = TraceKind::poll;
  Step step = 0;
  Step round = -1;  ///< of a solver's loop; `rounds`: the first one
  int loop = 0;
  int rank = 0, thread = 0, which = 0;  ///< TraceAgreement
  double begin = 0, end = 0;
};

struct TraceValue {
  TraceCounter counter;
  int rank = 0;
  double time = 0, value = 0;
};

struct TraceLog {
  TraceRun run;
  std::vector<TraceGraph> graphs = {};  ///< ascending by step
  std::vector<TraceTask> tasks = {};    ///< by beginning
  /// Tasks that task t waited for: inputs[first_input[t]] to inputs[first_input[t + 1] - 1].
  std::vector<int> first_input = {}, inputs = {};
  std::vector<TraceMessage> messages = {};
  std::vector<TraceInterval> intervals = {};
  std::vector<TraceValue> counters = {};

  const TraceGraph& graph_at(Step step) const;
};

/// The folder of a run's trace.
inline std::filesystem::path trace_folder(const std::filesystem::path& run) {
  return run / "trace";
}
std::filesystem::path trace_file(const std::filesystem::path& run, int rank);

/// The trace in a run folder. Throws InputError where there is none, or where it is incomplete,
/// damaged, of another program or put together from several runs.
TraceLog read_trace(const std::filesystem::path& run);

}  // namespace lahar
