/// \file What the work on a patch costs, from measured times that other programs disturb.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "physics/base/types.h"

namespace lahar {

/// Time of a patch per step and particle: the median of the last samples. A thread that loses its
/// core for some milliseconds in the middle of a task of a tenth of one makes a patch look ten
/// times as heavy, and another program beside it makes all patches of a rank heavier for a while.
/// How many particles a patch has is known in each step; what it takes for one changes slowly, and
/// is followed after sixteen samples. The very first sample is dropped: into a new patch memory
/// comes, and particles layer by layer, at several times the usual cost. Of fewer than seven others
/// nothing is said.
///
/// Simulated: 4 ranks of 16 equal patches, 0.12 ms each, samples of 5 steps, tasks that with
/// probability time / 0.1 s take 4 ms more, and ranks that with probability 0.02 become slower. The
/// heaviest rank seemed heavier than the mean by more than 5 %, where a remap is considered, in
///
///     slower by                plain   averages  medians of 5    7     15     31 samples
///     1.6 for a sample         37 %      47 %        0.1 %       0      0      0
///     1.2 for five samples     56 %                  35 %       35 %    7 %    0.03 %
class WorkRate {
 public:
  WorkRate() = default;
  /// As measured elsewhere [s] per step and particle.
  explicit WorkRate(double value) : taken_(1 + n_samples) { samples_.fill(value); }
  /// A sample: [s] of work in a step, mean over some steps, and the particles of the patch.
  void add(double seconds, Index particles);
  double value() const;  ///< [s] per step and particle; 0 = not known yet

 private:
  static constexpr std::size_t least_samples = 7, n_samples = 31;
  std::array<double, n_samples> samples_{};
  std::size_t taken_ = 0;
};

/// [ns] of work per step for every patch, at least 1: its rate (WorkRate::value) times its present
/// particles. Rates are limited to 4 times the median (materials differ less) and a quarter of it;
/// a patch without one has the median. As long as none has, a usual rate is taken for all: how many
/// particles a patch has decides alone, and many thin patches weigh more than a few full ones.
/// Throws std::invalid_argument unless there is one rate for each patch.
std::vector<Index> work_of(std::span<const Index> particles, std::span<const double> rates);
/// Before anything was measured.
std::vector<Index> work_of(std::span<const Index> particles);

}  // namespace lahar
