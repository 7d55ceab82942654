// Load balance: when patches change their ranks, and which.
#include "runtime/patches/balance.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <numeric>

#include "runtime/patches/balance_trigger.h"
#include "runtime/patches/patch_cost.h"
#include "runtime/patches/patch_transfer.h"
#include "runtime/patches/scotch_partition.h"
#include "tests/runtime/step/moving_load.h"
#include "tests/within.h"

using namespace lahar;
using namespace lahar::test;

namespace {

constexpr Partitioner partitioners[] = {Partitioner::curve, Partitioner::scotch};

bool all_owned(const std::vector<int>& owner, int patches, int ranks) {
  return static_cast<int>(owner.size()) == patches &&
         std::all_of(owner.begin(), owner.end(),
                     [ranks](int rank) { return rank >= 0 && rank < ranks; });
}

std::vector<Index> bytes_of(const std::vector<Index>& particles) {
  std::vector<Index> bytes;
  for (const Index n : particles) bytes.push_back(200 * n);
  return bytes;
}

}  // namespace

TEST_CASE(
    "every patch has one rank, evenly and repeatably, for more and fewer ranks than patches") {
  const MovingLoad<2> load({16, 8}, 0.9);
  const PatchGraph graph = load.graph(load.particles(0.4));
  for (const Partitioner partitioner : partitioners)
    for (const int ranks : {1, 2, 4, 200}) {
      CAPTURE(static_cast<int>(partitioner));
      CAPTURE(ranks);
      const std::vector<int> owner = partition(partitioner, graph, ranks);
      CHECK(all_owned(owner, graph.size(), ranks));
      CHECK(partition(partitioner, graph, ranks) == owner);
      if (ranks <= 4) CHECK(shares_of(graph, owner, ranks).imbalance() < 1.1);
    }
  for (const Partitioner partitioner : partitioners) {
    CHECK(partition(partitioner, PatchGraph{}, 3).empty());
    CHECK(all_owned(partition(partitioner, load.graph(std::vector<Index>(128, 0)), 3), 128, 3));
    CHECK_THROWS_AS(partition(partitioner, graph, 0), std::invalid_argument);
  }
}

TEST_CASE("Scotch cuts fewer shared nodes than the curve, and keeps parts near the old ones") {
  const MovingLoad<2> load({64, 16}, 0.9);
  const std::vector<Index> before = load.particles(0.3), after = load.particles(0.31);
  const PatchGraph graph = load.graph(before), later = load.graph(after);
  const std::vector<int> owner = scotch_partition(graph, 4);
  CHECK(shares_of(graph, owner, 4).edge_cut <
        shares_of(graph, curve_partition(graph.weight, 4), 4).edge_cut);
  CHECK(shares_of(later, owner, 4).imbalance() > 1.1);
  const std::vector<Index> bytes = bytes_of(after);
  const std::vector<int> moved = scotch_repartition(later, owner, bytes, 4, 3e-3);
  CHECK(all_owned(moved, graph.size(), 4));
  CHECK(scotch_repartition(later, owner, bytes, 4, 3e-3) == moved);
  CHECK(shares_of(later, moved, 4).imbalance() < 1.05);
  Index total = 0, sum = 0;
  for (std::size_t p = 0; p < owner.size(); ++p) {
    sum += after[p];
    total += moved[p] == owner[p] ? 0 : after[p];
  }
  CHECK(total < sum / 2);
  CHECK_THROWS_AS(scotch_repartition(graph, std::vector<int>{0}, bytes, 4, 1),
                  std::invalid_argument);
}

TEST_CASE("weights beyond 32 bits are partitioned as evenly as small ones") {
  const MovingLoad<2> load({16, 8}, 0.9);
  PatchGraph graph = load.graph(load.particles(0.4));
  for (Index& weight : graph.weight) weight *= 1'000'000'000;
  CHECK(shares_of(graph, scotch_partition(graph, 4), 4).imbalance() < 1.1);
}

