/// \file Values that belong to a step.
#pragma once

#include <array>

#include "graph/executor.h"

namespace lahar {

/// Values that belong to a step: patches may be max_lead steps apart, and dt of the next is set
/// early.
template <class T>
class PerStep {
 public:
  T& operator[](Step step) { return values_[static_cast<std::size_t>(step) % values_.size()]; }
  const T& operator[](Step step) const {
    return values_[static_cast<std::size_t>(step) % values_.size()];
  }
  auto begin() { return values_.begin(); }
  auto end() { return values_.end(); }

 private:
  std::array<T, max_lead + 2> values_{};
};

}  // namespace lahar
