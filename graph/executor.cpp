#include "graph/executor.h"

#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/info.h>

#include <algorithm>
#include <memory>
#include <mutex>
#include <random>

#include "graph/distributed_flow.h"
#include "graph/local_flow.h"

namespace lahar {

int available_threads() {
  return oneapi::tbb::info::default_concurrency();
}

void allow_threads(int threads) {
  using oneapi::tbb::global_control;
  constexpr auto limit = global_control::max_allowed_parallelism;
  static std::mutex mutex;
  static std::unique_ptr<global_control> own;
  const std::lock_guard lock(mutex);
  const auto wanted = static_cast<std::size_t>(threads);
  if (wanted <= global_control::active_value(limit)) return;
  // The smallest limit that exists holds for all. The former one ends when the new one has begun.
  own = std::make_unique<global_control>(limit, wanted);
}

void Executor::request_stop(Step step) {
  stop_before(step + max_lead);
}

void Executor::stop_before(Step step) {
  Step end = end_.load(std::memory_order_relaxed);
  while (step < end && !end_.compare_exchange_weak(end, step, std::memory_order_acq_rel)) {
  }
}

namespace {

class SerialExecutor final : public Executor {
 public:
  using Executor::Executor;

  Step run(Step first, Step end) override {
    end_ = end;
    Step step = first;
    for (; step < end_; ++step) {
      for (int s = 0; s < static_cast<int>(graph_.stages.size()); ++s) {
        const bool begins_round = graph_.has_dt && s % graph_.stages_per_round() == 0;
        if (begins_round && (step > first || s > 0))
          bodies_.set_dt(graph_.round_at(step, s / graph_.stages_per_round()));
        for (int p = 0; p < graph_.patches; ++p) bodies_.run(s, p, step);
      }
      bodies_.completed(step);
    }
    return step;
  }
};

/// Plays the token game of the graph: a task is ready when every edge into it holds a token.
class RandomExecutor final : public Executor {
 public:
  RandomExecutor(TaskGraph graph, TaskBodies bodies, std::uint64_t seed)
      : Executor(std::move(graph), std::move(bodies)), random_(seed) {}

  Step run(Step first, Step end) override {
    end_ = end;
    if (first >= end) return end;
    const auto n = static_cast<std::size_t>(graph_.tasks());
    missing_.assign(n, 0);
    step_.assign(n, first);
    finished_.assign(static_cast<std::size_t>(graph_.patches), first);
    completed_ = first;
    ready_.clear();
    for (std::size_t t = 0; t < n; ++t) {
      missing_[t] = graph_.in_step[t];
    }
    if (graph_.has_dt) {  // that of the first round is known: its task counts as done
      const auto dt = static_cast<std::size_t>(graph_.dt_task());
      missing_[dt] = graph_.in_lag[dt];
      step_[dt] = first + 1;
      pass_tokens(graph_.dt_task(), 0);
    }
    for (std::size_t t = 0; t < n; ++t)
      if (missing_[t] == 0) ready_.push_back(static_cast<int>(t));
    while (!ready_.empty()) fire_one();
    return end_;
  }

 private:
  void fire_one() {
    std::uniform_int_distribution<std::size_t> any(0, ready_.size() - 1);
    std::swap(ready_[any(random_)], ready_.back());
    const int task = ready_.back();
    const auto t = static_cast<std::size_t>(task);
    if (step_[t] >= end_) {  // a stop was requested after it became ready
      ready_.pop_back();
      return;
    }
    if (!graph_.is_dt(task) && step_[t] >= completed_ + max_lead && graph_.stage_of(task) == 0) {
      held_.push_back(task);  // too far ahead of the slowest patch
      ready_.pop_back();
      return;
    }
    ready_.pop_back();
    const Step step = step_[t]++;
    missing_[t] = graph_.in_step[t] + graph_.in_lag[t];
    if (graph_.is_dt(task))
      bodies_.set_dt(graph_.round_at(step, graph_.round_of(task)));
    else
      bodies_.run(graph_.stage_of(task), graph_.patch_of(task), step);
    const bool last_stage =
        !graph_.is_dt(task) && graph_.stage_of(task) + 1 == static_cast<int>(graph_.stages.size());
    if (last_stage) finish(graph_.patch_of(task));
    pass_tokens(task, 0);
    if (step + 1 < end_) pass_tokens(task, 1);
    collect_ready(task);
  }

  void finish(int patch) {
    ++finished_[static_cast<std::size_t>(patch)];
    while (*std::min_element(finished_.begin(), finished_.end()) > completed_) {
      bodies_.completed(completed_++);
      ready_.insert(ready_.end(), held_.begin(), held_.end());
      held_.clear();
    }
  }

  void pass_tokens(int task, int lag) {
    for (const Edge& edge : graph_.out(task))
      if (edge.lag == lag) --missing_[static_cast<std::size_t>(edge.to)];
  }

  void collect_ready(int task) {
    for (const Edge& edge : graph_.out(task)) {
      const int to = edge.to;
      if (missing_[static_cast<std::size_t>(to)] == 0 &&
          step_[static_cast<std::size_t>(to)] < end_ &&
          std::find(ready_.begin(), ready_.end(), to) == ready_.end() &&
          std::find(held_.begin(), held_.end(), to) == held_.end())
        ready_.push_back(to);
    }
  }

  std::mt19937_64 random_;
  std::vector<int> missing_;  ///< tokens that each task still waits for
  std::vector<Step> step_;    ///< the step that each task does next
  std::vector<Step> finished_;
  Step completed_ = 0;
  std::vector<int> ready_, held_;
};

}  // namespace

std::unique_ptr<Executor> make_executor(TaskGraph graph, TaskBodies bodies,
                                        const ExecutorOptions& options, Remote* remote) {
  switch (options.mode) {
    case ExecutionMode::serial:
      return make_serial_executor(std::move(graph), std::move(bodies));
    case ExecutionMode::random_order:
      return make_random_executor(std::move(graph), std::move(bodies), options.seed);
    case ExecutionMode::bulk:
      return make_bulk_executor(std::move(graph), std::move(bodies), options.threads, remote);
    case ExecutionMode::flow_graph:
      break;
  }
  if (remote)
    return make_distributed_flow(std::move(graph), std::move(bodies), options.threads,
                                 options.verify, *remote);
  return make_local_flow(std::move(graph), std::move(bodies), options.threads, options.verify);
}

std::unique_ptr<Executor> make_serial_executor(TaskGraph graph, TaskBodies bodies) {
  return std::make_unique<SerialExecutor>(std::move(graph), std::move(bodies));
}

std::unique_ptr<Executor> make_random_executor(TaskGraph graph, TaskBodies bodies,
                                               std::uint64_t seed) {
  return std::make_unique<RandomExecutor>(std::move(graph), std::move(bodies), seed);
}

}  // namespace lahar
