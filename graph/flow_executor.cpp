/// \file The step graph as a oneTBB flow graph that is fired over and over.
///
/// Edges within a step are make_edge edges. Edges from one step to the next are explicit try_put
/// calls in the bodies, so that the graph drains when the last step is done. A continue_node counts
/// messages, not edges; that this is enough is what unsafe_edges() checks.
///
/// Every task of the first stage needs one more message, the permit: its patch is less than
/// max_lead steps ahead of the slowest one. Permits are the only thing that links patches far
/// apart.
///
/// A task and its rest are one body most of the time. Where ranks have to agree on the time step,
/// some rests are deferred: threads do them while they wait for the agreement
/// (graph/deferred_work.h). Deferred rests are nodes of their own.
///
/// Several ranks: the task of a message from elsewhere is done where the message is found; that all
/// ranks have finished a step releases permits. Every body ends with a look for messages, and a
/// thread that leaves no task ready stays and looks on, because oneTBB does not say when it is
/// idle. For that the messages of the graph are counted here, and not by oneTBB a second time: a
/// node gets one message, when its task is ready. Traces are told when that was. Whichever node
/// fires does the task that is most urgent, because priorities of nodes know no steps.
#include <oneapi/tbb/flow_graph.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/info.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <deque>
#include <mutex>
#include <optional>
#include <stdexcept>

#include "graph/back_off.h"
#include "graph/deferred_work.h"
#include "graph/executor.h"
#include "graph/ready_tasks.h"

namespace lahar {

namespace {

namespace flow = oneapi::tbb::flow;
/// On lines of its own, so that counting messages of one touches no other.
struct alignas(64) Node : flow::continue_node<flow::continue_msg> {
  using continue_node::continue_node;
};

class FlowExecutor final : public Executor {
 public:
  FlowExecutor(TaskGraph graph, TaskBodies bodies, int threads, bool verify, Remote* remote)
      : Executor(std::move(graph), std::move(bodies)),
        verify_(verify),
        remote_(remote),
        threads_(static_cast<std::size_t>(threads)),
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
    for (auto& count : remaining_) count = graph_.own_patches();
    finished_.fill(false);
    agreed_.fill(false);
    next_given_ = first;
    dt_known_ = first;
    if (deferred_work_) deferred_work_->begin(first);
    for (auto& done : done_) done = first;
    for (auto& stamp : stamps_) stamp = first;
    begin_counting();
    // Only now: the least of all that exist counts, and other executors may want more threads.
    const oneapi::tbb::global_control parallelism(
        oneapi::tbb::global_control::max_allowed_parallelism, threads_);
    if (first < end) arena_.execute([this] { start_and_wait(); });
    return end_;
  }

  /// The task of a message waits for nothing else and is short: it is done here.
  void arrived(int stage, int patch) override {
    const int task = graph_.task(stage, patch);
    const auto t = static_cast<std::size_t>(task);
    const Step step = step_[t]++;
    if (noting_) {
      ready_at_[t] = bodies_.clock();
      missed_at_[t] = look_before;
    }
    bodies_.run(stage, patch, step);
    stamp(task, step);
    done_[t].store(step + 1, std::memory_order_release);
    const bool last = step + 1 >= end_.load(std::memory_order_acquire);
    for (const Edge& edge : graph_.out(task))
      if (edge.lag == 0 || !last) put(edge.to);
  }
  void dt_agreed(Step) override { put(graph_.dt_task()); }

