#include "runtime/program/run_checkpoints.h"

#include <algorithm>
#include <utility>

#include "runtime/program/signals.h"

namespace lahar {

namespace {

/// Longer intervals are none: a clock cannot count them.
constexpr double most_minutes = 1e9;

std::chrono::steady_clock::duration of_minutes(double minutes) {
  return std::chrono::duration_cast<std::chrono::steady_clock::duration>(
      std::chrono::duration<double, std::ratio<60>>(minutes < most_minutes ? minutes : 0.0));
}

}  // namespace

RunCheckpoints::RunCheckpoints(CheckpointHeader header, double minutes, CheckpointOptions options,
                               const Communicator& ranks)
    : header_(std::move(header)),
      interval_(of_minutes(minutes)),
      due_(Clock::now() + interval_),
      writer_(std::move(options), ranks) {}

bool RunCheckpoints::wanted() {
  if (take_checkpoint_request()) asked_ = true;
  if (interval_ > Clock::duration::zero() && Clock::now() >= due_) asked_ = true;
  return asked_;
}

void RunCheckpoints::write(const SimulationState& state) {
  asked_ = false;
  due_ = Clock::now() + interval_;
  if (state.run.step == last_) return;
  header_.run = state.run;
  writer_.write(header_, state);
  last_ = state.run.step;
}

}  // namespace lahar
