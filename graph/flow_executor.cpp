/// The step graph as a oneTBB flow graph that is fired over and over.
///
/// Edges within a step are make_edge edges. Edges from one step to the next are explicit try_put
/// calls in the bodies, so that the graph drains when the last step is done. A continue_node counts
/// messages, not edges; that this is enough is what unsafe_edges() checks.
///
/// Every task of the first stage needs one more message, the permit: its patch is less than
/// max_lead steps ahead of the slowest one. Permits are the only thing that links patches far
/// apart.
#include <oneapi/tbb/flow_graph.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/info.h>
#include <oneapi/tbb/task_arena.h>

#include <array>
#include <deque>
#include <mutex>
#include <stdexcept>

#include "graph/executor.h"

namespace lahar {

namespace {

namespace flow = oneapi::tbb::flow;
/// On lines of its own, so that counting messages of one touches no other.
struct alignas(64) Node : flow::continue_node<flow::continue_msg> {
  using continue_node::continue_node;
};

class FlowExecutor final : public Executor {
 public:
  FlowExecutor(TaskGraph graph, TaskBodies bodies, int threads, bool verify)
      : Executor(std::move(graph), std::move(bodies)),
        verify_(verify),
        parallelism_(oneapi::tbb::global_control::max_allowed_parallelism,
                     static_cast<std::size_t>(threads)),
        arena_(threads) {
    // A graph runs in the arena of the thread that builds it.
    arena_.execute([this] { build(); });
  }

  ~FlowExecutor() override {
    arena_.execute([this] {
      nodes_.clear();
      flow_.reset();
    });
  }

  Step run(Step first, Step end) override {
    end_ = end;
    completed_ = first;
    next_completion_ = first;
    first_ = first;
    parked_.clear();
    step_.assign(step_.size(), first);
    for (auto& count : remaining_) count = graph_.patches;
    finished_.fill(false);
    for (auto& stamp : stamps_) stamp = first;
    if (first < end) arena_.execute([this] { start_and_wait(); });
    return end_;
  }

 private:
  void build() {
    flow_ = std::make_unique<flow::graph>();
    const int n = graph_.tasks();
    step_.assign(static_cast<std::size_t>(n), 0);
    if (verify_) {
      stamps_ = std::vector<std::atomic<Step>>(static_cast<std::size_t>(n));
      into_.resize(static_cast<std::size_t>(n));
      for (const Edge& edge : graph_.edges)
        into_[static_cast<std::size_t>(edge.to)].push_back(edge);
    }
    for (int t = 0; t < n; ++t) {
      const int permit = is_first_stage(t) ? 1 : 0;
      nodes_.emplace_back(*flow_, graph_.in_lag[static_cast<std::size_t>(t)] + permit,
                          [this, t](const flow::continue_msg&) { fire(t); });
    }
    // A task's edges one after the other: their memory is walked in this order at every firing.
    for (const Edge& edge : graph_.edges)
      if (edge.lag == 0)
        flow::make_edge(nodes_[static_cast<std::size_t>(edge.from)],
                        nodes_[static_cast<std::size_t>(edge.to)]);
  }

  void start_and_wait() {
    // Counters keep what a stopped run left in them.
    flow_->reset();
    for (int t = 0; t < graph_.tasks(); ++t) {
      const int messages = graph_.in_lag[static_cast<std::size_t>(t)] + (is_first_stage(t) ? 1 : 0);
      for (int k = 0; k < messages; ++k) put(t);
    }
    flow_->wait_for_all();
  }

  bool is_first_stage(int task) const { return task < graph_.patches; }
  bool is_last_stage(int task) const {
    return !graph_.is_dt(task) &&
           graph_.stage_of(task) + 1 == static_cast<int>(graph_.stages.size());
  }
  void put(int task) { nodes_[static_cast<std::size_t>(task)].try_put(flow::continue_msg{}); }

  void fire(int task) {
    const auto t = static_cast<std::size_t>(task);
    const Step step = step_[t]++;
    if (verify_) verify(task, step);
    if (graph_.is_dt(task)) {
      if (step > first_) bodies_.set_dt(step);  // dt of the first step is known
    } else {
      bodies_.run(graph_.stage_of(task), graph_.patch_of(task), step);
    }
    fetch_successors(task);
    if (verify_) stamps_[t].store(step + 1, std::memory_order_release);
    if (is_last_stage(task)) finish(step);
    if (step + 1 < end_.load(std::memory_order_acquire))
      for (const Edge& edge : graph_.out(task))
        if (edge.lag == 1) put(edge.to);
    if (is_first_stage(task)) request_permit(task, step + 1);
  }

