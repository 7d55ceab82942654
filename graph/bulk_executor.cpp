/// \file The step graph as codes without one run it: all patches do a phase, then everybody waits
/// for everybody. For comparison only.
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>

#include "graph/back_off.h"
#include "graph/executor.h"

namespace lahar {

namespace {

class BulkExecutor final : public Executor {
 public:
  BulkExecutor(TaskGraph graph, TaskBodies bodies, int threads, Remote* remote)
      : Executor(std::move(graph), std::move(bodies)), remote_(remote), arena_(threads) {
    allow_threads(threads);
    const auto stages = graph_.stages.size();
    came_.assign(stages, 0);
    expected_.assign(stages, 0);
    for (std::size_t s = 0; s < stages; ++s)
      if (!graph_.stages[(s + 1) % stages].exchange.empty()) expected_[s] = graph_.elsewhere;
  }

  Step run(Step first, Step end) override {
    end_ = end;
    arena_.execute([&] {
      for (Step step = first; step < end_; ++step) take(step, first);
    });
    return end_;
  }

  void arrived(int stage, int) override { ++came_[static_cast<std::size_t>(stage)]; }
  void dt_agreed(Step /*round*/) override { agreed_ = true; }
  void step_agreed(Step) override { agreed_ = true; }

 private:
  void take(Step step, Step first) {
    for (int s = 0; s < static_cast<int>(graph_.stages.size()); ++s) {
      if (graph_.has_dt && s % graph_.stages_per_round() == 0 && (step > first || s > 0))
        set_dt(graph_.round_at(step, s / graph_.stages_per_round()));
      const bool has_rest = graph_.has_rest(s);
      oneapi::tbb::parallel_for(0, graph_.own_patches(), [&](int p) {
        if (has_rest)
          run_with_rest(s, p, step);
        else
          bodies_.run(s, p, step);
      });
      if (has_rest) ++s;
      if (remote_) wait_for_messages(s, step);
    }
    if (remote_) {
      agreed_ = false;
      remote_->give_step(step);
      wait_until([&] { return agreed_; });
    }
    bodies_.completed(step);
  }

  void set_dt(Step round) {
    if (remote_) {
      agreed_ = false;
      remote_->give_dt(round);
      wait_until([&] { return agreed_; });
    }
    bodies_.set_dt(round);
  }

  void wait_until(const auto& is_over) {
    for (Waiting waiting(remote_->has_cores()); !is_over();)
      waiting.looked(remote_->progress(*this));
  }

  void wait_for_messages(int stage, Step step) {
    const auto s = static_cast<std::size_t>(stage);
    wait_until([&] { return came_[s] >= expected_[s]; });
    for (int e = 0; e < expected_[s]; ++e) bodies_.run(stage, graph_.own_patches() + e, step);
    came_[s] = 0;
    remote_->wait_for_all();
  }

  Remote* remote_;
  oneapi::tbb::task_arena arena_;
  std::vector<int> came_, expected_;  ///< messages after each stage
  bool agreed_ = false;
};

}  // namespace

std::unique_ptr<Executor> make_bulk_executor(TaskGraph graph, TaskBodies bodies, int threads,
                                             Remote* remote) {
  return std::make_unique<BulkExecutor>(std::move(graph), std::move(bodies), threads, remote);
}

}  // namespace lahar
