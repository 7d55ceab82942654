/// \file Load balance: whether patches should change their ranks, and which. Decisions follow from
/// their arguments alone: ranks that know the same decide the same.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "runtime/patches/rank_partition.h"

namespace lahar {

/// How patches are shared among ranks. Measured on a disc or ball that fills 190 to 2000 patches of
/// a longer box, 4 and 16 ranks: at the start Scotch's edge cut is 2 to 26 % lower than the
/// curve's, both are even to 1.2 %; Scotch takes 2 to 400 ms, the curve 0.1 ms. When the body
/// moves, chunks stay near the old ones (4 ranks: at most 9 % of the particles per remap, 2D and 16
/// ranks: 16 %, edge cut as at the start), while Scotch's edge cut doubles; decisions take 0.1 to 3
/// ms and 40 to 450 ms. Hence the curve is the default. Where chunks would have to move too much,
/// in 3D on 16 ranks, Scotch's edge cut is half of theirs.
enum class Partitioner {
  curve,   ///< consecutive chunks of the space-filling curve
  scotch,  ///< multilevel graph partitioning: fewer shared nodes, more time
};

/// Owner of every patch to begin with.
std::vector<int> partition(Partitioner partitioner, const PatchGraph& graph, int ranks);

/// Owners of all patches after some were created: a new one (-1) gets the rank of the patch before
/// it on the curve, the first ones that of the first patch that has one, or rank 0.
std::vector<int> owners_with_new(std::span<const int> owner);

/// What it takes to move patches between ranks: the steps in flight are finished, patches packed,
/// sent, unpacked, and the graph is built anew.
struct MoveCost {
  double fixed = 2e-3;     ///< [s] whatever is moved
  double per_byte = 1e-9;  ///< [s] of the rank that sends and receives most

  double of(Index bytes) const { return fixed + per_byte * static_cast<double>(bytes); }
  /// What a remap took [s] in which the busiest rank sent and received so many bytes. Both terms
  /// are corrected by half of the difference, by a factor of 4 at most: one slow remap must not
  /// forbid all later ones.
  void measured(double seconds, Index bytes);
};

struct BalanceTerms {
  Partitioner partitioner = Partitioner::curve;
  double steps = 0;         ///< until the next chance to remap: how long a gain lasts at least
  int threads = 1;          ///< of a rank, which share its work
  double per_node = 10e-9;  ///< [s] to send, receive and add the sums of a shared node in a step
  double threshold = 0.05;  ///< imbalance - 1 up to which nothing is moved
  /// How much heavier than the best chunks, or than the mean, the heaviest rank may remain: every
  /// percent less moves more patches, and where the load goes on changing is soon lost.
  double slack = 0.02;
  /// Share of all bytes that one remap may move; but of few patches as many as there are ranks.
  double most_moved = 0.2;
  bool forced = false;  ///< whatever the imbalance and the gain
  MoveCost move;
};

struct BalancePlan {
  std::vector<int> owner;
  bool transferred = false;  ///< patches one by one, else a partition near the present one
  double imbalance_before = 1, imbalance_after = 1;  ///< heaviest rank over the mean
  Index moved = 0;                                   ///< [bytes]
  Index busiest = 0;  ///< [bytes] that the busiest rank sends and receives
  double gain = 0;    ///< [s] saved until the next chance to remap, before the cost
  double cost = 0;    ///< [s] expected of the remap
};

/// New owners if they are worth it. Chunks of the curve stay chunks: if the best near the present
/// ones would move more than allowed, less even ones are taken, and later remaps go on. With Scotch
/// the partition is one near the present one; if that would move more than allowed or not pay,
/// single patches are given away, which moves little but scatters them: in 16 ranks of about 100
/// patches edge cuts grew to three times as much. Worth it means: the heaviest rank is above the
/// mean by more than the threshold, and what it does more than the new heaviest rank would in the
/// steps to come takes longer than moving. Weights of `costs` are nanoseconds of work per step
/// (work_of), `owner` has no -1, `bytes` are what moving a patch moves. Throws
/// std::invalid_argument if the arguments do not describe the same patches and ranks.
std::optional<BalancePlan> decide(const PatchGraph& costs, std::span<const int> owner,
                                  std::span<const Index> bytes, int ranks,
                                  const BalanceTerms& terms);

}  // namespace lahar
