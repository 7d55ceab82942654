/// \file Recording a run: the trace files of all ranks, from before the first step to after the
/// last.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "graph/stage_loop.h"
#include "runtime/comm/communicator.h"
#include "runtime/trace/record/recorder.h"

namespace lahar {

/// How ticks of this rank's clock and of rank 0's belong together at one time.
struct ClockReading {
  std::uint64_t tick = 0;  ///< here
  double offset = 0;       ///< [ticks] of rank 0's clock minus ours at that time
  double bound = 0;        ///< [ticks] that the offset may be wrong by: half of a round trip
};

/// Ranks on the machine of rank 0 have its clock; others find it by the shortest of several
/// round trips (Cristian 1989). Collective.
ClockReading read_clock(const Communicator& ranks);

/// What a trace says of its run beside its steps.
struct TraceAbout {
  std::string version, title, scheme, executor;
  bool adaptive = false;
  int threads = 1;
  double latency = 0;  ///< [s]
};

class TraceSession {
 public:
  /// Begins a trace in the run folder, which exists; an earlier one there is removed. Collective.
  TraceSession(const std::filesystem::path& run, TraceWindow window, const Communicator& ranks,
               const TraceAbout& about, const std::vector<StageLoop>& loops,
               const std::string& graph);
  ~TraceSession();  ///< of a run that failed: without a tail, the trace is not complete
  TraceSession(const TraceSession&) = delete;
  TraceSession& operator=(const TraceSession&) = delete;

  /// Ends it. Collective. Returns the records of all ranks.
  Index finish();

 private:
  Communicator ranks_;
  ClockReading begin_;
  std::unique_ptr<TraceRecorder> recorder_;
};

}  // namespace lahar
