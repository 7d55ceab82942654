/// \file Messages from other ranks fire tasks, too. For that the messages of the graph are counted
/// here, and not by oneTBB a second time: a node gets one message, when its task is ready.
/// Whichever node fires does the task that is most urgent, because priorities of nodes know no
/// steps.
///
/// A task and its rest are one body most of the time. Where ranks have to agree on the time step,
/// some rests are deferred: threads do them while they wait for the agreement
/// (graph/deferred_work.h).
///
/// Threads: a worker takes a node that is ready and calls fire(): the most urgent task, then
/// messages to all that follow it, then a look for messages from other ranks (Remote::progress),
/// which calls arrived(), dt_agreed() and step_agreed(). The task of such a message waits for
/// nothing else and is short: the worker that finds the message does it. A worker that leaves no
/// task ready stays and looks on, because oneTBB does not say when it is idle. The thread of run()
/// looks for messages, too, while the graph is empty. TaskBodies::completed is called by the worker
/// that finds the agreement on the step. A body that throws cancels the graph and ends all looking;
/// run() throws what it threw.
#include "graph/distributed_flow.h"

#include <algorithm>
#include <chrono>
#include <optional>

#include "graph/back_off.h"
#include "graph/deferred_work.h"
#include "graph/flow_executor.h"
#include "graph/ready_tasks.h"

namespace lahar {

namespace {

namespace flow = oneapi::tbb::flow;
using Clock = std::chrono::steady_clock;

class DistributedFlow final : public FlowExecutor {
 public:
  DistributedFlow(TaskGraph graph, TaskBodies bodies, int threads, bool verify, Remote& remote)
      : FlowExecutor(std::move(graph), std::move(bodies), threads, verify),
        remote_(remote),
        done_(step_.size()) {
    find_boundary();
    if (graph_.has_dt) deferred_work_.emplace(graph_, boundary_, threads, remote_.has_cores());
    std::vector<int> needs(step_.size());
    for (int t = 0; t < graph_.tasks(); ++t) {  // the nodes of tasks on other ranks never fire
      needs[static_cast<std::size_t>(t)] = messages_into(t);
      nodes_.emplace_back(*flow_, 1, [this](const flow::continue_msg&) { fire_most_urgent(); });
    }
    count_messages(std::move(needs));
  }

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
    const bool goes_on = is_taken(step + 1);
    for (const Edge& edge : graph_.out(task))
      if (edge.lag == 0 || goes_on) put(edge.to);
  }
  void dt_agreed(Step round) override {
    put(graph_.dt_task(static_cast<int>(round % graph_.rounds)));
  }

  /// Agreements may be found in another order than they were made.
  void step_agreed(Step step) override {
    const std::scoped_lock lock(completion_);
    agreed_.add(step, [this](Step all) { complete(all); });
    give_steps_without_patches();
  }

 private:
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
  }

  bool is_rest(int task) const {
    return !graph_.is_global(task) && !graph_.is_elsewhere(task) &&
           graph_.stages[static_cast<std::size_t>(graph_.stage_of(task))].is_rest;
  }
  /// Messages in a step. A rest has one, from the list of deferred work; dt waits for all ranks to
  /// agree.
  int messages_into(int task) const {
    if (is_rest(task)) return 1;
    return messages_from_before(task) + graph_.in_step[static_cast<std::size_t>(task)] +
           (graph_.is_dt(task) ? 1 : 0);
  }
  Waits who_waits(int task) const {
    if (graph_.is_global(task)) return Waits::all_ranks;
    return boundary_[static_cast<std::size_t>(graph_.patch_of(task))] ? Waits::neighbours
                                                                      : Waits::nobody_else;
  }

  void take_steps() override {
    agreed_.begin(first_);
    dt_known_ = first_;
    if (deferred_work_) deferred_work_->begin(first_);
    for (auto& done : done_) done = first_;
    looked_ = 0;
    ready_tasks_.clear();
    for (int t = 0; t < graph_.tasks(); ++t) {
      if (graph_.is_elsewhere(t)) continue;
      const bool known = graph_.is_dt(t) && is_known_dt(t, first_);
      const int messages = known ? messages_into(t) : messages_from_before(t);
      for (int k = 0; k < messages; ++k) put(t);
    }
    {
      const std::scoped_lock lock(completion_);
      give_steps_without_patches();
    }
    flow_->wait_for_all();
    while (!all_done()) {  // a rank without patches has no body to look for messages
      look_until_ready();
      flow_->wait_for_all();
    }
  }

  void put(int task) override {
    if (!count_message(task)) return;
    ready_tasks_.add(task, step_[static_cast<std::size_t>(task)], who_waits(task));
    nodes_[static_cast<std::size_t>(task)].try_put(flow::continue_msg{});
  }

  // --- a task -----------------------------------------------------------------------------------

  /// When the graph is cancelled, threads must stop looking for messages.
  void fire_most_urgent() {
    try {
      fire(ready_tasks_.take());
    } catch (...) {
      broken_ = true;
      throw;
    }
  }

