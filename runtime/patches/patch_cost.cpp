#include "runtime/patches/patch_cost.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <stdexcept>

namespace lahar {

namespace {

/// What the tasks of a patch cost beside its particles, nodes and messages above all, and those of
/// an empty one, in particles: 10 us and one (measured, 2D and 3D, 4 ranks).
constexpr double base_particles = 400, empty_particles = 40;
/// By how much a patch may differ from the median patch.
constexpr double median_factor = 4;
/// [s] per particle before anything was measured: only ratios matter then.
constexpr double usual_rate = 30e-9;

/// 0 where nothing was measured.
double median_rate(std::span<const double> rates) {
  std::vector<double> measured;
  std::copy_if(rates.begin(), rates.end(), std::back_inserter(measured),
               [](double rate) { return rate > 0; });
  if (measured.empty()) return 0;
  const auto middle = measured.begin() + static_cast<std::ptrdiff_t>(measured.size() / 2);
  std::nth_element(measured.begin(), middle, measured.end());
  return *middle;
}

/// What a patch costs in a step, in particles.
double weight_of(Index particles) {
  return particles > 0 ? static_cast<double>(particles) + base_particles : empty_particles;
}

}  // namespace

void WorkRate::add(double seconds, Index particles) {
  if (particles <= 0 || !(seconds > 0)) return;  // says nothing about particles
  if (taken_++ == 0) return;
  samples_[taken_ % n_samples] = seconds / weight_of(particles);
}

double WorkRate::value() const {
  if (taken_ < 1 + least_samples) return 0;
  const std::size_t n = std::min(taken_ - 1, n_samples);
  std::array<double, n_samples> sorted = samples_;  // those that are not there yet are 0: the least
  const auto middle = sorted.end() - 1 - static_cast<std::ptrdiff_t>(n / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  return *middle;
}

std::vector<Index> work_of(std::span<const Index> particles, std::span<const double> rates) {
  if (rates.size() != particles.size())
    throw std::invalid_argument("every patch needs a rate of work, 0 if it has none");
  const double measured = median_rate(rates), median = measured > 0 ? measured : usual_rate;
  std::vector<Index> work(particles.size());
  for (std::size_t p = 0; p < work.size(); ++p) {
    double time = 0;
    if (rates[p] > 0)
      time = std::clamp(rates[p], median / median_factor, median * median_factor) *
             weight_of(particles[p]);
    else
      time = median * weight_of(particles[p]);
    work[p] = std::max(Index{1}, static_cast<Index>(std::llround(time * 1e9)));
  }
  return work;
}

std::vector<Index> work_of(std::span<const Index> particles) {
  return work_of(particles, std::vector<double>(particles.size(), 0));
}

}  // namespace lahar