TEST_CASE("transfers move little more than the excess, to ranks with room") {
  const MovingLoad<3> load({16, 6, 6}, 0.9);
  const std::vector<Index> after = load.particles(0.35);
  const std::vector<int> owner = curve_partition(load.particles(0.3), 5);
  const PatchGraph graph = load.graph(after);
  const RankShares before = shares_of(graph, owner, 5);
  const std::vector<Index> bytes = bytes_of(after);
  const Index all = std::accumulate(bytes.begin(), bytes.end(), Index{0});
  const std::vector<int> moved = transfer_patches(graph, owner, bytes, 5, 0.03, all);
  CHECK(all_owned(moved, graph.size(), 5));
  CHECK(shares_of(graph, moved, 5).imbalance() <= 1.031);
  const double mean =
      static_cast<double>(std::accumulate(after.begin(), after.end(), Index{0})) / 5;
  double excess = 0, transferred = 0;
  for (const RankShare& rank : before.ranks)
    excess += std::max(0.0, static_cast<double>(rank.weight) - mean);
  REQUIRE(excess > 0.03 * mean);
  for (std::size_t p = 0; p < owner.size(); ++p)
    if (moved[p] != owner[p]) transferred += static_cast<double>(after[p]);
  CHECK(transferred < excess + 5 * MovingLoad<3>::particles_per_patch);
  // Even ones stay, and so does what cannot be divided or may not be moved.
  CHECK(transfer_patches(graph, moved, bytes, 5, 0.03, all) == moved);
  const std::vector<int> held = transfer_patches(graph, owner, bytes, 5, 0.03, 0);
  for (std::size_t p = 0; p < held.size(); ++p)
    if (held[p] != owner[p]) CHECK(bytes[p] == 0);
  PatchGraph one;
  one.weight = {100};
  one.edges.resize(1);
  CHECK(transfer_patches(one, std::vector<int>{1}, one.weight, 3, 0.03, 1000) ==
        std::vector<int>{1});
  CHECK_THROWS_AS(transfer_patches(one, std::vector<int>{-1}, one.weight, 3, 0.03, 1000),
                  std::invalid_argument);
}

TEST_CASE("a heavy rank is relieved also where no patch fits below the mean") {
  PatchGraph graph;
  graph.weight.assign(26, 100);
  graph.edges.resize(26);
  std::vector<int> owner(26, 0);
  for (std::size_t p = 8; p < 26; ++p) owner[p] = 1 + static_cast<int>(p - 8) / 6;
  REQUIRE(shares_of(graph, owner, 4).imbalance() == doctest::Approx(8 / 6.5));
  const std::vector<int> moved = transfer_patches(graph, owner, graph.weight, 4, 0.02, 1000);
  CHECK(shares_of(graph, moved, 4).imbalance() == doctest::Approx(7 / 6.5));
}

TEST_CASE("a moving load stays balanced, and no remap moves a quarter of it") {
  BalanceTerms terms;
  terms.steps = 1000;
  const auto check = [](const BalanceHistory& history, int ranks) {
    CAPTURE(ranks);
    CHECK(history.remaps > 0);
    CHECK(history.worst_imbalance < 1.1);
    CHECK(history.most_moved < 0.25);
    CHECK(history.most_moved > 0);
  };
  check(slide(MovingLoad<2>({64, 16}, 0.9), 4, 400, terms), 4);
  check(slide(MovingLoad<2>({128, 32}, 0.9), 16, 400, terms), 16);
  check(slide(MovingLoad<3>({32, 8, 8}, 0.9), 4, 200, terms), 4);
  terms.partitioner = Partitioner::scotch;
  check(slide(MovingLoad<2>({64, 16}, 0.9), 4, 200, terms), 4);
}

