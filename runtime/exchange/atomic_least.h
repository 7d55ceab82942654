/// \file The least number that any thread has given.
#pragma once

#include <atomic>
#include <limits>

#include "graph/stage.h"

namespace lahar {

class AtomicLeast {
 public:
  static constexpr Step none = std::numeric_limits<Step>::max();
  Step get() const { return least_.load(); }
  void give(Step step) {
    Step present = least_.load();
    while (step < present && !least_.compare_exchange_weak(present, step)) {
    }
  }
  void clear() { least_ = none; }

 private:
  std::atomic<Step> least_{none};
};

}  // namespace lahar