  /// Agreements may come to light in another order than they were made.
  void step_agreed(Step step) override {
    const std::scoped_lock lock(completion_);
    agreed_[static_cast<std::size_t>(step % max_lead)] = true;
    while (agreed_[static_cast<std::size_t>(next_completion_ % max_lead)]) {
      agreed_[static_cast<std::size_t>(next_completion_ % max_lead)] = false;
      complete_next();
    }
    if (graph_.own_patches() == 0) give_steps_without_patches();
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
    if (remote_) {
      find_boundary();
      if (graph_.has_dt)
        deferred_work_.emplace(graph_, boundary_, static_cast<int>(threads_), remote_->has_cores());
    }
    from_elsewhere_.assign(static_cast<std::size_t>(n), 0);
    for (const Edge& edge : graph_.edges)
      if (edge.lag == 0 && graph_.is_elsewhere(edge.from))
        ++from_elsewhere_[static_cast<std::size_t>(edge.to)];
    for (int t = 0; t < n; ++t) {  // tasks of messages have a node that never fires
      // Without other ranks an order would only cost time.
      const auto body = [this, t](const flow::continue_msg&) {
        guarded_fire(remote_ ? ready_tasks_.take() : t);
      };
      nodes_.emplace_back(*flow_, remote_ ? 1 : puts_into(t), body);
    }
    if (remote_) return;
    // A task's edges one after the other: their memory is walked in this order at every firing.
    for (const Edge& edge : graph_.edges)
      if (edge.lag == 0 && !graph_.is_elsewhere(edge.from) && !is_rest(edge.to))
        flow::make_edge(nodes_[static_cast<std::size_t>(edge.from)],
                        nodes_[static_cast<std::size_t>(edge.to)]);
  }

  void start_and_wait() {
    // Counters keep what a stopped run left in them.
    flow_->reset();
    if (counting_) {
      for (int t = 0; t < graph_.tasks(); ++t)
        missing(t) = needs_[static_cast<std::size_t>(t)] = needs(t);
    }
    for (int t = 0; t < graph_.tasks(); ++t) {
      if (graph_.is_elsewhere(t)) continue;
      // The first step's dt is known.
      const int messages = graph_.is_dt(t) ? puts_into(t) : first_puts_into(t);
      for (int k = 0; k < messages; ++k) put(t);
    }
    if (remote_ && graph_.own_patches() == 0) {
      const std::scoped_lock lock(completion_);
      give_steps_without_patches();
    }
    flow_->wait_for_all();
    while (remote_ && !all_done()) {  // a rank without patches has no body to look for messages
      look_until_ready();
      flow_->wait_for_all();
    }
  }

  bool is_first_stage(int task) const {
    return !graph_.is_global(task) && graph_.stage_of(task) == 0 && !graph_.is_elsewhere(task);
  }
  bool is_last_stage(int task) const {
    return !graph_.is_global(task) && !graph_.is_elsewhere(task) &&
           graph_.stage_of(task) + 1 == static_cast<int>(graph_.stages.size());
  }
  /// Messages into a task that no make_edge edge brings: from the step before, a permit, from
  /// elsewhere.
  int first_puts_into(int task) const {
    return graph_.in_lag[static_cast<std::size_t>(task)] + (needs_permit(task) ? 1 : 0);
  }
  /// What begins a step must know that it is taken by all.
  bool needs_permit(int task) const { return is_first_stage(task) || graph_.collects_dt(task); }
  bool is_rest(int task) const {
    return !graph_.is_global(task) && !graph_.is_elsewhere(task) &&
           graph_.stages[static_cast<std::size_t>(graph_.stage_of(task))].is_rest;
  }
  bool has_rest(int task) const {
    return !graph_.is_global(task) && graph_.has_rest(graph_.stage_of(task));
  }
  int puts_into(int task) const {
    if (is_rest(task)) return 1;  // from the list of deferred work
    const bool is_agreed = graph_.shared && graph_.is_dt(task);
    return first_puts_into(task) + from_elsewhere_[static_cast<std::size_t>(task)] +
           (is_agreed ? 1 : 0);
  }
  int needs(int task) const {
    const auto t = static_cast<std::size_t>(task);
    if (is_rest(task)) return 1;
    return puts_into(task) + graph_.in_step[t] - from_elsewhere_[t];
  }
  void put(int task) {
    if (counting_ && !count_message(task) && remote_) return;
    if (remote_) ready_tasks_.add(task, step_[static_cast<std::size_t>(task)], who_waits(task));
    nodes_[static_cast<std::size_t>(task)].try_put(flow::continue_msg{});
  }

  /// Threads that look for messages must not do so for ever when the graph is cancelled.
  void guarded_fire(int task) {
    try {
      fire(task);
    } catch (...) {
      broken_ = true;
      throw;
    }
  }

