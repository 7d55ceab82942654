#include "runtime/step/staging_budget.h"

#include <cmath>

#include "physics/base/error.h"

namespace lahar {

bool StagingBudget::is_outgrown(Index next_id, std::size_t bytes_of_particle) const {
  if (!largest_) return false;
  // A little more is let pass, so that there always is room for many until the next time.
  const auto came = static_cast<std::size_t>(next_id - next_id_);
  return *largest_ + came * bytes_of_particle > bytes_ + bytes_ / 16;
}

void need_memory_of_copies(const StagedSizes& sizes, const OutputPlan& plan,
                           std::size_t staging_bytes, const MemoryLimit& memory,
                           const Communicator& ranks) {
  if (!std::isfinite(memory.bytes)) return;
  constexpr double frames = 3, states = 2;  // see ExecutionOptions::staging_bytes
  const auto copies = [&](bool planned, double number, std::size_t size) {
    return planned && size <= staging_bytes ? number * static_cast<double>(size) : 0.0;
  };
  const double bytes =
      static_cast<double>(sizes.patches) +
      copies(plan.frame_steps > 0 || plan.frame_dt > 0, frames, sizes.frame) +
      copies(plan.checkpoint_steps > 0 || plan.checkpoint_minutes > 0, states, sizes.state);
  const double most = ranks.max(bytes);
  if (most <= memory.bytes) return;
  Problem problem = too_much_memory(
      most, "patches and copies of frames and checkpoints that wait to be written", memory);
  problem.where = "/post_processing";
  problem.hint =
      "give a smaller --staging: steps then wait while larger ones are written; or " + problem.hint;
  throw InputError({problem});
}

}  // namespace lahar
