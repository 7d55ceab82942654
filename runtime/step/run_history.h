/// \file The rows of history.csv as a run goes on.
#pragma once

#include <span>
#include <vector>

#include "io/run/history.h"
#include "physics/particles/patch.h"
#include "runtime/comm/rank_agreements.h"
#include "runtime/step/history_sums.h"
#include "runtime/step/time_control.h"

namespace lahar {

/// Patches give their parts, and what stages did since their last ones. Ranks add them up in the
/// agreement of a step.
class RunHistory {
 public:
  /// `time` must outlive it; `bodies`: how many rigid ones there are.
  RunHistory(const TimeControl& time, std::size_t bodies) : time_(time), bodies_(bodies) {}
  std::size_t n_elements() const { return RowSums::n_elements(bodies_); }  ///< of Agreement::sum
  void begin(const HistoryRow& start) { start_ = start; }
  void resume(double kinetic_at_start, const PatchWork& work) {
    start_.kinetic = kinetic_at_start;
    work_ = work;
  }
  void make_room(std::size_t patches) {
    for (auto& parts : parts_) parts.assign(patches, {});
  }

  void add(int patch, Step step, const HistoryRow& part) {
    parts_[step][static_cast<std::size_t>(patch)] = part;
  }
  /// This rank's patches have done the step.
  void give(Step step, Agreement& own) const;
  /// The row after a step; steps in order.
  HistoryRow take(Step step, const Agreement& all);
  /// The row when `at` steps are done, of parts that are not counted. Collective.
  HistoryRow row_of(std::span<const HistoryRow> parts, Step at, const Communicator& ranks) const;

  const HistoryRow& start() const { return start_; }
  const PatchWork& work() const { return work_; }  ///< since the start, up to the last row

 private:
  void complete(HistoryRow& row, Step at, const PatchWork& since_start) const;

  const TimeControl& time_;
  std::size_t bodies_;
  HistoryRow start_;
  PatchWork work_;
  PerStep<std::vector<HistoryRow>> parts_;  ///< by patch
};

}  // namespace lahar
