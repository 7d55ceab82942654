/// \file What the executors of local_flow.cpp and distributed_flow.cpp share: one node of oneTBB
/// for each task, made once and fired for every step; permits; which steps are done; checks.
///
/// A continue_node counts messages, not edges; that this is enough is what unsafe_edges() checks.
/// Messages to the next step are sent by the bodies of tasks, so that the graph drains when the
/// last step is done.
///
/// Every task of the first stage needs one more message, the permit: its patch is less than
/// max_lead steps ahead of the slowest one. Permits are the only thing that links patches far
/// apart.
///
/// Threads: run() is called by one thread, which is a worker until the graph has drained. All else
/// is called by any worker, at the beginning and at the end of a task.
#pragma once

#include <oneapi/tbb/flow_graph.h>
#include <oneapi/tbb/task_arena.h>

#include <array>
#include <deque>
#include <mutex>
#include <stdexcept>

#include "graph/executor.h"

namespace lahar {

/// Takes steps that are done in any order, less than max_lead apart, and gives them in order.
class StepsInOrder {
 public:
  void begin(Step first) {
    done_.fill(false);
    next_ = first;
  }
  /// Calls `give` with each step that all steps before have come to.
  void add(Step step, auto give) {
    at(step) = true;
    for (; at(next_); give(next_++)) at(next_) = false;
  }
  Step next() const { return next_; }

 private:
  bool& at(Step step) { return done_[static_cast<std::size_t>(step % max_lead)]; }

  std::array<bool, max_lead> done_{};
  Step next_ = 0;
};

class FlowExecutor : public Executor {
 public:
  Step run(Step first, Step end) final {
    first_ = completed_ = first;
    end_ = end;
    parked_.clear();
    step_.assign(step_.size(), first);
    for (auto& count : remaining_) count = graph_.own_patches();
    finished_.begin(first);
    for (auto& stamp : stamps_) stamp = first;
    noting_ = !needs_.empty() && bodies_.clock && bodies_.clock() > 0;
    ready_at_.assign(noting_ ? step_.size() : 0, 0);
    missed_at_.assign(noting_ ? step_.size() : 0, 0);
    // Counters keep what a stopped run left in them.
    for (std::size_t t = 0; t < needs_.size(); ++t) missing(static_cast<int>(t)) = needs_[t];
    if (first < end)
      arena_.execute([this] {
        flow_->reset();
        take_steps();
      });
    return end_;
  }

 protected:
  /// On cache lines of its own: who counts messages of one node touches no other.
  struct alignas(64) Node : oneapi::tbb::flow::continue_node<oneapi::tbb::flow::continue_msg> {
    using continue_node::continue_node;
  };

  FlowExecutor(TaskGraph graph, TaskBodies bodies, int threads, bool verify)
      : Executor(std::move(graph), std::move(bodies)),
        verify_(verify),
        threads_(threads),
        step_(static_cast<std::size_t>(graph_.tasks())),
        arena_(threads) {
    allow_threads(threads);
    // A graph runs in the arena of the thread that makes it.
    arena_.execute([this] { flow_ = std::make_unique<oneapi::tbb::flow::graph>(); });
    if (!verify_) return;
    stamps_ = std::vector<std::atomic<Step>>(step_.size());
    into_.resize(step_.size());
    for (const Edge& edge : graph_.edges) into_[static_cast<std::size_t>(edge.to)].push_back(edge);
  }
  ~FlowExecutor() override {
    arena_.execute([this] {
      nodes_.clear();
      flow_.reset();
    });
  }

  /// Called by run(): send the messages that begin step first_, and wait until all steps are done.
  virtual void take_steps() = 0;
  /// Send a task a message.
  virtual void put(int task) = 0;
  /// All patches of this process have finished a step. Called for steps in order, under
  /// completion_.
  virtual void own_patches_finished(Step step) = 0;

  /// A task fires: returns the step that it does.
  Step begin_task(int task) {
    const Step step = step_[static_cast<std::size_t>(task)]++;
    if (verify_) verify(task, step);
    return step;
  }
  /// A task has done what others wait for.
  void stamp(int task, Step step) {
    if (verify_) stamps_[static_cast<std::size_t>(task)].store(step + 1, std::memory_order_release);
  }
  /// Whether a step is taken, as far as is known.
  bool is_taken(Step step) const { return step < end_.load(std::memory_order_acquire); }