  void fire(int task) {
    const auto t = static_cast<std::size_t>(task);
    const Step step = step_[t]++;
    if (verify_) verify(task, step);
    if (graph_.is_dt(task)) {
      if (step > first_) bodies_.set_dt(step);  // dt of the first step is known
      if (deferred_work_) deferred_work_->dt_is_known();
      if (graph_.shared) set_dt_known(step);
    } else if (graph_.collects_dt(task)) {
      if (step > first_) remote_->give_dt(step);
    } else if (has_rest(task)) {
      return fire_with_rest(task, step);
    } else {
      if (is_rest(task)) deferred_work_->rest_begins();
      bodies_.run(graph_.stage_of(task), graph_.patch_of(task), step);
    }
    pass_on(task, step);
    if (remote_) look_for_messages();
  }

  /// What follows the body of a task.
  void pass_on(int task, Step step) {
    fetch_successors(task);
    stamp(task, step);
    if (is_last_stage(task)) finish(step);
    if (step + 1 < end_.load(std::memory_order_acquire))
      for (const Edge& edge : graph_.out(task))
        if (edge.lag == 1) put(edge.to);
    if (needs_permit(task)) request_permit(task, step + 1);
    if (!counting_) return;
    for (const Edge& edge : graph_.out(task)) {
      if (edge.lag == 1 || is_rest(edge.to)) continue;
      if (remote_)
        put(edge.to);
      else
        count_message(edge.to);
    }
  }

  /// A task and its rest.
  void fire_with_rest(int task, Step step) {
    const int stage = graph_.stage_of(task), patch = graph_.patch_of(task);
    const int rest = graph_.task(stage + 1, patch);
    const auto release = [this](int t) { put(t); };
    if (deferred_work_ && deferred_work_->task_begins(patch, step, release)) {
      bodies_.run(stage, patch, step);
      stamp(task, step);
      deferred_work_->defer(rest, step, release);
      pass_on(task, step);
    } else {
      run_with_rest(stage, patch, step);
      ++step_[static_cast<std::size_t>(rest)];
      pass_on(task, step);
      pass_on(rest, step);
    }
    if (remote_) look_for_messages();
  }

  // --- counting ---------------------------------------------------------------------------------

  void begin_counting() {
    const auto n = static_cast<std::size_t>(graph_.tasks());
    // With one rank counting would take one to two percent of the time; to test what readers of
    // traces have instead, it is done there, too.
    counting_ = remote_ || verify_;
    noting_ = counting_ && bodies_.clock && bodies_.clock() > 0;
    ready_at_.assign(noting_ ? n : 0, 0);
    missed_at_.assign(noting_ ? n : 0, 0);
    looked_ = 0;
    ready_tasks_.clear();
    if (!counting_ || !missing_.empty()) return;
    // On lines of their own, so that threads that count messages of different tasks do not meet.
    stride_ = threads_ > 1 ? 16 : 1;
    missing_ = std::vector<std::atomic<int>>(n * stride_);
    needs_.assign(n, 0);
  }

  std::atomic<int>& missing(int task) { return missing_[static_cast<std::size_t>(task) * stride_]; }

  /// A message to a task, counted before oneTBB gets it. True if it was the last one; who counts
  /// that notes the time before the task can begin.
  bool count_message(int task) {
    const auto t = static_cast<std::size_t>(task);
    if (missing(task).fetch_sub(1, std::memory_order_acq_rel) > 1) return false;
    missing(task).store(needs_[t], std::memory_order_relaxed);
    if (noting_) ready_at_[t] = bodies_.clock();
    return true;
  }

  // --- other ranks ------------------------------------------------------------------------------

