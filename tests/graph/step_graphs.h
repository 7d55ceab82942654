/// \file Stage lists and neighbourhoods for the tests of step graphs and executors.
#pragma once

#include <algorithm>
#include <memory>
#include <mutex>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "graph/local_flow.h"

namespace lahar::test {

using Neighbours = std::vector<std::vector<int>>;

/// nx x ny patches that touch the up to eight patches around them.
inline Neighbours block(int nx, int ny) {
  Neighbours result;
  for (int p = 0; p < nx * ny; ++p) {
    auto& list = result.emplace_back();
    for (int q = 0; q < nx * ny; ++q)
      if (q != p && std::abs(q % nx - p % nx) <= 1 && std::abs(q / nx - p / nx) <= 1)
        list.push_back(q);
  }
  return result;
}

/// Pairs of patches are neighbours with the given probability.
inline Neighbours irregular(int n, double probability, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  Neighbours result(static_cast<std::size_t>(n));
  for (int p = 0; p < n; ++p)
    for (int q = p + 1; q < n; ++q)
      if (std::uniform_real_distribution<>()(random) < probability) {
        result[static_cast<std::size_t>(p)].push_back(q);
        result[static_cast<std::size_t>(q)].push_back(p);
      }
  return result;
}

/// Particles to the first stage, sums to the second; with or without an adaptive step.
inline std::vector<Stage> one_exchange(bool adaptive = false) {
  return {{.name = "P2G", .exchange = "particles"},
          {.name = "integrate", .exchange = "sums", .needs_dt = adaptive},
          {.name = "locate", .gives_dt = adaptive}};
}

/// Two exchanges of sums within the step; dt is needed late.
inline std::vector<Stage> two_exchanges(bool adaptive = false) {
  return {{.name = "P2G", .exchange = "particles"}, {.name = "velocity", .exchange = "sums"},
          {.name = "stress", .needs_dt = adaptive}, {.name = "integrate", .exchange = "force"},
          {.name = "locate", .gives_dt = adaptive}, {.name = "output"}};
}

/// A round of a solver: what all patches find together is needed after an exchange.
inline std::vector<Stage> solver_round() {
  return {{.name = "multiply"},
          {.name = "advance", .exchange = "product", .gives_dt = true, .needs_dt = true}};
}

enum class Kind { serial, random, flow };

inline std::unique_ptr<Executor> make_executor(Kind kind, TaskGraph graph, TaskBodies bodies,
                                               int threads = 2) {
  if (kind == Kind::serial) return make_serial_executor(std::move(graph), std::move(bodies));
  if (kind == Kind::random) return make_random_executor(std::move(graph), std::move(bodies), 7);
  return make_local_flow(std::move(graph), std::move(bodies), threads, true);
}

/// What every executor is run as.
struct Way {
  Kind kind;
  int threads;
};
inline constexpr Way all_ways[] = {{Kind::serial, 1}, {Kind::random, 1}, {Kind::flow, 1},
                                   {Kind::flow, 2},   {Kind::flow, 3},   {Kind::flow, 8}};

/// Checks, beside the executor and from the stage list alone, that everything a task needs was done
/// when it began and that nobody who still needs its last result was overtaken; counts.
class Watch {
 public:
  Watch(std::vector<Stage> stages, Neighbours neighbours, Step first = 0)
      : stages_(std::move(stages)),
        neighbours_(std::move(neighbours)),
        adaptive_(std::any_of(stages_.begin(), stages_.end(),
                              [](const Stage& stage) { return stage.gives_dt; })),
        done_(stages_.size() * neighbours_.size(), first),
        dt_of_(first + 1),
        completed_(first) {}

  void run(int stage, int patch, Step step) {
    const std::scoped_lock lock(mutex_);
    const int n = static_cast<int>(stages_.size());
    expect(done(stage, patch) == step, "each task takes the steps in order");
    const int before = stage == 0 ? n - 1 : stage - 1;
    const Step needed = stage == 0 ? step : step + 1;
    expect(done(before, patch) == needed, "a stage follows the one before on its patch");
    if (!stages_[static_cast<std::size_t>(stage)].exchange.empty())
      for (const int q : neighbours_[static_cast<std::size_t>(patch)])
        expect(done(before, q) >= needed && done(before, q) <= needed + ahead_,
               "an exchange takes what neighbours did in this step");
    if (adaptive_ && stages_[static_cast<std::size_t>(stage)].needs_dt)
      expect(dt_of_ > step, "dt is known where it is needed");
    ++done_[index(stage, patch)];
    ++firings_;
  }

  void set_dt(Step step) {
    const std::scoped_lock lock(mutex_);
    expect(step == dt_of_, "dt is set for one step after the other");
    ++dt_of_;
    for (std::size_t s = 0; s < stages_.size(); ++s)
      for (std::size_t p = 0; p < neighbours_.size(); ++p)
        if (stages_[s].gives_dt)
          expect(done_[s * neighbours_.size() + p] == step, "dt comes from all patches");
  }

  void completed(Step step) {
    const std::scoped_lock lock(mutex_);
    expect(step == completed_++, "steps are completed in order, each once");
    for (int p = 0; p < static_cast<int>(neighbours_.size()); ++p)
      expect(done(static_cast<int>(stages_.size()) - 1, p) > step, "a completed step is done");
  }

  TaskBodies bodies() {
    return {[this](int s, int p, Step step) { run(s, p, step); },
            [this](Step step) { set_dt(step); }, [this](Step step) { completed(step); }};
  }

  /// For a graph whose steps have several rounds of the stages: rounds are what this calls steps. A
  /// neighbour may have given what the next round takes: there are two copies.
  TaskBodies bodies_of_rounds(int rounds) {
    ahead_ = rounds - 1;
    const int n = static_cast<int>(stages_.size());
    return {[this, n, rounds](int s, int p, Step step) { run(s % n, p, step * rounds + s / n); },
            [this](Step round) { set_dt(round); },
            [this, rounds](Step step) {
              for (int k = 0; k < rounds; ++k) completed(step * rounds + k);
            }};
  }

  /// True if every task has done exactly the steps before `end`.
  bool all_done(Step end) const {
    return completed_ == end &&
           std::all_of(done_.begin(), done_.end(), [&](Step s) { return s == end; });
  }
  long firings() const { return firings_; }
  Step dt_known_before() const { return dt_of_; }
  const std::string& wrong() const { return wrong_; }  ///< the first expectation not met

 private:
  std::size_t index(int stage, int patch) const {
    return static_cast<std::size_t>(stage) * neighbours_.size() + static_cast<std::size_t>(patch);
  }
  Step done(int stage, int patch) const { return done_[index(stage, patch)]; }
  void expect(bool met, const char* what) {
    if (!met && wrong_.empty()) wrong_ = what;
  }

  std::mutex mutex_;
  std::vector<Stage> stages_;
  Neighbours neighbours_;
  bool adaptive_;
  Step ahead_ = 0;          ///< rounds that a neighbour may be ahead
  std::vector<Step> done_;  ///< steps done by each task
  Step dt_of_, completed_;
  long firings_ = 0;
  std::string wrong_;
};

}  // namespace lahar::test
