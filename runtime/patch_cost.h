/// \file What the work on a patch costs, from measured times that other programs disturb.
#pragma once

#include <span>
#include <vector>

#include "physics/types.h"

namespace lahar {

/// Time of a patch per step and particle, averaged over samples. A thread that loses its core for
/// some milliseconds in the middle of a task of a tenth of one makes a patch look ten times as
/// heavy; so a sample counts at most twice, and at least half, of the average before it. What
/// really changed is followed by 20 % per sample. The first sample is dropped: into a new patch
/// memory comes, and particles layer by layer, at several times the usual cost.
/// Simulated: 4 ranks of 16 equal patches, 0.12 ms each, samples of 20 steps, tasks that with
/// probability time / 0.1 s take 4 ms more. The heaviest rank seemed heavier than the mean by 6.3 %
/// with plain samples, 2.2 % with plain averages, 1.4 % with these; by more than 5 %, where a remap
/// is considered, in 67 %, 3 % and 0.1 % of the samples.
class WorkRate {
 public:
  WorkRate() = default;
  /// As measured elsewhere [s] per step and particle.
  explicit WorkRate(double value) : value_(value), begun_(true) {}
  /// A sample: [s] of work in a step, mean over some steps, and the particles of the patch.
  void add(double seconds, Index particles);
  double value() const { return value_; }  ///< [s] per step and particle; 0 = not known yet

 private:
  double value_ = 0;
  bool begun_ = false;
};

/// [ns] of work per step for every patch, at least 1: its rate (WorkRate::value) times its present
/// particles. Rates are limited to 4 times the median (materials differ less) and a quarter of it;
/// a patch without one has the median, and as long as none has, all are equal.
/// Throws std::invalid_argument unless there is one rate for each patch.
std::vector<Index> work_of(std::span<const Index> particles, std::span<const double> rates);

}  // namespace lahar
