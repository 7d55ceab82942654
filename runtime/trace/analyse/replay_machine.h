/// \file Discrete-event simulation of steps on ranks and threads: the engine of replays and
/// projections.
#pragma once

#include <vector>

#include "runtime/trace/analyse/network.h"
#include "runtime/trace/analyse/replay_work.h"

namespace lahar {

/// The steps of an epoch on a machine. Patches may be several copies of the recorded ones, one copy
/// after the other; each takes its times from recorded steps of its own choice.
struct ReplayCase {
  /// The messages of a patch after a phase: one per rank that has neighbours of it.
  struct Link {
    int rank = 0;
    std::vector<int> neighbours = {};  ///< there
    std::vector<float> time = {};      ///< [s] by phase: latency and transfer
    std::vector<float> packing = {};   ///< [s] by phase: of the sender, overhead included
    std::vector<float> bytes = {};     ///< by phase
  };
  struct Patch {
    int rank = 0;
    std::vector<int> neighbours;  ///< on the same rank
    std::vector<Link> links;
  };

  const ReplayWork* work = nullptr;
  const ReplayEpoch* epoch = nullptr;
  const ReplayLoop* loop = nullptr;  ///< of the epoch
  int ranks = 1, threads = 1, steps = 0;
  std::vector<Patch> patches;
  std::vector<int> source;  ///< by copy and step: the step of the epoch, from 0
  double unpacking = 0;     ///< [s] of a message, with overheads of the network and of the runtime
  double reduction = 0;     ///< [s] from the last rank's part until all may know
  std::vector<double> barrier;  ///< [s] by phase, of bulk-synchronous steps

  int phases() const { return static_cast<int>(loop->phases.size()); }
  bool exchanges(int phase) const {
    return !loop->phases[static_cast<std::size_t>(phase)].exchange.empty();
  }
  int following(int phase) const { return phase + 1 < phases() ? phase + 1 : 0; }
  bool sends(int phase) const { return exchanges(following(phase)); }
  int step_of(int step, int patch) const {
    return source[static_cast<std::size_t>(patch / epoch->patches() * steps + step)];
  }
  /// Where a task is in `duration` and `gap` of the epoch.
  std::size_t place(int step, int phase, int patch) const {
    const auto row = static_cast<std::size_t>(step_of(step, patch) * phases() + phase);
    return row * epoch->rank.size() + static_cast<std::size_t>(patch % epoch->patches());
  }
};

/// The network with what is not given filled in.
Network resolved(const Network& network, const ReplayWork& work);

/// Patches with these neighbours on these ranks; copies of the epoch's, one after the other. Its
/// `source`, `barrier` and `reduction` are those of a plain replay. Where ranks are those recorded
/// (`recorded`), so are sizes of messages and times of packing, else they are means.
ReplayCase make_case(const ReplayWork& work, const ReplayEpoch& epoch, const Network& network,
                     const std::vector<std::vector<int>>& neighbours, const std::vector<int>& rank,
                     int ranks, int threads, bool recorded);

/// What a simulation of steps found.
struct ReplayResult {
  double total = 0;              ///< [s] until all tasks of all steps are done
  std::vector<double> step_end;  ///< [s] by step, when all its tasks were done
  std::vector<double> useful;    ///< [s] by worker, rank by rank
  double exposed = 0;            ///< [s] of idle workers whose rank had a message under way
  std::int64_t messages = 0;
  double bytes = 0;
  /// [s] standard deviation over ranks of when they gave their part of a reduction (of the time
  /// step, or of finished steps); bulk-synchronous: by phase, of when they were done with it.
  std::vector<double> spread;
};

/// As a task graph: ready tasks first come, first served, those that others wait for first; patches
/// up to max_lead steps apart. As graph/distributed_flow.cpp has it, but for rests,
/// which all wait until nothing else is left, as there if the time step takes long.
ReplayResult simulate_graph(const ReplayCase& c);

/// Phase after phase with a barrier after each, as graph/bulk_executor.cpp has it.
ReplayResult simulate_bulk(const ReplayCase& c);

}  // namespace lahar
