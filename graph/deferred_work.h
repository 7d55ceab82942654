/// \file Which tasks defer their rest, to be done while ranks agree on the time step.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <mutex>
#include <utility>
#include <vector>

#include "graph/task_graph.h"

namespace lahar {

/// A task that gives the time step begins, has done what gives it, and its rest is done at once or
/// deferred. Deferred work is released when the last such task of the step begins: then threads
/// have nothing else to do than this work until the time step is known, without which none of these
/// tasks begins again.
///
/// How many are deferred follows from how many were left when the time step became known. These
/// are patches in the middle of a rank, for whose neighbours no other rank waits; if they are too
/// few and ranks have cores of their own, also those that exchange, whose rests come first when
/// they are released. (Two ranks that share a core fill each other's waits.)
class DeferredWork {
 public:
  /// `boundary`: by patch, whether it exchanges with other ranks.
  DeferredWork(const TaskGraph& graph, const std::vector<char>& boundary, int threads,
               bool has_cores)
      : tasks_(graph.own_patches()), enough_(threads + 1) {
    find_order(graph, boundary, has_cores);
  }

  /// Before steps are taken.
  void begin(Step first) {
    begun_ = 0;
    waiting_ = 0;
    deferred_.clear();
    released_ = first - 1;
  }

  /// A task begins that has a rest. True if the rest is to be deferred. Calls `release` with all
  /// that need wait no longer.
  bool task_begins(int patch, Step step, auto release) {
    if (begun_.fetch_add(1, std::memory_order_acq_rel) % tasks_ == tasks_ - 1) {
      std::vector<int> free;
      {
        const std::scoped_lock lock(mutex_);
        released_ = step;
        free.swap(deferred_);
      }
      for (const int rest : free) release(rest);
    }
    return order_[static_cast<std::size_t>(patch)] < most_.load(std::memory_order_relaxed);
  }

  /// By such a task, before it gives the time step.
  void defer(int rest, Step step, auto release) {
    waiting_.fetch_add(1, std::memory_order_relaxed);
    {
      const std::scoped_lock lock(mutex_);
      if (released_ < step) return deferred_.push_back(rest);
    }
    release(rest);
  }

  /// A rest begins that was deferred.
  void rest_begins() { waiting_.fetch_sub(1, std::memory_order_relaxed); }

  /// The next time step is known. If no deferred work is left, somebody may have had nothing to
  /// do; much that is left was deferred in vain, and its particles have to be fetched from memory
  /// again. By one thread at a time.
  void dt_is_known() {
    const int left = waiting_.load(std::memory_order_relaxed);
    const int most = most_.load(std::memory_order_relaxed);
    if (left < enough_)
      most_ = std::min(most + 1 + most / 4, able_);
    else if (left > 2 * enough_)
      most_ = std::max(most - (left - enough_) / 2, 0);
  }

 private:
  /// Patches that are furthest from those that exchange with other ranks come first, and these at
  /// most as the last ones.
  void find_order(const TaskGraph& graph, const std::vector<char>& boundary, bool has_cores) {
    const auto n = static_cast<std::size_t>(graph.patches);
    std::vector<std::vector<int>> next(n);
    for (const Edge& edge : graph.edges)
      if (edge.exchange && !graph.is_global(edge.from) && !graph.is_global(edge.to))
        next[static_cast<std::size_t>(graph.patch_of(edge.from))].push_back(
            graph.patch_of(edge.to));
    const int far = graph.patches;
    std::vector<int> distance(n, far), reached;
    const auto reach = [&](int patch, int at) {
      if (distance[static_cast<std::size_t>(patch)] < far) return;
      distance[static_cast<std::size_t>(patch)] = at;
      reached.push_back(patch);
    };
    for (int p = 0; p < graph.patches; ++p)
      if (boundary[static_cast<std::size_t>(p)]) reach(p, 0);
    for (std::size_t i = 0; i < reached.size(); ++i) {
      const auto p = static_cast<std::size_t>(reached[i]);
      for (const int q : next[p]) reach(q, distance[p] + 1);
    }
    std::vector<int> able;
    for (int p = 0; p < graph.own_patches(); ++p)
      if (has_cores || distance[static_cast<std::size_t>(p)] > 0) able.push_back(p);
    std::stable_sort(able.begin(), able.end(), [&](int a, int b) {
      return distance[static_cast<std::size_t>(a)] > distance[static_cast<std::size_t>(b)];
    });
    able_ = static_cast<int>(able.size());
    order_.assign(n, far);
    for (std::size_t k = 0; k < able.size(); ++k)
      order_[static_cast<std::size_t>(able[k])] = static_cast<int>(k);
  }

  const int tasks_;         ///< in a step, that have a rest
  const int enough_;        ///< that are left: everybody had something to do
  std::vector<int> order_;  ///< by patch: rests of the first most_ are deferred
  int able_ = 0;            ///< that may be deferred at all
  std::atomic<int> most_{0};
  std::atomic<std::int64_t> begun_{0};  ///< tasks that have a rest
  std::atomic<int> waiting_{0};         ///< deferred and not begun
  std::mutex mutex_;
  std::vector<int> deferred_;  ///< not released
  Step released_ = -1;         ///< the last step whose rests need not wait
};

}  // namespace lahar
