/// \file Time spent in the stages of all patches.
#pragma once

#include <vector>

#include "graph/stage.h"
#include "runtime/base/stage_clock.h"
#include "runtime/step/simulation.h"

namespace lahar {

class StageTimes {
 public:
  explicit StageTimes(const std::vector<Stage>& stages) : sums_(stages.size()) {
    for (std::size_t s = 0; s < stages.size(); ++s) sums_[s].name = stages[s].name;
  }
  /// For so many patches from now on.
  void begin(int patches) {
    sums_ = all();
    ticks_.assign(static_cast<std::size_t>(patches) * sums_.size(), {});
  }
  /// For a task of a patch, which alone uses it.
  StageClock clock(int patch) {
    return StageClock(&ticks_[static_cast<std::size_t>(patch) * sums_.size()]);
  }
  std::vector<StageTiming> all() const;

 private:
  std::vector<StageTicks> ticks_;  ///< by patch and stage
  std::vector<StageTiming> sums_;  ///< of patches before
};

}  // namespace lahar
