/// \file Particles that left the mesh and were removed: their number, and where it ends the run.
#pragma once

#include <functional>
#include <span>
#include <string>
#include <utility>

#include "graph/stage.h"
#include "physics/model/model.h"
#include "physics/particles/removed_particle.h"

namespace lahar {

/// Counts the particles that a run has removed. Where only few may leave, the run ends max_lead
/// steps after the one in which too many have left: all patches know of it by then, and the step
/// is the same for any ranks and threads, whatever else made the graph drain. A run that was
/// stopped in between, and goes on, ends at once.
template <int Dim>
class LostParticles {
 public:
  using Warn = std::function<void(const std::string&)>;

  /// `analysis` must outlive it.
  LostParticles(const Analysis& analysis, Warn warn)
      : analysis_(analysis), warn_(std::move(warn)) {}

  /// With those that were removed until `step`.
  void resume(Index removed, Step step);
  /// At rest: those that were removed since, of all ranks, ascending by step and then by id. Tells
  /// of the first one where only few may leave.
  void add(std::span<const RemovedParticle> removed);

  Index count() const { return count_; }
  bool too_many() const { return end_ >= 0; }
  /// Where the graph has to drain: at `end`, or before.
  Step drain_step(Step done, Step end) const;
  /// At rest after `done` steps, at `time` [s]: throws WholeStepError where too many have left.
  /// The message is the same for any ranks.
  void throw_if_too_many(Step done, Step nsteps, double time) const;

 private:
  const Analysis& analysis_;
  Warn warn_;
  Index count_ = 0;   ///< particles, of all ranks
  Step end_ = -1;     ///< the run ends after so many steps; -1 = not
  std::string last_;  ///< the last one, in words
};

}  // namespace lahar