  void fire(int task) {
    const Step step = begin_task(task);
    if (graph_.is_dt(task)) {
      if (!is_known_dt(task, step)) bodies_.set_dt(round_of_dt(task, step));
      if (deferred_work_) deferred_work_->dt_is_known();
      if (graph_.round_of(task) == 0) set_dt_known(step);
      pass_on(task, step);
    } else if (graph_.collects_dt(task)) {
      if (!is_known_dt(task, step)) remote_.give_dt(round_of_dt(task, step));
      pass_on(task, step);
    } else if (graph_.has_rest(graph_.stage_of(task))) {
      fire_with_rest(task, step);
    } else {
      if (is_rest(task)) deferred_work_->rest_begins();
      bodies_.run(graph_.stage_of(task), graph_.patch_of(task), step);
      pass_on(task, step);
    }
    look_for_messages();
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
  }

  /// What follows the body of a task.
  void pass_on(int task, Step step) {
    // Counters would come from memory one by one: ask for all of them at once.
    for (const Edge& edge : graph_.out(task)) __builtin_prefetch(&missing(edge.to), 1);
    stamp(task, step);
    if (is_last_stage(task)) finish(step);
    if (is_taken(step + 1))
      for (const Edge& edge : graph_.out(task))
        if (edge.lag == 1) put(edge.to);
    if (needs_permit(task)) request_permit(task, step + 1);
    for (const Edge& edge : graph_.out(task))
      if (edge.lag == 0 && !is_rest(edge.to)) put(edge.to);
  }

  // --- messages ---------------------------------------------------------------------------------

  /// At the end of a body. A thread that finds nothing ready looks on, so that at least one does
  /// while messages are to come; oneTBB delivers what this body leads to when it returns, which is
  /// not needed as long as nothing is ready.
  void look_for_messages() {
    // Tasks of empty patches take less time than a look. The more is ready here, the less a message
    // is in a hurry, and the more of them one look finds.
    constexpr Clock::rep shortest = 20'000;  // ns
    constexpr int few = 2, many = 16;
    const int ready = ready_tasks_.size();
    const Clock::rep interval = shortest * std::clamp(ready - few, 1, many);
    const Clock::rep now = Clock::now().time_since_epoch().count();
    if (now - last_look_.load(std::memory_order_relaxed) > interval) {
      last_look_.store(now, std::memory_order_relaxed);
      look();
    } else {
      remote_.post(/*all=*/ready <= few);
    }
    look_until_ready();
  }

  /// The thread that looks calls arrived(), which notes when the look before this one began.
  bool look() {
    if (!noting_) return remote_.progress(*this);
    look_before = looked_.load(std::memory_order_relaxed);
    const std::uint64_t begin = bodies_.clock();
    const bool found = remote_.progress(*this);
    looked_.store(begin, std::memory_order_relaxed);
    return found;
  }

  void look_until_ready() {
    if (ready_tasks_.size() > 0 || all_done()) return;
    if (bodies_.looking) bodies_.looking(false);
    for (Waiting waiting(remote_.has_cores()); ready_tasks_.size() <= 0 && !all_done();)
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

  // --- steps ------------------------------------------------------------------------------------

  /// A rank without patches finishes steps as soon as it may: not before it is known, from the
  /// agreement max_lead steps before and from dt, that they are taken. Under completion_.
  void give_steps_without_patches() {
    if (graph_.own_patches() > 0) return;
    const Step known = graph_.has_dt ? dt_known_.load() + 1 : end_.load();
    while (finished_.next() < std::min({known, end_.load(), agreed_.next() + max_lead}))
      finished_.add(finished_.next(), [this](Step step) { own_patches_finished(step); });
  }
  void own_patches_finished(Step step) override { remote_.give_step(step); }

  void set_dt_known(Step step) {
    dt_known_ = step;
    if (graph_.own_patches() > 0) return;
    const std::scoped_lock lock(completion_);
    give_steps_without_patches();
  }

  Remote& remote_;
  std::vector<char> boundary_;                 ///< patches that exchange with other ranks
  std::vector<int> messages_;                  ///< tasks that messages from other ranks fire
  std::vector<std::atomic<Step>> done_;        ///< steps that these have done
  std::optional<DeferredWork> deferred_work_;  ///< if ranks have to agree on the time step
  ReadyTasks ready_tasks_;                     ///< those that have not begun
  StepsInOrder agreed_;                        ///< steps that all ranks have finished
  std::atomic<Step> dt_known_{0};              ///< the last step whose dt is known
  std::atomic<bool> broken_{false};            ///< a body threw
  std::atomic<Clock::rep> last_look_{0};
  std::atomic<std::uint64_t> looked_{0};  ///< when the last look for messages that ended began
  /// When the look before the present one of this thread began.
  static inline thread_local std::uint64_t look_before = 0;
};

}  // namespace

std::unique_ptr<Executor> make_distributed_flow(TaskGraph graph, TaskBodies bodies, int threads,
                                                bool verify, Remote& remote) {
  return std::make_unique<DistributedFlow>(std::move(graph), std::move(bodies), threads, verify,
                                           remote);
}

}  // namespace lahar
