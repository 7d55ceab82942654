#include "runtime/base/parallel.h"

#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include "graph/executor.h"

namespace lahar {

void parallel_for(int threads, int n, const std::function<void(int)>& body) {
  if (threads <= 0) threads = available_threads();
  if (threads == 1 || n <= 1) {
    for (int i = 0; i < n; ++i) body(i);
    return;
  }
  // Also more threads than cores, as a run does.
  const oneapi::tbb::global_control parallelism(
      oneapi::tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads));
  oneapi::tbb::task_arena arena(threads);
  arena.execute([&] { oneapi::tbb::parallel_for(0, n, body); });
}

}  // namespace lahar
