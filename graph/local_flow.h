/// \file The step graph of a single process as a oneTBB flow graph.
#pragma once

#include "graph/executor.h"

namespace lahar {

/// On `threads` threads. `verify` checks at every firing that exactly the steps that the edges
/// promise were done before, and throws std::logic_error from run() otherwise.
std::unique_ptr<Executor> make_local_flow(TaskGraph graph, TaskBodies bodies, int threads,
                                          bool verify = false);

}  // namespace lahar
