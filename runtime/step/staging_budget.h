/// \file Memory for copies of frames and states that are written while steps are taken.
#pragma once

#include <algorithm>
#include <cstddef>
#include <optional>

#include "io/base/memory_limit.h"
#include "physics/model/model.h"
#include "runtime/comm/communicator.h"

namespace lahar {

/// Sizes are those of the rank with most of it [bytes].
class StagingBudget {
 public:
  explicit StagingBudget(std::size_t bytes) : bytes_(bytes) {}

  bool has_room_for(std::size_t copy) const { return copy <= bytes_; }
  /// Steps are taken; `next_id`: of the next particle that comes in.
  void begin(Index next_id) {
    largest_.reset();
    next_id_ = next_id;
  }
  /// A copy of which the tasks will make more.
  void add(std::size_t copy) { largest_ = std::max(largest_.value_or(0), copy); }
  /// Whether copies may have become too large since begin(): all particles that came in may be on
  /// one rank.
  bool is_outgrown(Index next_id, std::size_t bytes_of_particle) const;

 private:
  std::size_t bytes_;
  std::optional<std::size_t> largest_;
  Index next_id_ = 0;
};

/// What a rank has to hold [bytes].
struct StagedSizes {
  std::size_t patches, frame, state;
};

/// Throws InputError where patches and the copies that `plan` makes need more memory than there is.
/// Collective.
void need_memory_of_copies(const StagedSizes& sizes, const OutputPlan& plan,
                           std::size_t staging_bytes, const MemoryLimit& memory,
                           const Communicator& ranks);

}  // namespace lahar
