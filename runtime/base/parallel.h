/// \file A loop on several threads, outside of the task graph: at start-up only.
#pragma once

#include <functional>

namespace lahar {

/// Call `body(i)` for 0 <= i < n, each once, on up to `threads` threads (0 = all cores this process
/// may use). Returns when all are done; throws what one of them threw.
void parallel_for(int threads, int n, const std::function<void(int)>& body);

}  // namespace lahar
