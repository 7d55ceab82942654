/// \file The tasks of a rank that are ready to run, the most urgent first.
#pragma once

#include <algorithm>
#include <atomic>
#include <functional>
#include <mutex>
#include <tuple>
#include <vector>

#include "graph/task_graph.h"

namespace lahar {

/// Who waits for a task, the most urgent first.
enum class Waits { all_ranks, neighbours, nobody_else };

/// Who takes a task gets the one for which others wait most: agreements of all ranks come before
/// what neighbours of this rank wait for, that before what only this rank does, and of each the
/// earliest step. Of the last patches come in their order, in which neighbours follow each other;
/// of those before in any: in that order, two ranks of some dozen patches that all exchange took a
/// tenth longer. Any thread.
class ReadyTasks {
 public:
  void add(int task, Step step, Waits waits) {
    const std::scoped_lock lock(mutex_);
    heap_.push_back({waits, step, waits == Waits::nobody_else ? task : 0, task});
    std::push_heap(heap_.begin(), heap_.end(), std::greater<>());
    size_.fetch_add(1, std::memory_order_acq_rel);
  }
  /// There must be one.
  int take() {
    const std::scoped_lock lock(mutex_);
    std::pop_heap(heap_.begin(), heap_.end(), std::greater<>());
    const int task = heap_.back().task;
    heap_.pop_back();
    size_.fetch_sub(1, std::memory_order_acq_rel);
    return task;
  }
  void clear() {
    heap_.clear();
    size_ = 0;
  }
  int size() const { return size_.load(std::memory_order_acquire); }

 private:
  struct Ready {
    Waits waits;
    Step step;
    int order, task;
    bool operator>(const Ready& other) const {
      return std::tie(waits, step, order) > std::tie(other.waits, other.step, other.order);
    }
  };

  std::mutex mutex_;
  std::vector<Ready> heap_;
  std::atomic<int> size_{0};  ///< of the heap
};

}  // namespace lahar
