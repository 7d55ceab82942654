/// \file Wall time, for reports.
#pragma once

#include <chrono>

namespace lahar {

/// [s] since some moment, for differences.
inline double seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace lahar
