#include "runtime/step/run_history.h"

#include <algorithm>
#include <bit>

namespace lahar {

namespace {

PatchWork work_of(const HistoryRow& row) {
  return {row.internal, row.external, row.damping, row.friction, row.divided};
}

/// Exact sums, and the largest speed.
std::pair<std::vector<Index>, double> sum_of(std::span<const HistoryRow> parts,
                                             std::size_t bodies) {
  RowSums sums(bodies);
  double fastest = 0;
  for (const HistoryRow& part : parts) {
    sums.add(part);
    fastest = std::max(fastest, part.max_speed);
  }
  return {sums.elements(), fastest};
}

}  // namespace

void RunHistory::give(Step step, Agreement& own) const {
  auto [elements, fastest] = sum_of(parts_[step], bodies_);
  own.least.minus_speed = -std::bit_cast<Index>(fastest);
  own.sum = std::move(elements);
}

HistoryRow RunHistory::take(Step step, const Agreement& all) {
  HistoryRow row = RowSums::row(all.sum, bodies_, std::bit_cast<double>(-all.least.minus_speed));
  work_ += work_of(row);
  complete(row, step + 1, work_);
  return row;
}

HistoryRow RunHistory::row_of(std::span<const HistoryRow> parts, Step at,
                              const Communicator& ranks) const {
  auto [elements, fastest] = sum_of(parts, bodies_);
  ranks.sum(elements);
  HistoryRow row = RowSums::row(elements, bodies_, ranks.max(fastest));
  PatchWork since_start = work_;
  since_start += work_of(row);
  complete(row, at, since_start);
  return row;
}

void RunHistory::complete(HistoryRow& row, Step at, const PatchWork& since_start) const {
  row.step = at;
  row.time = time_.time_at(at);
  row.dt = time_.last_dt(at);
  row.internal = since_start.internal;
  row.external = since_start.external;
  row.damping = since_start.damping;
  row.friction = since_start.friction;
  row.divided = since_start.divided;
  row.balance = row.kinetic + row.internal + row.damping - row.external - start_.kinetic;
}

}  // namespace lahar