  /// At the end of a body. A thread that finds nothing ready looks on, so that at least one does
  /// while messages are to come; oneTBB delivers what this body leads to when it returns, which is
  /// not needed as long as nothing is ready.
  void look_for_messages() {
    // Tasks of empty patches take less time than a look. The more is ready here, the less a message
    // is in a hurry, and the more of them one look finds.
    using Clock = std::chrono::steady_clock;
    constexpr Clock::rep shortest = 20'000;  // ns
    constexpr int few = 2, many = 16;
    const int ready = ready_tasks_.size();
    const Clock::rep interval = shortest * std::clamp(ready - few, 1, many);
    const Clock::rep now = Clock::now().time_since_epoch().count();
    if (now - last_look_.load(std::memory_order_relaxed) > interval) {
      last_look_.store(now, std::memory_order_relaxed);
      look();
    } else {
      remote_->post(/*all=*/ready <= few);
    }
    look_until_ready();
  }

  /// What a look brings, it brings by the thread that looks: arrived() is told of the look before.
  bool look() {
    if (!noting_) return remote_->progress(*this);
    look_before = looked_.load(std::memory_order_relaxed);
    const std::uint64_t begin = bodies_.clock();
    const bool found = remote_->progress(*this);
    looked_.store(begin, std::memory_order_relaxed);
    return found;
  }

  void look_until_ready() {
    if (ready_tasks_.size() > 0 || all_done()) return;
    if (bodies_.looking) bodies_.looking(false);
    for (Waiting waiting(remote_->has_cores()); ready_tasks_.size() <= 0 && !all_done();)
      waiting.looked(look());
    if (bodies_.looking) bodies_.looking(true);
  }

  /// All ranks have finished all steps, and this one has all messages of the last.
  bool all_done() const {
    if (broken_.load(std::memory_order_relaxed)) return true;
    const Step end = end_.load(std::memory_order_acquire);
    if (completed_.load(std::memory_order_acquire) < end) return false;
    return std::all_of(messages_.begin(), messages_.end(), [&](int t) {
      return done_[static_cast<std::size_t>(t)].load(std::memory_order_acquire) >= end;
    });
  }

  /// A rank without patches finishes steps as soon as it may: not before it is known, from the
  /// agreement max_lead steps before and from dt, that they are taken.
  void give_steps_without_patches() {
    const Step known = graph_.has_dt ? dt_known_.load() + 1 : end_.load();
    while (next_given_ < std::min({known, end_.load(), next_completion_ + max_lead}))
      remote_->give_step(next_given_++);
  }
  void set_dt_known(Step step) {
    dt_known_ = step;
    if (graph_.own_patches() > 0) return;
    const std::scoped_lock lock(completion_);
    give_steps_without_patches();
  }

  /// Patches that exchange with other ranks.
  void find_boundary() {
    boundary_.assign(static_cast<std::size_t>(graph_.patches), 0);
    for (const Edge& edge : graph_.edges) {
      if (!graph_.is_elsewhere(edge.from)) continue;
      boundary_[static_cast<std::size_t>(graph_.patch_of(edge.from))] = 1;
      boundary_[static_cast<std::size_t>(graph_.patch_of(edge.to))] = 1;
      messages_.push_back(edge.from);
    }
    std::sort(messages_.begin(), messages_.end());
    messages_.erase(std::unique(messages_.begin(), messages_.end()), messages_.end());
    done_ = std::vector<std::atomic<Step>>(static_cast<std::size_t>(graph_.tasks()));
  }
  Waits who_waits(int task) const {
    if (graph_.is_global(task)) return Waits::all_ranks;
    return boundary_[static_cast<std::size_t>(graph_.patch_of(task))] ? Waits::neighbours
                                                                      : Waits::nobody_else;
  }

  // --- single tasks -----------------------------------------------------------------------------

  /// Messages are locked one by one, so that nothing hides how long each successor takes to come
  /// from memory, where a phase's particles have pushed it: ask for all of them at once.
  void fetch_successors(int task) {
    for (const Edge& edge : graph_.out(task)) {
      if (remote_) {
        __builtin_prefetch(&missing(edge.to), 1);
        continue;
      }
      const auto* node = reinterpret_cast<const char*>(&nodes_[static_cast<std::size_t>(edge.to)]);
      __builtin_prefetch(node, 1);
      __builtin_prefetch(node + 64, 1);
    }
  }

  void stamp(int task, Step step) {
    if (verify_) stamps_[static_cast<std::size_t>(task)].store(step + 1, std::memory_order_release);
  }

