#include "runtime/patches/curve_shift.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <stdexcept>

#include "runtime/patches/weight_prefix.h"

namespace lahar {

namespace {

/// Positions at which a rank may begin such that no rank is heavier than allowed.
struct Window {
  int first = 0, last = 0;
  std::size_t size() const { return static_cast<std::size_t>(last - first) + 1; }
};

/// windows[r]: where rank r may begin; one more for the end.
std::vector<Window> windows_of(const WeightPrefix& prefix, int ranks, Index most) {
  std::vector<Window> windows(static_cast<std::size_t>(ranks) + 1);
  for (std::size_t r = 1; r < windows.size(); ++r)
    windows[r].last = prefix.furthest(windows[r - 1].last, most);
  windows.back() = {prefix.size(), prefix.size()};
  for (std::size_t r = windows.size() - 1; r-- > 1;)
    windows[r].first = prefix.nearest(windows[r + 1].first, most);
  return windows;
}

/// The cheapest way to give all patches before a position of a window to the ranks before it.
struct CutStage {
  std::vector<Index> cost;  ///< [bytes] that these ranks receive
  std::vector<int> begin;   ///< where the last of these ranks begins
};

/// Cuts a row of patches; `arriving(p, rank)` is what it costs to give patch p to a rank.
template <class Arriving>
CutStage next_stage(const WeightPrefix& prefix, Index most, const Window& from, const Window& to,
                    const CutStage& before, Arriving&& arriving) {
  std::vector<Index> arrived(static_cast<std::size_t>(to.last - from.first) + 1, 0);
  for (std::size_t k = 1; k < arrived.size(); ++k)
    arrived[k] = arrived[k - 1] + arriving(from.first + static_cast<int>(k) - 1);
  const auto arrived_at = [&](int p) { return arrived[static_cast<std::size_t>(p - from.first)]; };
  const auto key = [&](int a) {
    return before.cost[static_cast<std::size_t>(a - from.first)] - arrived_at(a);
  };
  CutStage stage;
  // Beginnings that are the best for this or a later end, by increasing key: the minimum over a
  // window that moves forward.
  std::deque<int> best;
  int entered = from.first;
  for (int b = to.first; b <= to.last; ++b) {
    for (; entered <= std::min(b, from.last); ++entered) {
      while (!best.empty() && key(best.back()) > key(entered)) best.pop_back();
      best.push_back(entered);
    }
    while (best.front() < prefix.nearest(b, most)) best.pop_front();
    stage.cost.push_back(key(best.front()) + arrived_at(b));
    stage.begin.push_back(best.front());
  }
  return stage;
}

void check_shares(std::size_t patches, std::size_t owners, std::size_t bytes, int ranks,
                  double slack) {
  if (ranks <= 0) throw std::invalid_argument("a partition needs at least one rank");
  if (!(slack >= 0)) throw std::invalid_argument("the slack of a partition must not be negative");
  if (owners != patches || bytes != patches)
    throw std::invalid_argument("a partition needs one owner and one size for every patch");
}

}  // namespace

std::vector<int> shift_chunks(std::span<const Index> weight, std::span<const int> owner,
                              std::span<const Index> bytes, int ranks, double slack) {
  check_shares(weight.size(), owner.size(), bytes.size(), ranks, slack);
  const WeightPrefix prefix(weight);
  const auto least = static_cast<double>(prefix.least_heaviest(ranks));
  const auto most = static_cast<Index>(std::floor(least * (1 + slack)));
  const std::vector<Window> windows = windows_of(prefix, ranks, most);
  std::vector<CutStage> stages{{{0}, {0}}};
  for (int r = 0; r < ranks; ++r) {
    const auto i = static_cast<std::size_t>(r);
    const auto arriving = [&](int patch) {
      const auto p = static_cast<std::size_t>(patch);
      // A byte more, so that empty patches too are moved only for a reason.
      return owner[p] < 0 || owner[p] == r ? Index{0} : bytes[p] + 1;
    };
    stages.push_back(next_stage(prefix, most, windows[i], windows[i + 1], stages.back(), arriving));
  }
  std::vector<int> result(weight.size());
  int end = prefix.size();
  for (int r = ranks; r-- > 0;) {
    const auto i = static_cast<std::size_t>(r) + 1;
    const int begin = stages[i].begin[static_cast<std::size_t>(end - windows[i].first)];
    std::fill(result.begin() + begin, result.begin() + end, r);
    end = begin;
  }
  return result;
}

}  // namespace lahar
