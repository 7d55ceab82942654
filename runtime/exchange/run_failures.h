/// \file What ends a run with an error: failures of patches, and exceptions of those who take its
/// results.
#pragma once

#include <exception>
#include <vector>

#include "runtime/comm/communicator.h"
#include "runtime/exchange/atomic_least.h"
#include "runtime/exchange/failure.h"

namespace lahar {

class RunFailures {
 public:
  /// `counted`: what failures call their steps.
  explicit RunFailures(const char* counted = "step") : counted_(counted) {}

  /// So many patches, none of which has failed.
  void begin(int patches) { poisoned_.assign(static_cast<std::size_t>(patches), 0); }

  /// By the task of a patch, which does no more work.
  void add(int patch, Failure failure);
  /// A patch of another rank failed in this step.
  void learn(Step step) { first_step_.give(step); }
  /// The first step that this rank knows to have failed.
  Step first_step() const { return first_step_.get(); }
  /// Whether a patch does no work in a step: it failed, or would read what a failed one did not
  /// write.
  bool idles(int patch, Step step) const {
    return poisoned_[static_cast<std::size_t>(patch)] || step > first_step_.get();
  }

  /// An observer threw it; the first one is thrown on.
  void keep(std::exception_ptr exception) {
    if (!of_output_) of_output_ = std::move(exception);
  }
  /// Observer::poll threw it, and is not called any more.
  void keep_of_poll(std::exception_ptr exception) { of_poll_ = std::move(exception); }
  const std::exception_ptr& of_poll() const { return of_poll_; }

  /// At rest, on all ranks: throw where anything failed, with the message of what failed first;
  /// `step` is then that of the failure. Collective.
  void throw_first(Step& step, const Communicator& ranks);

 private:
  std::string first_message(Step step, const Communicator& ranks) const;

  const char* counted_;
  std::vector<char> poisoned_;  ///< by patch
  FailureList list_;
  AtomicLeast first_step_;
  std::exception_ptr of_output_, of_poll_;
};

}  // namespace lahar
