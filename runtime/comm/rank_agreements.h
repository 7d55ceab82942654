/// \file What all ranks agree on while steps are taken: reductions that nothing waits for before it
/// needs them.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "graph/executor.h"
#include "runtime/comm/communicator.h"

namespace lahar {

/// What ranks find out about a step that all have finished.
struct Agreement {
  /// The least that any rank gave.
  struct Least {
    Index stop_before = std::numeric_limits<Index>::max();  ///< a step that nobody takes
    Index failed_step = std::numeric_limits<Index>::max();
    Index rebuild = 0;          ///< -1: some rank needs patches that do not exist
    Index checkpoint = 0;       ///< -1: some rank was asked for a checkpoint
    Index stop = 0;             ///< -1: some rank was asked to stop
    Index crowded = 0;          ///< -1: some patch is to be split
    Index full = 0;             ///< -1: some patch has a long list of removed particles
    Index strained = 0;         ///< -1: the volume of some particle is beyond its bounds
    Index minus_speed = 0;      ///< the bits of the largest speed, negated
    Index minus_work = 0;       ///< of the heaviest rank, negated [ns]
    Index minus_particles = 0;  ///< of the fullest rank, negated
    Index begun = 0;            ///< minus the latest time at which a rank finished the step [ns]
  } least;
  std::vector<Index> sum;     ///< elements added over all ranks; as many on each, perhaps none
  std::vector<Index> lowest;  ///< of which the least of all ranks counts; the same
};

/// Something that has become known, not before `due`.
struct ExchangeEvent {
  enum class Kind { message, limit, step } kind;
  Step step;
  std::int64_t due;  ///< [ns] of steady_clock
  int receive = 0;   ///< which message
  double limit = 0;
  std::uint64_t begin = 0;  ///< agreements: ticks when this rank gave its part
  std::uint64_t found = 0;  ///< ticks
};

/// Nanoseconds of steady_clock.
std::int64_t exchange_time();
/// When something that was sent has come. Clocks of other machines may be ahead.
std::int64_t exchange_due(std::int64_t sent, std::int64_t latency);

/// Reductions on their way: one of the time step's limit or of sums, and of as many steps as
/// patches may be ahead. One thread at a time.
class RankAgreements {
 public:
  /// Groups for steps that are done and for time steps.
  RankAgreements(const Communicator& steps, const Communicator& limits)
      : steps_(steps), limits_(limits) {}
  void give_limit(Step step, double limit);
  /// With a limit numbers that are added, as many on all ranks.
  void give_sums(Step step, double limit, std::span<const Index> own);
  void give(Step step, Agreement&& own);
  /// Append those that are complete; `latency` [ns] is added to each.
  void look(std::int64_t latency, std::vector<ExchangeEvent>& events);
  const Agreement& found(Step step) { return of(step).found; }
  std::span<const Index> sums() const { return sums_found_; }

 private:
  static constexpr int least_size = sizeof(Agreement::Least) / sizeof(Index);
  struct Pending {
    Step step = -1;  ///< -1 = none
    std::uint64_t begin = 0;
    Agreement given, found;
    std::array<MPI_Request, 3> requests{MPI_REQUEST_NULL, MPI_REQUEST_NULL, MPI_REQUEST_NULL};
  };
  Pending& of(Step step) { return pending_[static_cast<std::size_t>(step % max_lead)]; }

  Communicator steps_, limits_;
  Step limit_step_ = -1;
  std::uint64_t limit_begin_ = 0;
  std::array<double, 2> limit_given_{}, limit_found_{};
  std::vector<Index> sums_given_, sums_found_;
  std::array<MPI_Request, 2> limit_requests_{MPI_REQUEST_NULL, MPI_REQUEST_NULL};
  std::array<Pending, max_lead> pending_;
};

}  // namespace lahar
