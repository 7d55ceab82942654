/// \file The step graph of one of several ranks as a oneTBB flow graph.
#pragma once

#include "graph/executor.h"

namespace lahar {

/// An executor of one rank's share of a graph (TaskGraph::shared). `remote` must outlive it;
/// `threads` and `verify` as in make_local_flow().
std::unique_ptr<Executor> make_distributed_flow(TaskGraph graph, TaskBodies bodies, int threads,
                                                bool verify, Remote& remote);

}  // namespace lahar
