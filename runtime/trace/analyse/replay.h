/// \file Replays: how long a recorded run would have taken on another machine.
///
/// The recorded tasks, with the times that they took, are executed again by a discrete-event
/// simulation: what a task waits for, who takes it, how far patches run ahead and what ranks agree
/// on are as in the executor. What a replay does not know: threads of a machine share its caches
/// and its memory, and a network's links are shared by messages; tasks and messages take as long as
/// alone. A trace from as many threads per machine as are replayed has the former in its times.
#pragma once

#include <string>
#include <vector>

#include "runtime/trace/analyse/log.h"
#include "runtime/trace/analyse/network.h"

namespace lahar {

struct ReplayMachine {
  int ranks = 0, threads = 0;  ///< threads of each rank; 0 = as recorded
  Network network = {};
  bool bulk_synchronous = false;  ///< a barrier after each phase
};

struct Replay {
  ReplayMachine machine;  ///< with everything filled in
  int recorded_ranks = 1, recorded_threads = 1;
  double recorded = 0;  ///< [s] that the recorded steps took
  double total = 0;     ///< [s] that they take here
  double pauses = 0;    ///< [s] of it in which patches were made, split or moved, as recorded
  std::vector<double> step_time = {};  ///< [s] by step
  std::vector<double> useful = {};     ///< [s] by rank, in tasks of own patches
  double efficiency = 1;               ///< useful time over that of all workers
  double load_balance = 1;             ///< mean over largest useful time of workers
  double by_ranks = 1;                 ///< the same of ranks
  double communication = 1;            ///< efficiency / load_balance = serialisation * transfer
  double ideal_total = 0;              ///< [s] with an ideal network
  double serialisation = 1;            ///< largest useful time of a worker over ideal_total
  double transfer = 1;                 ///< ideal_total over total
  double exposed = 0;                  ///< [s] of idle workers whose rank had a message under way
  std::int64_t messages = 0;
  double bytes = 0;
  std::vector<std::string> notes = {};  ///< what was assumed

  double time_per_step() const {
    return step_time.empty() ? 0 : total / static_cast<double>(step_time.size());
  }
};

/// Throws InputError if the trace lacks tasks.
Replay replay(const TraceLog& log, const ReplayMachine& machine);

/// For people, and for programs (JSON).
std::string text_of(const Replay& replay);
std::string json_of(const Replay& replay);

}  // namespace lahar
