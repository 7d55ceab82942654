/// \file Sums of the weights of consecutive patches, and how evenly a row of patches can be cut.
#pragma once

#include <algorithm>
#include <numeric>
#include <span>
#include <vector>

#include "physics/base/types.h"

namespace lahar {

/// Weights of consecutive patches; positions lie between patches, 0 to n.
class WeightPrefix {
 public:
  explicit WeightPrefix(std::span<const Index> weight) : sum_(weight.size() + 1, 0) {
    std::partial_sum(weight.begin(), weight.end(), sum_.begin() + 1);
  }
  int size() const { return static_cast<int>(sum_.size()) - 1; }
  Index total() const { return sum_.back(); }
  Index at(int position) const { return sum_[static_cast<std::size_t>(position)]; }
  Index between(int from, int to) const { return at(to) - at(from); }
  /// Last position whose patches since `from` weigh at most `most`.
  int furthest(int from, Index most) const {
    return static_cast<int>(std::upper_bound(sum_.begin() + from, sum_.end(), at(from) + most) -
                            sum_.begin()) -
           1;
  }
  /// First position from which the patches up to `to` weigh at most `most`.
  int nearest(int to, Index most) const {
    return static_cast<int>(std::lower_bound(sum_.begin(), sum_.begin() + to, at(to) - most) -
                            sum_.begin());
  }
  /// The position whose weight before it is nearest to a share of the total, the lower of two.
  int nearest_to(double share) const {
    const double wanted = share * static_cast<double>(total());
    const auto above = std::lower_bound(sum_.begin(), sum_.end(), wanted);
    if (above == sum_.begin()) return 0;
    if (above == sum_.end()) return size();
    const auto i = static_cast<int>(above - sum_.begin());
    return wanted - static_cast<double>(at(i - 1)) <= static_cast<double>(at(i)) - wanted ? i - 1
                                                                                          : i;
  }
  /// Whether `ranks` runs of consecutive patches of at most `most` each can hold all.
  bool fits(int ranks, Index most) const {
    int position = 0;
    for (int r = 0; r < ranks && position < size(); ++r) position = furthest(position, most);
    return position == size();
  }
  /// The least weight of the heaviest of `ranks` runs of consecutive patches.
  Index least_heaviest(int ranks) const {
    Index heaviest = 0;
    for (int p = 0; p < size(); ++p) heaviest = std::max(heaviest, between(p, p + 1));
    Index low = std::max(heaviest, (total() + ranks - 1) / ranks), high = total();
    while (low < high) {
      const Index middle = low + (high - low) / 2;
      if (fits(ranks, middle))
        high = middle;
      else
        low = middle + 1;
    }
    return low;
  }

 private:
  std::vector<Index> sum_;
};

}  // namespace lahar
