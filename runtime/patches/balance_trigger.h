/// \file When a measured imbalance is reason enough to think of moving patches.
#pragma once

#include <algorithm>

#include "physics/base/types.h"

namespace lahar {

/// Told the imbalance of one window of steps after the other. A large one is a reason at once. A
/// small one is if it lasts, as that of a load which does not move: it costs little per step, but
/// in all steps to come. Thinking of it stops the steps for a moment, so what did not pay waits for
/// longer and longer.
class BalanceTrigger {
 public:
  /// Imbalance - 1.
  static constexpr double large = 0.05, small = 0.01;

  /// `imbalance`: heaviest rank over the mean. True: see whether moving patches pays, and report
  /// with moved() or refused().
  bool is_due(double imbalance) {
    imbalance_ = imbalance;
    lasting_ = imbalance > 1 + small ? lasting_ + 1 : 0;
    const bool is_large = imbalance > 1 + large;
    // What did not pay may do so when it has got worse by a quarter.
    const bool worse = is_large && imbalance - 1 >= 1.25 * (refused_at_ - 1);
    if (wait_ > 0 && !worse) {
      --wait_;
      return false;
    }
    is_small_ = !is_large;
    return is_large || lasting_ >= patience_;
  }

  /// Whether the last reason was a small imbalance, and for how many windows it had lasted.
  bool is_small() const { return is_small_; }
  Index lasting() const { return lasting_; }

  void moved() {
    refused_ = wait_ = 0;
    settle();
  }
  void refused() {
    wait_ = Index{1} << std::min<Index>(++refused_, 6);
    refused_at_ = imbalance_;
    settle();
  }

 private:
  /// If small ones come again, this did not help.
  void settle() {
    if (is_small_) patience_ = std::min<Index>(2 * patience_, 100);
    lasting_ = 0;
  }

  double imbalance_ = 1, refused_at_ = 1;
  bool is_small_ = false;
  Index lasting_ = 0;   ///< windows with more than the small imbalance, one after the other
  Index patience_ = 3;  ///< of these, until it is a reason
  Index refused_ = 0;   ///< times in a row
  Index wait_ = 0;      ///< windows until the next attempt
};

}  // namespace lahar