  /// The messages that a task gets from the step before, with the permit.
  int messages_from_before(int task) const {
    return graph_.in_lag[static_cast<std::size_t>(task)] + (needs_permit(task) ? 1 : 0);
  }
  /// A task that begins a step must know that all take the step.
  bool needs_permit(int task) const {
    if (graph_.is_global(task)) return graph_.collects_dt(task) && graph_.round_of(task) == 0;
    return graph_.stage_of(task) == 0 && !graph_.is_elsewhere(task);
  }
  /// For a global task: dt of the first round is known before run().
  bool is_known_dt(int task, Step step) const {
    return step == first_ && graph_.round_of(task) == 0;
  }
  /// The round whose dt a global task collects or sets.
  Step round_of_dt(int task, Step step) const {
    return graph_.round_at(step, graph_.round_of(task));
  }
  bool is_last_stage(int task) const {
    return !graph_.is_global(task) &&
           graph_.stage_of(task) + 1 == static_cast<int>(graph_.stages.size());
  }

  /// One patch has finished `step`.
  void finish(Step step) {
    auto& remaining = remaining_[static_cast<std::size_t>(step % max_lead)];
    if (remaining.fetch_sub(1, std::memory_order_acq_rel) > 1) return;
    remaining.store(graph_.own_patches(), std::memory_order_relaxed);
    const std::scoped_lock lock(completion_);
    finished_.add(step, [this](Step done) { own_patches_finished(done); });
  }

  /// All patches of all ranks have finished `step`: report it and let waiting patches go on. Under
  /// completion_.
  void complete(Step step) {
    bodies_.completed(step);
    const Step completed = step + 1;
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
      if (is_taken(p.next)) put(p.task);
  }

  /// Permit a task to begin step `next`, now or when the slowest patch has come near enough.
  void request_permit(int task, Step next) {
    if (next >= completed_.load(std::memory_order_acquire) + max_lead) {
      const std::scoped_lock lock(gate_);
      if (next >= completed_.load(std::memory_order_relaxed) + max_lead) {
        parked_.push_back({task, next});
        return;
      }
    }
    if (is_taken(next)) put(task);
  }

  /// Count the messages to tasks here, too: `needs` of a step, by task.
  void count_messages(std::vector<int> needs) {
    needs_ = std::move(needs);
    // On cache lines of their own: threads that count messages of different tasks do not meet.
    stride_ = threads_ > 1 ? 16 : 1;
    missing_ = std::vector<std::atomic<int>>(needs_.size() * stride_);
  }

  std::atomic<int>& missing(int task) { return missing_[static_cast<std::size_t>(task) * stride_]; }
  /// Count a message to a task before oneTBB gets it. True if it was the last one: the time is then
  /// noted before the task can begin.
  bool count_message(int task) {
    const auto t = static_cast<std::size_t>(task);
    if (missing(task).fetch_sub(1, std::memory_order_acq_rel) > 1) return false;
    missing(task).store(needs_[t], std::memory_order_relaxed);
    if (noting_) ready_at_[t] = bodies_.clock();
    return true;
  }

  const bool verify_;
  const int threads_;
  std::unique_ptr<oneapi::tbb::flow::graph> flow_;
  std::deque<Node> nodes_;  ///< by task
  std::vector<Step> step_;  ///< the step that each task does next; touched by that task only
  Step first_ = 0;          ///< of run()
  std::vector<int> needs_;  ///< messages of a step into a task; empty: they are not counted here
  bool noting_ = false;     ///< when tasks become ready
  std::mutex completion_;   ///< which steps are done
  StepsInOrder finished_;   ///< by all patches of this process
  std::atomic<Step> completed_{0};  ///< the first step that some patch has not finished

 private:
  /// Every task that this one waits for has done this step (lag 0) or the one before (lag 1), and
  /// none of them is further than its one token allows.
  void verify(int task, Step step) const {
    for (const Edge& edge : into_[static_cast<std::size_t>(task)]) {
      const Step done =
          stamps_[static_cast<std::size_t>(edge.from)].load(std::memory_order_acquire);
      const Step needed = step + 1 - edge.lag;
      const bool first_dt = graph_.is_global(task) && is_known_dt(task, step);
      if (done != needed && !first_dt)
        throw std::logic_error("task " + graph_.name(task) + " ran step " + std::to_string(step) +
                               " when " + graph_.name(edge.from) + " had done " +
                               std::to_string(done) + " steps instead of " +
                               std::to_string(needed));
    }
  }

  oneapi::tbb::task_arena arena_;
  std::vector<std::atomic<int>> missing_;               ///< messages until a task is ready
  std::size_t stride_ = 1;                              ///< of these
  std::array<std::atomic<int>, max_lead> remaining_{};  ///< patches that have not finished a step
  struct Parked {
    int task;
    Step next;
  };
  std::mutex gate_;  ///< for parked_
  std::vector<Parked> parked_;
  std::vector<std::atomic<Step>> stamps_;  ///< to verify: steps that each task has done
  std::vector<std::vector<Edge>> into_;    ///< to verify: edges by the task they lead to
};

}  // namespace lahar
