/// \file The sums of a history row over patches and ranks.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "io/run/history.h"
#include "runtime/exchange/exact_sum.h"

namespace lahar {

/// The sums of a history row, each exact, as elements that are added over patches and ranks in any
/// order.
class RowSums {
 public:
  static constexpr std::size_t n_sums = 10;
  static constexpr std::size_t n_of_body = 6;
  /// Elements with so many rigid bodies.
  static constexpr std::size_t n_elements(std::size_t bodies) {
    return 1 + (n_sums + n_of_body * bodies) * ExactSum::size;
  }
  explicit RowSums(std::size_t bodies) : bodies_(n_of_body * bodies) {}
  void add(const HistoryRow& row) {
    particles_ += row.particles;
    const std::array<double, n_sums> terms{
        row.mass,     row.momentum[0], row.momentum[1], row.momentum[2], row.kinetic,
        row.internal, row.external,    row.damping,     row.friction,    row.divided};
    for (std::size_t k = 0; k < n_sums; ++k) sums_[k] += terms[k];
    for (std::size_t k = 0; k < row.bodies.size(); ++k)
      for (std::size_t d = 0; d < 3; ++d) {
        bodies_[n_of_body * k + d] += row.bodies[k].force[d];
        bodies_[n_of_body * k + 3 + d] += row.bodies[k].torque[d];
      }
  }
  std::vector<Index> elements() const {
    std::vector<Index> all{particles_};
    const auto append = [&](const auto& sums) {
      for (const ExactSum& sum : sums)
        all.insert(all.end(), sum.elements().begin(), sum.elements().end());
    };
    append(sums_);
    append(bodies_);
    return all;
  }
  static HistoryRow row(std::span<const Index> elements, std::size_t bodies, double max_speed) {
    const auto sum = [&](std::size_t k) {
      return ExactSum(elements.subspan(1 + k * ExactSum::size).first<ExactSum::size>()).value();
    };
    std::array<double, n_sums> value;
    for (std::size_t k = 0; k < n_sums; ++k) value[k] = sum(k);
    HistoryRow row;
    row.bodies.resize(bodies);
    for (std::size_t k = 0; k < bodies; ++k)
      for (std::size_t d = 0; d < 3; ++d) {
        row.bodies[k].force[d] = sum(n_sums + n_of_body * k + d);
        row.bodies[k].torque[d] = sum(n_sums + n_of_body * k + 3 + d);
      }
    row.particles = elements[0];
    row.mass = value[0];
    row.momentum = {value[1], value[2], value[3]};
    row.kinetic = value[4];
    row.internal = value[5];
    row.external = value[6];
    row.damping = value[7];
    row.friction = value[8];
    row.divided = value[9];
    row.max_speed = max_speed;
    return row;
  }

 private:
  Index particles_ = 0;
  std::array<ExactSum, n_sums> sums_;
  std::vector<ExactSum> bodies_;  ///< force and torque of each
};

}  // namespace lahar