  /// Every task that this one waits for has done this step (lag 0) or the one before (lag 1), and
  /// none of them is further than its one token allows.
  void verify(int task, Step step) {
    for (const Edge& edge : into_[static_cast<std::size_t>(task)]) {
      const Step done =
          stamps_[static_cast<std::size_t>(edge.from)].load(std::memory_order_acquire);
      const Step needed = step + 1 - edge.lag;
      const bool first_dt = graph_.is_global(task) && step == first_;
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
    remaining_[slot].store(graph_.own_patches(), std::memory_order_relaxed);
    const std::scoped_lock lock(completion_);
    finished_[slot] = true;
    while (finished_[static_cast<std::size_t>(next_given_ % max_lead)]) {
      finished_[static_cast<std::size_t>(next_given_ % max_lead)] = false;
      const Step given = next_given_++;
      if (remote_)
        remote_->give_step(given);
      else
        complete_next();
    }
  }

  void complete_next() {
    bodies_.completed(next_completion_);
    release_up_to(++next_completion_);
  }

  void request_permit(int task, Step next) {
    if (next >= completed_.load(std::memory_order_acquire) + max_lead) {
      const std::scoped_lock lock(gate_);
      if (next >= completed_.load(std::memory_order_relaxed) + max_lead) {
        parked_.push_back({task, next});
        return;
      }
    }
    if (next < end_.load(std::memory_order_acquire)) put(task);
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
      if (p.next < end_.load(std::memory_order_acquire)) put(p.task);
  }

  struct Parked {
    int task;
    Step next;
  };

  bool verify_;
  Remote* remote_;  ///< null = one rank
  std::size_t threads_;
  oneapi::tbb::task_arena arena_;
  std::unique_ptr<flow::graph> flow_;
  std::deque<Node> nodes_;
  std::vector<Step> step_;  ///< the step that each task does next; touched by that task only
  std::vector<std::atomic<Step>> stamps_;
  std::vector<std::vector<Edge>> into_;

  Step first_ = 0;
  std::array<std::atomic<int>, max_lead> remaining_{};  ///< patches that have not finished a step
  std::optional<DeferredWork>
      deferred_work_;  ///< several ranks, which have to agree on the time step

  std::mutex completion_;
  std::array<bool, max_lead> finished_{};
  Step next_given_ = 0;       ///< of this rank's patches
  Step next_completion_ = 0;  ///< of all
  std::array<bool, max_lead> agreed_{};

  bool noting_ = false;                    ///< when tasks become ready
  bool counting_ = false;                  ///< messages of the graph
  std::vector<int> from_elsewhere_;        ///< messages of a step into a task from other ranks
  std::vector<std::atomic<int>> missing_;  ///< messages until a task is ready
  std::size_t stride_ = 1;                 ///< of these
  std::vector<int> needs_;                 ///< messages of a step into a task
  std::atomic<std::uint64_t> looked_{0};   ///< when the last look for messages that ended began
  static inline thread_local std::uint64_t look_before = 0;
  ReadyTasks ready_tasks_;               ///< that have not begun
  std::vector<int> messages_;            ///< tasks that messages from other ranks fire
  std::vector<std::atomic<Step>> done_;  ///< steps that these have done
  std::vector<char> boundary_;           ///< patches that exchange with other ranks
  std::atomic<std::chrono::steady_clock::rep> last_look_{0};
  std::atomic<bool> broken_{false};  ///< a body threw
  std::atomic<Step> dt_known_{0};    ///< the last step whose dt is known

  std::atomic<Step> completed_{0};  ///< the first step that some patch has not finished
  std::mutex gate_;
  std::vector<Parked> parked_;
};

}  // namespace

int available_threads() {
  return oneapi::tbb::info::default_concurrency();
}

std::unique_ptr<Executor> make_flow_executor(TaskGraph graph, TaskBodies bodies, int threads,
                                             bool verify, Remote* remote) {
  return std::make_unique<FlowExecutor>(std::move(graph), std::move(bodies), threads, verify,
                                        remote);
}

}  // namespace lahar
