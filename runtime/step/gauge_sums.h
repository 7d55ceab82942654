/// \file What gauges add up over particles: numbers that ranks add, or take the least of, in any
/// order.
#pragma once

#include <span>
#include <vector>

#include "runtime/comm/rank_agreements.h"
#include "runtime/exchange/exact_sum.h"
#include "runtime/step/shown_columns.h"

namespace lahar {

/// Numbers that some patches gave.
struct GaugeSums {
  std::vector<ExactSum> exact;
  std::vector<Index> added;  ///< whole numbers that are added
  std::vector<Index> least;  ///< of which the least counts
};

/// An order of whole numbers like that of doubles; its own inverse.
Index ordered_bits(double value);
double ordered_value(Index bits);

/// Where the numbers of a gauge begin in GaugeSums, and how many it has.
struct GaugeSlots {
  std::size_t exact = 0, added = 0, least = 0;
  std::size_t n_exact = 0, n_added = 0, n_least = 0;
};

/// A gauge with the columns that it takes.
template <int Dim>
struct OpenGauge {
  const Gauge* gauge;
  std::vector<ShownColumn<Dim>> fields;
  GaugeSlots slots;
  std::size_t number = 0;  ///< of planes and forces, its number among them
  int field_components() const {
    int n = 0;
    for (const auto& field : fields) n += field.components();
    return n;
  }
  /// Exact sums of a place: of the weights, and of the weighted fields or velocities.
  std::size_t sums_of_place() const {
    return static_cast<std::size_t>(
        1 + (gauge->kind == Gauge::Kind::columns ? Dim : field_components()));
  }
};

/// Throws InputError where particles have no such field.
template <int Dim>
std::vector<OpenGauge<Dim>> open_gauges(const std::vector<Gauge>& gauges,
                                        const ColumnLayout<Dim>& layout, const Model<Dim>& model);

/// A particle that has left the mesh counts for a plane: it has passed it.
template <int Dim>
bool has_passed(const Gauge& plane, const RemovedParticle& particle, const Model<Dim>& model);

/// Add what a patch has of a gauge at a time [s]. Any thread; `all` has room (room_for()). Its part
/// of Patch::impulses begins anew.
template <int Dim>
void add_to_gauge(const OpenGauge<Dim>& gauge, Patch<Dim>& patch, const Model<Dim>& model,
                  double time, GaugeSums& all);

}  // namespace lahar
