/// \file Simulation of steps with a barrier after each phase.
#include <algorithm>
#include <cmath>

#include "runtime/trace/analyse/replay_machine.h"

namespace lahar {

namespace {

class BulkSimulator {
 public:
  explicit BulkSimulator(const ReplayCase& c) : c_(c) {
    patches_of_.resize(static_cast<std::size_t>(c.ranks));
    for (std::size_t p = 0; p < c.patches.size(); ++p)
      patches_of_[static_cast<std::size_t>(c.patches[p].rank)].push_back(static_cast<int>(p));
    came_.assign(patches_of_.size(), 0);
    messages_.assign(patches_of_.size(), 0);
    result_.useful.assign(patches_of_.size() * static_cast<std::size_t>(c.threads), 0);
    result_.spread.assign(static_cast<std::size_t>(c.phases()), 0);
  }

  ReplayResult run() {
    double now = 0;
    const std::size_t recorded = c_.epoch->dt.size();
    for (int step = 0; step < c_.steps; ++step) {
      const auto of_step = static_cast<std::size_t>(step) % recorded;
      if (c_.loop->has_dt && step > 0) now += reduction() + c_.work->gap + c_.epoch->dt[of_step];
      for (int f = 0; f < c_.phases(); ++f) now = take(step, f, now);
      result_.step_end.push_back(now);
      now += reduction() + c_.epoch->completion[of_step];
    }
    result_.total = result_.step_end.empty() ? 0 : result_.step_end.back();
    for (double& spread : result_.spread) spread = std::sqrt(spread / std::max(1, c_.steps));
    return std::move(result_);
  }

 private:
  double reduction() const { return c_.ranks > 1 ? c_.reduction : 0; }

  /// A phase of all ranks, which begin it together; returns when they do the next.
  double take(int step, int phase, double begin) {
    std::fill(came_.begin(), came_.end(), begin);
    std::fill(messages_.begin(), messages_.end(), 0);
    std::vector<double> done;
    for (std::size_t r = 0; r < patches_of_.size(); ++r)
      done.push_back(work(static_cast<int>(r), step, phase, begin));
    double latest = begin, sum = 0, squares = 0;
    for (std::size_t r = 0; r < done.size(); ++r) {
      // Messages are unpacked by one thread, when all have come.
      const double waited = std::max(0.0, came_[r] - done[r]);
      if (messages_[r] > 0) {
        result_.exposed += waited * c_.threads;
        done[r] = std::max(done[r], came_[r]) + messages_[r] * c_.unpacking;
      }
      latest = std::max(latest, done[r]);
      sum += done[r] - begin;
      squares += (done[r] - begin) * (done[r] - begin);
    }
    const auto n = static_cast<double>(done.size());
    result_.spread[static_cast<std::size_t>(phase)] +=
        std::max(0.0, squares / n - sum / n * (sum / n));
    return latest + (c_.ranks > 1 ? c_.barrier[static_cast<std::size_t>(phase)] : 0);
  }

  /// A rank's patches in their order, each by the worker that is free first.
  double work(int rank, int step, int phase, double begin) {
    std::vector<double> free(static_cast<std::size_t>(c_.threads), begin);
    for (const int p : patches_of_[static_cast<std::size_t>(rank)]) {
      const auto worker = std::min_element(free.begin(), free.end());
      const std::size_t at = c_.place(step, phase, p);
      result_.useful[static_cast<std::size_t>(rank * c_.threads + (worker - free.begin()))] +=
          c_.epoch->duration[at];
      *worker += static_cast<double>(c_.epoch->gap[at]) + c_.epoch->duration[at];
      if (!c_.sends(phase)) continue;
      for (const auto& link : c_.patches[static_cast<std::size_t>(p)].links) {
        const auto f = static_cast<std::size_t>(phase), to = static_cast<std::size_t>(link.rank);
        *worker += link.packing[f];
        came_[to] = std::max(came_[to], *worker + link.time[f]);
        ++messages_[to];
        ++result_.messages;
        result_.bytes += link.bytes[f];
      }
    }
    return *std::max_element(free.begin(), free.end());
  }

  const ReplayCase& c_;
  std::vector<std::vector<int>> patches_of_;
  std::vector<double> came_;   ///< the last message to a rank
  std::vector<int> messages_;  ///< to a rank
  ReplayResult result_;
};

}  // namespace

ReplayResult simulate_bulk(const ReplayCase& c) {
  return BulkSimulator(c).run();
}

}  // namespace lahar