TEST_CASE("nothing moves when ranks are even, or when a remap costs more than it saves") {
  const MovingLoad<2> load({64, 16}, 0.9);
  const std::vector<Index> particles = load.particles(0.3);
  const std::vector<Index> bytes = bytes_of(particles);
  const std::vector<double> rates(particles.size(), 30e-9);
  const PatchGraph even = load.graph(work_of(particles, rates));
  const PatchGraph uneven = load.graph(work_of(load.particles(0.32), rates));
  for (const Partitioner partitioner : partitioners) {
    CAPTURE(static_cast<int>(partitioner));
    const std::vector<int> owner = partition(partitioner, even, 4);
    BalanceTerms terms;
    terms.partitioner = partitioner;
    terms.steps = 1e6;
    CHECK_FALSE(decide(even, owner, bytes, 4, terms));
    const auto plan = decide(uneven, owner, bytes, 4, terms);
    REQUIRE(plan);
    CHECK(plan->imbalance_before > 1.05);
    CHECK(plan->imbalance_after < 1.05);
    CHECK(plan->gain > plan->cost);
    CHECK(plan->busiest > 0);
    CHECK(plan->busiest <= plan->moved);
    CHECK(decide(uneven, owner, bytes, 4, terms)->owner == plan->owner);
    terms.steps = 1;  // saves less than a millisecond
    CHECK_FALSE(decide(uneven, owner, bytes, 4, terms));
    terms.forced = true;
    CHECK(decide(uneven, owner, bytes, 4, terms));
    CHECK_FALSE(decide(PatchGraph{}, {}, {}, 4, terms));
  }
  CHECK_THROWS_AS(decide(even, std::vector<int>(particles.size(), 4), bytes, 4, {}),
                  std::invalid_argument);
}

TEST_CASE("a load that is on one rank spreads without any remap moving more than is allowed") {
  const MovingLoad<2> load({64, 16}, 0.9);
  const std::vector<Index> particles = load.particles(0.5);
  const std::vector<Index> bytes = bytes_of(particles);
  const PatchGraph graph = load.graph(work_of(particles));
  const auto total = static_cast<double>(std::accumulate(bytes.begin(), bytes.end(), Index{0}));
  std::vector<int> owner(particles.size(), 0);
  BalanceTerms terms;
  terms.steps = 1000;
  int remaps = 0;
  while (const auto plan = decide(graph, owner, bytes, 4, terms)) {
    REQUIRE(++remaps < 20);
    CHECK(static_cast<double>(plan->moved) <= terms.most_moved * total);
    CHECK(plan->imbalance_after < plan->imbalance_before);
    owner = plan->owner;
  }
  CHECK(remaps >= 4);  // three quarters, a fifth at a time
  CHECK(shares_of(graph, owner, 4).imbalance() <= 1.05);
}

TEST_CASE("few large patches are shared out, though each is more than a remap may move of many") {
  PatchGraph graph;
  graph.weight.assign(5, 1'000'000);
  graph.edges.resize(5);
  const std::vector<Index> bytes(5, 1000);
  BalanceTerms terms;
  terms.steps = 1000;
  for (const Partitioner partitioner : partitioners) {
    CAPTURE(static_cast<int>(partitioner));
    terms.partitioner = partitioner;
    std::vector<int> owner{0, 0, 0, 0, 1};
    REQUIRE(shares_of(graph, owner, 4).imbalance() == doctest::Approx(3.2));
    for (int remaps = 0; const auto plan = decide(graph, owner, bytes, 4, terms); ++remaps) {
      REQUIRE(remaps < 4);
      owner = plan->owner;
    }
    CHECK(shares_of(graph, owner, 4).imbalance() == doctest::Approx(1.6));  // 2, 1, 1 and 1
  }
}

TEST_CASE("new patches get the rank of the patch before them") {
  CHECK(owners_with_new(std::vector<int>{-1, 2, -1, -1, 0, -1}) ==
        std::vector<int>{2, 2, 2, 2, 0, 0});
  CHECK(owners_with_new(std::vector<int>{-1, -1}) == std::vector<int>{0, 0});
  CHECK(owners_with_new(std::vector<int>{}).empty());
}

TEST_CASE("the expected cost of a remap approaches what remaps take, and one cannot spoil it") {
  MoveCost cost;
  for (int i = 0; i < 30; ++i) cost.measured(0.05, 1'000'000);
  CHECK(cost.of(1'000'000) == doctest::Approx(0.05));
  cost.measured(100, 1'000'000);
  CHECK(cost.of(1'000'000) < 0.2);
}

