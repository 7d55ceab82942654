/// \file Quasi-static steps in which the material slid far before it was in equilibrium again.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <string>

#include "graph/stage.h"
#include "physics/kernels/implicit.h"

namespace lahar {

/// Equilibria are found after slides, too: what moved by more than a tenth of a cell, and twenty
/// times as far as in the steps before it, has failed where it was. Told once. Where steps are not
/// alike, it is twenty times as far as in the mean of them, and as in as much time.
class SlideNotice {
 public:
  /// The message after a step of `dt` [s] that ended at `time` [s], if one is due.
  std::optional<std::string> add(Step step, double time, double dt, const LongestMove& move) {
    constexpr double least_cells = 0.1, least_ratio = 20;
    const double before = steps_ > 0 ? sum_ * std::max(1.0 / steps_, dt / elapsed_) : 0.0;
    sum_ += move.metres;
    ++steps_;
    elapsed_ += dt;
    if (told_ || before == 0.0 || move.cells < least_cells || move.metres < least_ratio * before)
      return std::nullopt;
    told_ = true;
    return fmt::format(
        "step {} (t = {:.6g} s): the next equilibrium was {:.3g} m away, {:.0f} times as far as "
        "the steps before went. If loads did not grow as much, the material failed where it was, "
        "and slid. The steps take no inertia into account: explicit ones tell how far it goes",
        step, time, move.metres, move.metres / before);
  }

 private:
  double sum_ = 0;  ///< [m] of the moves so far
  int steps_ = 0;
  double elapsed_ = 0;  ///< [s] of them
  bool told_ = false;
};

}  // namespace lahar
