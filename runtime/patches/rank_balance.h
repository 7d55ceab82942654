/// \file Measuring the work of patches while steps are taken, and moving patches between ranks when
/// it pays. Who has a patch changes no bit of a result, so what was measured may decide.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <vector>

#include "graph/executor.h"
#include "runtime/patches/balance.h"
#include "runtime/patches/balance_trigger.h"
#include "runtime/patches/patch_cost.h"
#include "runtime/patches/patch_set.h"

namespace lahar {

/// When patches may change their ranks.
struct BalanceOptions {
  enum class When { measured, never, forced } when = When::measured;
  Step every = 0;  ///< forced: after so many steps, whatever was measured; for tests
  Partitioner partitioner = Partitioner::curve;
};

/// The largest rank over the mean rank.
struct Imbalance {
  double mean = 1;   ///< of all windows
  double worst = 1;  ///< of a window
};

/// What balancing did, for reports; the same on all ranks.
struct BalanceReport {
  Index windows = 0;  ///< in which the ranks were compared
  Imbalance work;     ///< as measured, and disturbed by other programs
  Imbalance particles;
  Index remaps = 0;
  double moved = 0;       ///< share of the particles in a remap, mean
  double most_moved = 0;  ///< in one remap
  double seconds = 0;     ///< spent in remaps and in refusing them
};

template <int Dim>
class RankBalance {
 public:
  /// Steps whose work is compared.
  static constexpr Step window = 20;
  /// In one step of so many, tasks of a patch are timed.
  static constexpr Step sampled = 4;

  RankBalance(Communicator ranks, BalanceOptions options, int threads)
      : ranks_(ranks), options_(options), threads_(threads) {}

  bool samples(Step step, int patch) const;
  /// CPU time of a task [ns] in a step that samples it, and the particles of its patch; tasks of
  /// different patches may call at once.
  void add(Step step, int patch, std::int64_t nanoseconds, Index particles);

  /// The rank's load is due with the agreement of `step`.
  bool is_due(Step step) const {
    return ranks_.several() && options_.when == BalanceOptions::When::measured &&
           (step + 1) % window == 0;
  }
  /// Take in what was measured of a step that this rank's patches have done.
  void finish(Step step);
  struct Load {
    Index work = 0;  ///< [ns] per step
    Index particles = 0;
  };
  Load load() const;
  /// The largest of any rank, and of all together: true if a remap should be considered.
  bool is_uneven(Load largest, Load all);

  /// Before the first step: share patches as the partitioner says, where it is not the curve, by
  /// which they are shared already. True if that changed anything. Collective.
  bool share(PatchSet<Dim>& patches, Step step);
  /// Between steps: move patches if it pays. True if the set of patches has changed. Collective.
  bool remap(PatchSet<Dim>& patches, Step step, Index steps_left);
  /// Seconds that this took, with the graph that is built anew if the set has changed. Collective.
  void remap_took(double seconds);

  Step forced_every() const {
    return ranks_.several() && options_.when == BalanceOptions::When::forced ? options_.every : 0;
  }
  bool is_forced(Step step) const { return forced_every() > 0 && step % forced_every() == 0; }

  /// Patches were split: their parts cost per particle what they did.
  void renumber(const PatchRenumbering& ids);
  /// For patches as they are linked now.
  void begin(const PatchSet<Dim>& patches);
  const BalanceReport& report() const { return report_; }

 private:
  struct Known;
  using Edges = decltype(PatchGraph::edges);
  PatchGraph graph_of_all(const PatchSet<Dim>& patches, std::vector<Known>& known);
  Edges edges_of_all(const PatchSet<Dim>& patches, const std::vector<Index>& ids) const;
  void take_over_rates(const std::vector<Known>& known, const std::vector<int>& before,
                       const std::vector<int>& after);

  Communicator ranks_;
  BalanceOptions options_;
  int threads_;
  MoveCost move_;
  std::optional<Index> busiest_;  ///< [bytes] of the busiest rank, if the last remap moved any
  BalanceReport report_;
  struct Work {
    std::int64_t nanoseconds = 0;
    Index particles = 0;
    Index steps = 0;  ///< in which it was timed
  };
  std::array<std::vector<Work>, max_lead + 2> of_step_;  ///< by patch
  std::vector<Work> since_;                              ///< in this window, by patch
  BalanceTrigger trigger_;
  std::map<Index, WorkRate> rates_;  ///< by patch id
  std::vector<Index> particles_;     ///< of each patch at the last sample
  std::vector<Index> ids_;
  Edges edges_;                  ///< of all patches; they follow from which there are:
  std::vector<Index> edges_of_;  ///< these, by id
};

extern template class RankBalance<2>;
extern template class RankBalance<3>;

}  // namespace lahar