TEST_CASE("disturbed samples of a patch's time do not change its cost, what lasts does") {
  WorkRate rate;
  CHECK(rate.value() == 0);
  rate.add(0, 100);
  rate.add(1e-3, 0);  // nothing about particles
  CHECK(rate.value() == 0);
  rate.add(1, 4000);  // the first one is that of a new patch
  CHECK(rate.value() == 0);
  for (int i = 0; i < 31; ++i) rate.add(1e-4, 4000);
  const double usual = rate.value();
  CHECK(usual == within(1e-5, 1e-4 / 4400));
  for (int i = 0; i < 14; ++i) rate.add(1, 4000);
  CHECK(rate.value() == usual);
  for (int i = 0; i < 31; ++i) rate.add(1e-4, 4000);
  for (int i = 0; i < 15; ++i) rate.add(3e-4, 4000);
  CHECK(rate.value() == usual);
  rate.add(3e-4, 4000);
  CHECK(rate.value() == within(1e-5, 3 * usual));
  WorkRate passed_on(usual);
  for (int i = 0; i < 15; ++i) passed_on.add(1, 4000);
  CHECK(passed_on.value() == usual);
  WorkRate begun;
  for (const double seconds : {1.0, 1e-4, 3e-4, 1e-4, 3e-4, 1e-4, 3e-4}) begun.add(seconds, 4000);
  CHECK(begun.value() == 0);
  begun.add(2e-4, 4000);
  CHECK(begun.value() == within(1e-5, 2 * usual));
}

TEST_CASE(
    "work is rate times particles, the median where nothing was measured, limited around it") {
  const std::vector<Index> particles{1000, 1000, 1000, 1000, 0};
  const std::vector<Index> work =
      work_of(particles, std::vector<double>{20e-9, 20e-9, 0, 2000e-9, 0});
  CHECK(work[0] == 1400 * 20);
  CHECK(work[2] == work[0]);
  CHECK(work[3] == 4 * work[0]);
  CHECK(work[4] == 40 * 20);
  const std::vector<Index> unmeasured = work_of(particles);
  CHECK(unmeasured[0] == unmeasured[3]);
  CHECK(unmeasured[4] >= 1);
  CHECK(unmeasured[0] == 1400 * unmeasured[4] / 40);
  const std::vector<Index> thin = work_of(std::vector<Index>{4096, 512});
  CHECK(8 * thin[1] > thin[0]);
  CHECK_THROWS_AS(work_of(particles, std::vector<double>(4, 0)), std::invalid_argument);
}

TEST_CASE("a large imbalance is a reason to move patches at once, a small one if it lasts") {
  BalanceTrigger trigger;
  CHECK(trigger.is_due(1.08));
  CHECK(!trigger.is_small());
  trigger.moved();
  CHECK(!trigger.is_due(1.02));
  CHECK(!trigger.is_due(1.02));
  CHECK(!trigger.is_due(1.005));  // even for once: from the beginning again
  CHECK(!trigger.is_due(1.02));
  CHECK(!trigger.is_due(1.03));
  CHECK(trigger.is_due(1.02));
  CHECK(trigger.is_small());
  CHECK(trigger.lasting() == 3);
}

TEST_CASE("small imbalances that come again are thought of less and less often") {
  BalanceTrigger trigger;
  int reasons = 0;
  for (int window = 0; window < 1000; ++window)
    if (trigger.is_due(1.02)) {
      ++reasons;
      trigger.moved();
    }
  CHECK(reasons > 3);
  CHECK(reasons < 20);
}

TEST_CASE(
    "what did not pay is tried again after longer and longer, or when it is a quarter worse") {
  BalanceTrigger trigger;
  int windows = 0;
  const auto until_due = [&](double imbalance) {
    for (windows = 1; !trigger.is_due(imbalance); ++windows) REQUIRE(windows < 1000);
    return windows;
  };
  CHECK(until_due(1.1) == 1);
  trigger.refused();
  CHECK(until_due(1.1) == 3);
  trigger.refused();
  CHECK(until_due(1.1) == 5);
  trigger.refused();
  CHECK(!trigger.is_due(1.1));
  CHECK(trigger.is_due(1.13));
  trigger.moved();
  CHECK(until_due(1.1) == 1);
}
