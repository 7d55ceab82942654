// New chunks of the curve near the old ones.
#include "runtime/patches/curve_shift.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <limits>
#include <random>

#include "runtime/patches/rank_partition.h"
#include "runtime/patches/weight_prefix.h"

using namespace lahar;

namespace {

Index moved_bytes(const std::vector<int>& before, const std::vector<int>& after,
                  const std::vector<Index>& bytes) {
  Index moved = 0;
  for (std::size_t p = 0; p < bytes.size(); ++p)
    if (before[p] >= 0 && before[p] != after[p]) moved += bytes[p] + 1;
  return moved;
}

/// The fewest bytes moved over all ways to cut a row with no rank above `most`, by trying them.
Index fewest_moved(const std::vector<Index>& weight, const std::vector<int>& owner,
                   const std::vector<Index>& bytes, Index most, std::size_t from, int rank,
                   int ranks) {
  if (rank == ranks) return from == weight.size() ? 0 : std::numeric_limits<Index>::max();
  Index best = std::numeric_limits<Index>::max(), load = 0, moved = 0;
  for (std::size_t end = from; end <= weight.size(); ++end) {
    const Index rest = fewest_moved(weight, owner, bytes, most, end, rank + 1, ranks);
    if (rest != std::numeric_limits<Index>::max()) best = std::min(best, moved + rest);
    if (end == weight.size()) break;
    load += weight[end];
    if (load > most) break;
    if (owner[end] >= 0 && owner[end] != rank) moved += bytes[end] + 1;
  }
  return best;
}

}  // namespace

TEST_CASE("shifted chunks are consecutive, light enough, and no others move fewer bytes") {
  std::mt19937 random(5);
  for (int trial = 0; trial < 400; ++trial) {
    CAPTURE(trial);
    const std::size_t n = random() % 9;
    const int ranks = 1 + static_cast<int>(random() % 4);
    std::vector<Index> weight(n), bytes(n);
    std::vector<int> owner(n);
    for (std::size_t p = 0; p < n; ++p) {
      weight[p] = random() % 3 == 0 ? 0 : static_cast<Index>(random() % 50);
      bytes[p] = static_cast<Index>(random() % 20);
      owner[p] = static_cast<int>(random() % static_cast<unsigned>(ranks + 1)) - 1;
    }
    if (trial % 2 == 0) std::sort(owner.begin(), owner.end());
    const double slack = trial % 3 == 0 ? 0.0 : 0.3;
    const std::vector<int> shifted = shift_chunks(weight, owner, bytes, ranks, slack);
    REQUIRE(shifted.size() == n);
    CHECK(std::is_sorted(shifted.begin(), shifted.end()));
    std::vector<Index> load(static_cast<std::size_t>(ranks), 0);
    for (std::size_t p = 0; p < n; ++p) load.at(static_cast<std::size_t>(shifted[p])) += weight[p];
    const auto most = static_cast<Index>(
        static_cast<double>(WeightPrefix(weight).least_heaviest(ranks)) * (1 + slack));
    for (const Index l : load) CHECK(l <= most);
    CHECK(moved_bytes(owner, shifted, bytes) ==
          fewest_moved(weight, owner, bytes, most, 0, 0, ranks));
  }
}

TEST_CASE("chunks that are even already stay, whatever the number of ranks") {
  for (const int ranks : {1, 2, 5, 40}) {
    CAPTURE(ranks);
    for (const std::size_t patches : {0, 1, 7, 200}) {
      CAPTURE(patches);
      const std::vector<Index> weight(patches, 1000), bytes(patches, 64);
      const std::vector<int> owner = curve_partition(weight, ranks);
      CHECK(shift_chunks(weight, owner, bytes, ranks, 0) == owner);
      // No weight anywhere: any owners are even.
      CHECK(shift_chunks(std::vector<Index>(patches, 0), owner, bytes, ranks, 0.02) == owner);
    }
  }
  const std::vector<Index> one{1};
  const std::vector<int> owner{0}, owners{0, 0};
  CHECK_THROWS_AS(shift_chunks(one, owner, one, 0, 0), std::invalid_argument);
  CHECK_THROWS_AS(shift_chunks(one, owner, one, 1, -0.1), std::invalid_argument);
  CHECK_THROWS_AS(shift_chunks(one, owners, one, 1, 0), std::invalid_argument);
}