  /// Messages are locked one by one, so that nothing hides how long each successor takes to come
  /// from memory, where a phase's particles have pushed it: ask for all of them at once.
  void fetch_successors(int task) {
    for (const Edge& edge : graph_.out(task)) {
      const auto* node = reinterpret_cast<const char*>(&nodes_[static_cast<std::size_t>(edge.to)]);
      __builtin_prefetch(node, 1);
      __builtin_prefetch(node + 64, 1);
    }
  }

  /// Every task that this one waits for has done this step (lag 0) or the one before (lag 1), and
  /// none of them is further than its one token allows.
  void verify(int task, Step step) {
    for (const Edge& edge : into_[static_cast<std::size_t>(task)]) {
      const Step done =
          stamps_[static_cast<std::size_t>(edge.from)].load(std::memory_order_acquire);
      const Step needed = step + 1 - edge.lag;
      const bool first_dt = graph_.is_dt(task) && step == first_;
      if (done != needed && !first_dt)
        throw std::logic_error("task " + graph_.name(task) + " ran step " + std::to_string(step) +
                               " when " + graph_.name(edge.from) + " had done " +
                               std::to_string(done) + " steps instead of " +
                               std::to_string(needed));
    }
  }

  /// One patch has finished `step`; the last one reports it and lets waiting patches go on.
  void finish(Step step) {
    const auto slot = static_cast<std::size_t>(step % max_lead);
    if (remaining_[slot].fetch_sub(1, std::memory_order_acq_rel) > 1) return;
    remaining_[slot].store(graph_.patches, std::memory_order_relaxed);
    const std::scoped_lock lock(completion_);
    finished_[slot] = true;
    while (finished_[static_cast<std::size_t>(next_completion_ % max_lead)]) {
      finished_[static_cast<std::size_t>(next_completion_ % max_lead)] = false;
      bodies_.completed(next_completion_);
      release_up_to(++next_completion_);
    }
  }

  void request_permit(int patch, Step next) {
    if (next >= completed_.load(std::memory_order_acquire) + max_lead) {
      const std::scoped_lock lock(gate_);
      if (next >= completed_.load(std::memory_order_relaxed) + max_lead) {
        parked_.push_back({patch, next});
        return;
      }
    }
    if (next < end_.load(std::memory_order_acquire)) put(patch);
  }

  void release_up_to(Step completed) {
    std::vector<Parked> free;
    {
      const std::scoped_lock lock(gate_);
      completed_.store(completed, std::memory_order_release);
      std::erase_if(parked_, [&](const Parked& p) {
        if (p.next >= completed + max_lead) return false;
        free.push_back(p);
        return true;
      });
    }
    for (const Parked& p : free)
      if (p.next < end_.load(std::memory_order_acquire)) put(p.patch);
  }

  struct Parked {
    int patch;
    Step next;
  };

  bool verify_;
  oneapi::tbb::global_control parallelism_;
  oneapi::tbb::task_arena arena_;
  std::unique_ptr<flow::graph> flow_;
  std::deque<Node> nodes_;
  std::vector<Step> step_;  ///< the step that each task does next; touched by that task only
  std::vector<std::atomic<Step>> stamps_;
  std::vector<std::vector<Edge>> into_;

  Step first_ = 0;
  std::array<std::atomic<int>, max_lead> remaining_{};  ///< patches that have not finished a step
  std::mutex completion_;
  std::array<bool, max_lead> finished_{};
  Step next_completion_ = 0;

  std::atomic<Step> completed_{0};  ///< the first step that some patch has not finished
  std::mutex gate_;
  std::vector<Parked> parked_;
};

}  // namespace

int available_threads() {
  return oneapi::tbb::info::default_concurrency();
}

std::unique_ptr<Executor> make_flow_executor(TaskGraph graph, TaskBodies bodies, int threads,
                                             bool verify) {
  return std::make_unique<FlowExecutor>(std::move(graph), std::move(bodies), threads, verify);
}

}  // namespace lahar
