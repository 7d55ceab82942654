/// \file What happens when a rank is lost: the others say so and end.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "graph/stage.h"
#include "runtime/comm/communicator.h"

namespace lahar {

/// A thread that looks, ten times a second, whether the processes of the other ranks on this
/// machine are still there. If one is gone, the first of those that are left says which, after
/// which step, and all end with exit_rank; launchers see to those on other machines. Processes that
/// stay but take no step for `patience` after they were asked to stop are ended, too: a signal to a
/// job that is dying must not wait for a dead neighbour.
///
/// To be destroyed when all ranks have come through. With one rank it does nothing.
class RankWatch {
 public:
  /// Collective. `stop_asked` tells whether a signal has asked this rank to stop.
  RankWatch(const Communicator& ranks, std::function<bool()> stop_asked);
  ~RankWatch();

  /// All ranks have finished the steps before `step`.
  void steps_done(Step step) { steps_done_.store(step, std::memory_order_relaxed); }

  /// What follows, such as writing the last state, takes its time.
  void steps_ended() { ended_.store(true, std::memory_order_relaxed); }

  /// At least; a run whose steps take longer gets three times the longest.
  static constexpr std::chrono::seconds patience{10};

 private:
  struct Peer {
    int rank;
    Index process;
  };
  void loop();
  void look_at_peers() const;
  void look_at_clock();
  [[noreturn]] void end(const std::string& message) const;

  int rank_ = 0;
  std::vector<Peer> peers_;  ///< on this machine, ascending rank
  std::function<bool()> stop_asked_;
  std::atomic<Step> steps_done_{0};
  std::atomic<bool> ended_{false};
  std::chrono::steady_clock::time_point moved_ = std::chrono::steady_clock::now();
  std::chrono::steady_clock::duration longest_{};  ///< between two looks at which steps were done
  Step moved_step_ = 0;                            ///< when it was last looked at
  bool asked_ = false;

  std::mutex mutex_;
  std::condition_variable ending_;
  bool ends_ = false;
  std::thread thread_;
};

}  // namespace lahar
