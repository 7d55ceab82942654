/// \file What a trace says about where the time went.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "runtime/trace/analyse/log.h"

namespace lahar {

/// A list of stages that is a graph of its own: the time step, or a loop of its solver.
struct LoopUse {
  std::string name = {};
  std::int64_t turns = 0;  ///< steps, or rounds
  double wall = 0;         ///< [s] from the first to the last task of each graph, summed
};

/// One stage, over all its tasks.
struct StageUse {
  std::string loop = {}, phase = {}, stage = {};
  std::int64_t count = 0;
  double total = 0, mean = 0, p50 = 0, p95 = 0, longest = 0;  ///< [s]
  double share = 0;                                           ///< of the time that workers had
  double by_ranks = 1, by_threads = 1;  ///< imbalance: the most that one had over the mean
  double per_particle = 0;              ///< [s] per particle and step; 0 = not known
  double on_path = 0;                   ///< [s] of it on the critical path
};

/// Efficiencies of the POP centre of excellence (pop-coe.eu, "POP standard metrics"), with each
/// worker thread as a process: useful time is that in tasks of own patches.
/// parallel = load_balance * communication; communication = serialisation * transfer, the last two
/// from a replay with an ideal network where there are several ranks.
struct Efficiencies {
  double parallel = 1, load_balance = 1, communication = 1;
  double serialisation = 1, transfer = 1;
  bool replayed = false;  ///< serialisation and transfer are known
  double by_ranks = 1;    ///< load balance of ranks alone
};

/// What one worker did in the time of the run [s].
struct WorkerUse {
  int rank = 0, thread = 0;
  double useful = 0, messages = 0, polling = 0, runtime = 0, idle = 0;
  double other = 0;  ///< output, delays for studies, writing the trace
};

/// A piece of the path of tasks, messages and waits that decided when the run ended.
struct PathPart {
  enum class Kind {
    task,     ///< work of a task
    posting,  ///< from a task's end until its messages to other ranks were posted
    transit,  ///< from there until the last look for it that did not find it
    unseen,   ///< from there until it was handed to the graph: it may have come, nobody looked
    step,  ///< what one thread does when a step is finished, or waiting for it: patches may be at
           ///< most max_lead steps ahead
    time_step,  ///< the agreement on the time step
    sums,       ///< the reduction of the sums of a solver's round
    direct,     ///< a linear system was solved directly
    between,    ///< from the end of a graph to the beginning of the next: decisions of solvers
    start,      ///< a task was ready and a worker free
    barrier,    ///< the same in a bulk-synchronous run: others had not finished the phase
  } kind = Kind::task;
  double begin = 0, end = 0;
  int task = -1;  ///< that it leads to, or is; posting: whose messages
};
inline constexpr int path_kinds = 11;
/// How the executor of such runs is called in traces.
inline constexpr std::string_view bulk_executor_name = "bulk-synchronous";
std::string_view name_of(PathPart::Kind kind);

struct CriticalPath {
  std::vector<PathPart> parts;  ///< ascending; from the first task to the last
  std::vector<double> by_kind;  ///< [s], by PathPart::Kind
  double work = 0;              ///< [s] of all tasks of the run
  double longest_chain = 0;     ///< [s] of tasks that must follow each other, without any wait
  double speedup_left = 1;      ///< the run's time over longest_chain: what more cores can give
};

/// A task that waited long, and for what.
struct Wait {
  int task = -1;
  double time = 0;       ///< [s] from when everything but the last input had come
  std::string for_what;  ///< "integrate of patch 7, from rank 1"
};

/// A patch that took long.
struct PatchUse {
  int number = 0, rank = 0;
  std::int64_t particles = 0, cells = 0;
  double total = 0;         ///< [s]
  double over_mean = 1;     ///< its time over the mean of patches
  double per_particle = 0;  ///< [s] per particle and step
  std::string why;          ///< "3.1 times the particles", "2.2 times the time per particle"
};

/// Messages between two ranks.
struct ExchangeUse {
  std::int64_t messages = 0, bytes = 0;
  double in_flight =
      0;               ///< [s] from posting until they may have come (TraceMessage::there), summed
  double unseen = 0;   ///< [s] from there until they were found and handed on, summed
  double exposed = 0;  ///< [s] during which workers of the receiver were idle for a message
};

/// How far apart in steps the patches were.
struct StepSpread {
  double mean = 0;
  int largest = 0;
};

/// What costs most, in words: the main loss first.
struct Finding {
  std::string name;  ///< "imbalance", "late sender", "messages", "serial section", ...
  double loss = 0;   ///< [s] of the run's time; all findings and ideal_time add up to it
  std::string text;
};

struct TraceReport {
  std::vector<LoopUse> loops;  ///< that of the time step first
  std::vector<StageUse> stages;
  Efficiencies efficiencies;
  std::vector<WorkerUse> workers;
  CriticalPath path;
  std::vector<Wait> waits;        ///< the longest first
  std::vector<PatchUse> patches;  ///< the slowest first
  ExchangeUse exchange;
  StepSpread spread;
  std::vector<Finding> findings;  ///< the main loss first
  double ideal_time = 0;          ///< [s] all work spread evenly over all workers, without a wait
  /// Time of all tasks over what it were if each took the median of its phase and patch.
  double disturbance = 1;
};

/// From which disturbance on a machine is called disturbed: short tasks on a free one vary by less.
inline constexpr double disturbed = 1.3;

TraceReport analyse(const TraceLog& log);

/// What cannot be in a sound trace: tasks that ran never or twice, receives without a send,
/// negative durations, arrows into the past beyond the clocks' bound. Empty = sound.
std::vector<std::string> problems_of(const TraceLog& log);

/// For people, and for programs (JSON).
std::string text_of(const TraceLog& log, const TraceReport& report);
std::string json_of(const TraceLog& log, const TraceReport& report);

}  // namespace lahar
