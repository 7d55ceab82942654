#include "runtime/step/stage_times.h"

#include <algorithm>

namespace lahar {

std::vector<StageTiming> StageTimes::all() const {
  std::vector<StageTiming> all = sums_;
  const double second = seconds_per_tick();
  for (std::size_t i = 0; i < ticks_.size(); ++i) {
    const StageTicks& t = ticks_[i];
    StageTiming& sum = all[i % all.size()];
    if (t.calls == 0) continue;
    const double shortest = second * static_cast<double>(t.shortest);
    sum.shortest = sum.calls == 0 ? shortest : std::min(sum.shortest, shortest);
    sum.longest = std::max(sum.longest, second * static_cast<double>(t.longest));
    sum.calls += t.calls;
    sum.total += second * static_cast<double>(t.total);
  }
  return all;
}

}  // namespace lahar
