#include "runtime/balance.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "runtime/curve_shift.h"
#include "runtime/scotch_partition.h"

namespace lahar {

namespace {

/// How much heavier than the best chunks allow the heaviest rank may be, first: every percent less
/// moves more patches, and as the load goes on changing is soon lost.
constexpr double first_slack = 0.02;
/// [shared nodes per byte] what moving weighs for Scotch.
constexpr double migration_weight = 1e-3;

double imbalance_of(std::span<const Index> load) {
  const auto total = static_cast<double>(std::accumulate(load.begin(), load.end(), Index{0}));
  if (total == 0) return 1;
  return static_cast<double>(*std::max_element(load.begin(), load.end())) *
         static_cast<double>(load.size()) / total;
}

std::vector<Index> loads_of(std::span<const Index> weight, std::span<const int> owner, int ranks) {
  std::vector<Index> load(static_cast<std::size_t>(ranks), 0);
  for (std::size_t p = 0; p < weight.size(); ++p)
    load[static_cast<std::size_t>(owner[p])] += weight[p];
  return load;
}

/// Seconds that a step takes on the heaviest rank.
double step_time(std::span<const Index> load, int threads) {
  return 1e-9 * static_cast<double>(*std::max_element(load.begin(), load.end())) / threads;
}

void add_traffic(BalancePlan& plan, std::span<const int> owner, std::span<const Index> bytes,
                 int ranks) {
  std::vector<Index> traffic(static_cast<std::size_t>(ranks), 0);
  plan.moved = 0;
  for (std::size_t p = 0; p < owner.size(); ++p) {
    if (plan.owner[p] == owner[p]) continue;
    plan.moved += bytes[p];
    traffic[static_cast<std::size_t>(owner[p])] += bytes[p];
    traffic[static_cast<std::size_t>(plan.owner[p])] += bytes[p];
  }
  plan.busiest = *std::max_element(traffic.begin(), traffic.end());
}

/// Better owners near the present ones, moving at most the share of bytes that is allowed: what
/// is beyond it is left to later remaps.
BalancePlan propose(const PatchGraph& costs, std::span<const int> owner,
                    std::span<const Index> bytes, int ranks, const BalanceTerms& terms) {
  const double allowed =
      terms.most_moved * static_cast<double>(std::accumulate(bytes.begin(), bytes.end(), Index{0}));
  BalancePlan plan;
  double slack = first_slack, weight = migration_weight;
  for (int attempt = 0; attempt < 8; ++attempt, slack *= 1.6, weight *= 4) {
    plan.owner = terms.partitioner == Partitioner::curve
                     ? shift_chunks(costs.weight, owner, bytes, ranks, slack)
                     : scotch_repartition(costs, owner, bytes, ranks, weight);
    add_traffic(plan, owner, bytes, ranks);
    if (static_cast<double>(plan.moved) <= allowed) return plan;
  }
  return plan;
}

void check(const PatchGraph& costs, std::span<const int> owner, std::span<const Index> bytes,
           int ranks) {
  if (ranks <= 0) throw std::invalid_argument("a partition needs at least one rank");
  if (owner.size() != costs.weight.size() || bytes.size() != costs.weight.size())
    throw std::invalid_argument("a partition needs one owner and one size for every patch");
  for (const int rank : owner)
    if (rank < 0 || rank >= ranks) throw std::invalid_argument("a patch has no rank of this run");
}

}  // namespace

std::vector<int> partition(Partitioner partitioner, const PatchGraph& graph, int ranks) {
  return partitioner == Partitioner::curve ? curve_chunks(graph.weight, ranks)
                                           : scotch_partition(graph, ranks);
}

std::vector<int> owners_with_new(std::span<const int> owner) {
  std::vector<int> all(owner.begin(), owner.end());
  const auto owned = std::find_if(all.begin(), all.end(), [](int rank) { return rank >= 0; });
  int last = owned == all.end() ? 0 : *owned;
  for (int& rank : all) last = rank = rank >= 0 ? rank : last;
  return all;
}

void MoveCost::measured(double seconds, Index bytes) {
  const double ratio = std::clamp(seconds / of(bytes), 0.25, 4.0);
  fixed *= 0.5 * (1 + ratio);
  per_byte *= 0.5 * (1 + ratio);
}

std::optional<BalancePlan> decide(const PatchGraph& costs, std::span<const int> owner,
                                  std::span<const Index> bytes, int ranks,
                                  const BalanceTerms& terms) {
  check(costs, owner, bytes, ranks);
  if (ranks == 1 || owner.empty()) return std::nullopt;
  const std::vector<Index> load = loads_of(costs.weight, owner, ranks);
  const double before = imbalance_of(load), present = step_time(load, terms.threads);
  if (!terms.forced) {
    if (before <= 1 + terms.threshold) return std::nullopt;
    const double most_gain = present * (1 - 1 / before) * terms.steps;
    if (most_gain <= terms.move.of(0)) return std::nullopt;
  }
  BalancePlan plan = propose(costs, owner, bytes, ranks, terms);
  const std::vector<Index> balanced = loads_of(costs.weight, plan.owner, ranks);
  plan.imbalance_before = before;
  plan.imbalance_after = imbalance_of(balanced);
  plan.gain = (present - step_time(balanced, terms.threads)) * terms.steps;
  plan.cost = terms.move.of(plan.busiest);
  if (std::equal(owner.begin(), owner.end(), plan.owner.begin())) return std::nullopt;
  if (!terms.forced && plan.gain <= plan.cost) return std::nullopt;
  return plan;
}

}  // namespace lahar
