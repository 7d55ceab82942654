/// \file The recorded work in the form in which replays take it: times of tasks in tables, patches
/// with their neighbours, sizes of messages.
#pragma once

#include <map>
#include <string>
#include <tuple>
#include <vector>

#include "runtime/trace/analyse/log.h"

namespace lahar {

/// A stretch of steps with the same patches, or of rounds that a solver's loop took without a stop.
/// Patches are counted from 0 here, ascending.
struct ReplayEpoch {
  struct Message {
    double bytes = 0;
    double packing = 0;  ///< [s] from the end of the task, or of the packing before, to posting
  };

  int loop = 0;           ///< of ReplayWork
  std::size_t graph = 0;  ///< of the log: epochs of one have the same patches
  Step first = 0;         ///< turn of the loop, below called step
  int steps = 0;
  std::vector<int> rank;                     ///< by patch, as recorded
  std::vector<std::vector<int>> neighbours;  ///< by patch
  std::vector<std::int64_t> cells;           ///< by patch
  std::vector<float> duration;               ///< [s] by step, phase and patch
  std::vector<float> gap;         ///< [s] before these, in which the worker did nothing else
  std::vector<float> completion;  ///< [s] by step: what is done when a step is finished
  std::vector<float> dt;          ///< [s] by step: setting the time step
  double pause = 0;  ///< [s] before it, in which patches were made, split or moved, or a solver
                     ///< did what is no task
  std::map<std::tuple<int, int, int>, Message> messages;  ///< by phase, patch, receiver; means

  int patches() const { return static_cast<int>(rank.size()); }
  double work_of(int patch, int phases) const;  ///< [s] over all steps
};

/// The phases of a loop.
struct ReplayLoop {
  std::vector<TraceRun::PhaseInfo> phases;
  bool has_dt = false;
  std::vector<double> bytes_of_pair = {};  ///< by phase: of a message, per pair of neighbours
  std::vector<double> packing = {};        ///< [s] by phase: of a message
};

/// What a trace says about the cost of everything.
struct ReplayWork {
  std::vector<ReplayLoop> loops;  ///< that of the time step first
  int ranks = 1, threads = 1;     ///< recorded; threads of the rank that had most
  double wall = 0;                ///< [s] recorded
  double gap = 0;                 ///< [s] median of all
  double unpack = 0;              ///< [s] mean
  double latency = 0;             ///< [s] of messages; 0 where there were none
  bool has_messages = false;
  int dimensions = 2;               ///< guessed from neighbours
  std::vector<ReplayEpoch> epochs;  ///< as they followed each other

  const ReplayLoop& loop_of(const ReplayEpoch& epoch) const {
    return loops[static_cast<std::size_t>(epoch.loop)];
  }
  bool has_solves() const { return loops.size() > 1; }
};

/// Throws InputError if tasks are missing.
ReplayWork work_of(const TraceLog& log);

/// Patches dealt to ranks in contiguous chunks of equal weight, as near as may be; every rank has a
/// patch where there are enough.
std::vector<int> deal(const std::vector<double>& weights, int ranks);

}  // namespace lahar
