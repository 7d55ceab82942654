/// \file Edges within a step are edges of oneTBB, which counts their messages and fires nodes.
///
/// Threads: a worker takes a node that is ready and calls fire(). That runs the body of the task
/// (TaskBodies::run or set_dt), then sends messages to the next step. When fire() returns, oneTBB
/// sends those within the step, and the worker goes on with a node that became ready. The worker
/// whose task is the last one of a step calls TaskBodies::completed. A body that throws cancels the
/// graph, and run() throws what it threw.
#include "graph/local_flow.h"

#include "graph/flow_executor.h"

namespace lahar {

namespace {

namespace flow = oneapi::tbb::flow;

class LocalFlow final : public FlowExecutor {
 public:
  LocalFlow(TaskGraph graph, TaskBodies bodies, int threads, bool verify)
      : FlowExecutor(std::move(graph), std::move(bodies), threads, verify) {
    const int n = graph_.tasks();
    for (int t = 0; t < n; ++t)
      nodes_.emplace_back(*flow_, messages_from_before(t),
                          [this, t](const flow::continue_msg&) { fire(t); });
    // All edges of a task together: every firing walks through their memory in this order.
    for (const Edge& edge : graph_.edges)
      if (edge.lag == 0) flow::make_edge(node(edge.from), node(edge.to));
    if (!verify_) return;
    // Counting takes one to two percent of the time. Only tests do it, to compare with what readers
    // of traces conclude.
    std::vector<int> needs = graph_.in_step;
    for (int t = 0; t < n; ++t) needs[static_cast<std::size_t>(t)] += messages_from_before(t);
    count_messages(std::move(needs));
  }

 private:
  Node& node(int task) { return nodes_[static_cast<std::size_t>(task)]; }

  void take_steps() override {
    for (int t = 0; t < graph_.tasks(); ++t)
      for (int k = 0; k < messages_from_before(t); ++k) put(t);
    flow_->wait_for_all();
  }

  void put(int task) override {
    if (verify_) count_message(task);
    node(task).try_put(flow::continue_msg{});
  }

  void own_patches_finished(Step step) override { complete(step); }

  void fire(int task) {
    const Step step = begin_task(task);
    if (!graph_.is_dt(task))
      bodies_.run(graph_.stage_of(task), graph_.patch_of(task), step);
    else if (!is_known_dt(task, step))
      bodies_.set_dt(round_of_dt(task, step));
    fetch_successors(task);
    stamp(task, step);
    if (is_last_stage(task)) finish(step);
    if (is_taken(step + 1))
      for (const Edge& edge : graph_.out(task))
        if (edge.lag == 1) put(edge.to);
    if (needs_permit(task)) request_permit(task, step + 1);
    if (!verify_) return;
    for (const Edge& edge : graph_.out(task))
      if (edge.lag == 0) count_message(edge.to);
  }

  /// Particles of a phase push the successors out of the cache, and oneTBB locks one after the
  /// other: each would come from memory on its own. Ask for all of them at once.
  void fetch_successors(int task) {
    for (const Edge& edge : graph_.out(task)) {
      const auto* lines = reinterpret_cast<const char*>(&node(edge.to));
      __builtin_prefetch(lines, 1);
      __builtin_prefetch(lines + 64, 1);
    }
  }
};

}  // namespace

std::unique_ptr<Executor> make_local_flow(TaskGraph graph, TaskBodies bodies, int threads,
                                          bool verify) {
  return std::make_unique<LocalFlow>(std::move(graph), std::move(bodies), threads, verify);
}

}  // namespace lahar
