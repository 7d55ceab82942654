#include "runtime/patches/balance.h"

#include <algorithm>
#include <numeric>
#include <stdexcept>

#include "runtime/patches/curve_shift.h"
#include "runtime/patches/patch_transfer.h"
#include "runtime/patches/scotch_partition.h"

namespace lahar {

namespace {

/// [shared nodes per byte] what moving weighs for Scotch.
constexpr double migration_weight = 3e-3;

/// Seconds that the heaviest rank works in a step.
double work_time(const RankShares& shares, const BalanceTerms& terms) {
  Index heaviest = 0;
  for (const RankShare& rank : shares.ranks) heaviest = std::max(heaviest, rank.weight);
  return 1e-9 * static_cast<double>(heaviest) / terms.threads;
}

/// The same with what ranks exchange.
double step_time(const RankShares& shares, const BalanceTerms& terms) {
  Index most = 0;
  for (const RankShare& rank : shares.ranks) most = std::max(most, rank.shared_nodes);
  return work_time(shares, terms) + terms.per_node * static_cast<double>(most);
}

void add_traffic(BalancePlan& plan, std::span<const int> owner, std::span<const Index> bytes,
                 int ranks) {
  std::vector<Index> traffic(static_cast<std::size_t>(ranks), 0);
  for (std::size_t p = 0; p < owner.size(); ++p) {
    if (plan.owner[p] == owner[p]) continue;
    plan.moved += bytes[p];
    traffic[static_cast<std::size_t>(owner[p])] += bytes[p];
    traffic[static_cast<std::size_t>(plan.owner[p])] += bytes[p];
  }
  plan.busiest = *std::max_element(traffic.begin(), traffic.end());
}

/// One decision: the present state, and what other owners would mean.
class Decision {
 public:
  Decision(const PatchGraph& costs, std::span<const int> owner, std::span<const Index> bytes,
           int ranks, const BalanceTerms& terms)
      : costs_(costs),
        owner_(owner),
        bytes_(bytes),
        ranks_(ranks),
        terms_(terms),
        now_(shares_of(costs, owner, ranks)),
        allowed_(
            std::max(terms.most_moved *
                         static_cast<double>(std::accumulate(bytes.begin(), bytes.end(), Index{0})),
                     static_cast<double>(ranks * *std::max_element(bytes.begin(), bytes.end())))) {}

  /// Whether an even share would be worth a remap that moves nothing.
  bool may_gain() const {
    const double imbalance = now_.imbalance();
    return imbalance > 1 + terms_.threshold &&
           work_time(now_, terms_) * (1 - 1 / imbalance) * terms_.steps > terms_.move.of(0);
  }

  BalancePlan best() const {
    return terms_.partitioner == Partitioner::curve ? best_chunks() : best_parts();
  }

 private:
  bool is_allowed(const BalancePlan& plan) const {
    return static_cast<double>(plan.moved) <= allowed_;
  }

  /// Chunks of the curve as even as the bytes allow that one remap may move; the rest is left to
  /// later ones. Patches of a rank stay together.
  BalancePlan best_chunks() const {
    BalancePlan best = chunks(terms_.slack);
    if (is_allowed(best)) return best;
    double too_even = terms_.slack, uneven = terms_.slack;
    while (!is_allowed(best) && uneven < ranks_) best = chunks(uneven = 2 * (too_even = uneven));
    constexpr int refinements = 5;
    for (int k = 0; k < refinements; ++k) {
      const double middle = 0.5 * (too_even + uneven);
      BalancePlan plan = chunks(middle);
      const bool allowed = is_allowed(plan);
      (allowed ? uneven : too_even) = middle;
      if (allowed) best = std::move(plan);
    }
    return best;
  }
  BalancePlan chunks(double uneven) const {
    return plan_of(shift_chunks(costs_.weight, owner_, bytes_, ranks_, uneven));
  }

  /// Scotch's partition near the present one; where that moves too much or does not pay, patches
  /// one by one.
  BalancePlan best_parts() const {
    BalancePlan whole =
        plan_of(scotch_repartition(costs_, owner_, bytes_, ranks_, migration_weight));
    return is_allowed(whole) && whole.gain > whole.cost ? whole : transfers();
  }

  BalancePlan plan_of(std::vector<int> owner) const {
    BalancePlan plan;
    plan.owner = std::move(owner);
    add_traffic(plan, owner_, bytes_, ranks_);
    const RankShares then = shares_of(costs_, plan.owner, ranks_);
    plan.imbalance_before = now_.imbalance();
    plan.imbalance_after = then.imbalance();
    plan.gain = (step_time(now_, terms_) - step_time(then, terms_)) * terms_.steps;
    plan.cost = terms_.move.of(plan.busiest);
    return plan;
  }

  /// As even as the bytes allow that one remap may move; the rest is left to later ones.
  BalancePlan transfers() const {
    BalancePlan plan = plan_of(transfer_patches(costs_, owner_, bytes_, ranks_, terms_.slack,
                                                static_cast<Index>(allowed_)));
    plan.transferred = true;
    return plan;
  }

  const PatchGraph& costs_;
  std::span<const int> owner_;
  std::span<const Index> bytes_;
  int ranks_;
  const BalanceTerms& terms_;
  RankShares now_;
  double allowed_;
};

void check_costs(const PatchGraph& costs, std::span<const int> owner, std::span<const Index> bytes,
                 int ranks) {
  if (ranks <= 0) throw std::invalid_argument("a partition needs at least one rank");
  if (owner.size() != costs.weight.size() || bytes.size() != costs.weight.size())
    throw std::invalid_argument("a partition needs one owner and one size for every patch");
  for (const int rank : owner)
    if (rank < 0 || rank >= ranks) throw std::invalid_argument("a patch has no rank of this run");
}

}  // namespace

std::vector<int> partition(Partitioner partitioner, const PatchGraph& graph, int ranks) {
  return partitioner == Partitioner::curve ? curve_partition(graph.weight, ranks)
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
  check_costs(costs, owner, bytes, ranks);
  if (ranks == 1 || owner.empty()) return std::nullopt;
  const Decision decision(costs, owner, bytes, ranks, terms);
  if (!terms.forced && !decision.may_gain()) return std::nullopt;
  BalancePlan plan = decision.best();
  if (std::equal(owner.begin(), owner.end(), plan.owner.begin())) return std::nullopt;
  if (!terms.forced && !(plan.gain > plan.cost)) return std::nullopt;
  return plan;
}

}  // namespace lahar
