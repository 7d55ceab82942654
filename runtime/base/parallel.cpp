#include "runtime/base/parallel.h"

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
  allow_threads(threads);
  oneapi::tbb::task_arena arena(threads);
  arena.execute([&] { oneapi::tbb::parallel_for(0, n, body); });
}

}  // namespace lahar
