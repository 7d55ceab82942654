/// \file Putting together what belongs together in a trace.
#pragma once

#include <algorithm>
#include <limits>
#include <vector>

#include "runtime/trace/analyse/log.h"

namespace lahar {

/// The two ends of messages, as the ranks recorded them.
struct MessageEnds {
  std::vector<TraceMessage> sent, came;
};

/// First and last turn of each loop of which tasks were recorded.
class Turns {
 public:
  explicit Turns(const TraceRun& run) : run_(run), of_loop_(run.loops.size()) {}
  void add(const TraceTask& task) {
    Extent& extent = of_loop_[static_cast<std::size_t>(run_.loop_of(task.phase))];
    extent.first = std::min(extent.first, task.turn());
    extent.last = std::max(extent.last, task.turn());
  }
  Step first(int loop) const { return of_loop_[static_cast<std::size_t>(loop)].first; }
  /// How many there are from the first to the last.
  Step count(int loop) const {
    const Extent& extent = of_loop_[static_cast<std::size_t>(loop)];
    return std::max<Step>(0, extent.last - extent.first + 1);
  }
  /// Phases of all turns.
  double places() const {
    double sum = 0;
    for (int l = 0; l < static_cast<int>(of_loop_.size()); ++l)
      sum += static_cast<double>(count(l)) * run_.loops[static_cast<std::size_t>(l)].phases();
    return sum;
  }

 private:
  struct Extent {
    Step first = std::numeric_limits<Step>::max(), last = -1;
  };
  const TraceRun& run_;
  std::vector<Extent> of_loop_;
};

/// Sort the tasks by their beginning; find messages from their ends, what each task waited for, and
/// the extent of the log.
void link(TraceLog& log, MessageEnds ends);

}  // namespace lahar
