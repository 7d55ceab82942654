/// \file What a simulation does for traces and studies beside its tasks.
#pragma once

#include <atomic>
#include <string>
#include <vector>

#include "runtime/base/stage_clock.h"
#include "runtime/exchange/per_step.h"
#include "runtime/patches/patch_set.h"
#include "runtime/trace/record/looking.h"
#include "runtime/trace/record/recorder.h"

namespace lahar {

/// Keep this thread busy [s], for studies.
void waste_time(double seconds, Step step);

/// The patches of this rank at rest, of which `first` is the next step, for a trace: JSON.
template <int Dim>
std::string trace_graph(const PatchSet<Dim>& patches, Step first);

/// Records of the tasks of steps, and what is counted beside them.
class StepTrace {
 public:
  /// `phases` must outlive it.
  explicit StepTrace(const std::vector<Phase>& phases) : phases_(phases) {}

  /// A message for a phase of a patch of another rank was taken.
  void add_unpacked(TraceRecorder& recorder, TraceRecord record, int phase, Index patch,
                    std::uint64_t missed) const;
  /// A task of an own patch and, where it was done with it, its rest; each with the time of its
  /// stages.
  void add_task(TraceRecorder& recorder, TraceRecord record, int phase, bool with_rest, Index patch,
                Index particles, const StageClock& clock);
  /// All patches have done a step; steps in order.
  void add_progress(Step done);

 private:
  const std::vector<Phase>& phases_;
  PerStep<std::atomic<Index>> particles_;  ///< of this rank's patches
  Index counted_particles_ = -1;           ///< the last that was recorded
  std::uint64_t next_counters_ = 0;        ///< ticks when counters are due
};

}  // namespace lahar
