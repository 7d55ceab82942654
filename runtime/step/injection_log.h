/// \file Dense ids for injected particles, for output only.
#pragma once

#include <span>
#include <vector>

#include "physics/model/injection.h"

namespace lahar {

/// Which cells got particles in which steps, of all ranks, and what ids follow from it.
///
/// In the steps, injected particles have ids that need no agreement (physics/model/injection.h).
/// Which events there were travels with what the ranks agree on anyway after each step, and nobody
/// waits for it: when a frame of that step is written, all ids are known. They count on from the
/// particles before, in the order in which CB-Geo MPM creates the particles: step by step,
/// generator by generator, cell by cell. Ids of particles that were removed are not given again.
class InjectionLog {
 public:
  InjectionLog() = default;
  /// `next_id`: of the next particle that comes.
  template <int Dim>
  InjectionLog(const std::vector<Injection<Dim>>& injections, Index next_id) : next_id_(next_id) {
    counts_ = count_injections(injections);
    for (const auto& one : injections)
      generators_.push_back({one.start, one.end, one.n_cells(), one.per_cell, 0});
  }

  /// Whether there may be events in a step that begins at `time` [s].
  bool due(double time) const;
  /// For a step in which they are due: a bit for each event. Sums over the ranks are those of all,
  /// because every cell belongs to one of them.
  std::vector<Index> elements(std::span<const Index> events) const;
  std::size_t n_elements() const;
  /// The sums over all ranks, of steps in ascending order.
  void take(Index step, std::span<const Index> elements);

  bool empty() const { return known_.empty(); }
  /// The dense id of a particle; ids of others stay as they are.
  Index dense(Index id) const;
  void make_dense(std::span<Index> ids) const;
  /// Forget the events, of which no particle has its first id any more.
  void clear() { known_.clear(); }
  Index next_id() const { return next_id_; }
  /// Particles of a generator that have come since this log was made.
  Index particles_of(std::size_t generator) const { return generators_[generator].come; }

 private:
  struct Generator {
    double start, end;
    Index cells, per_cell;
    Index come = 0;  ///< particles
  };
  /// The particles of an event, one after the other.
  struct Known {
    Index first, dense;
  };
  std::vector<Generator> generators_;
  InjectionCounts counts_;
  Index next_id_ = 0;
  std::vector<Known> known_;  ///< ascending
};

}  // namespace lahar
