#include "io/scenario/overburden.h"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace lahar {

namespace {

/// The smaller of the slopes to both sides. It is zero where they differ in sign.
double limited(double before, double after) {
  if (!(before * after > 0)) return 0.0;
  return std::abs(before) < std::abs(after) ? before : after;
}

}  // namespace

template <int Dim>
Overburden<Dim>::Overburden(const Lattice& lattice, const std::vector<Piece>& own, const Team& team)
    : lattice_(lattice) {
  for (int d = 0, k = 0; d < Dim; ++d)
    if (d != lattice.up) across_[static_cast<std::size_t>(k++)] = d;
  const auto size = static_cast<std::size_t>(team.size());
  std::vector<Knot> knots;
  for (const Piece& piece : own) add(piece, knots);
  std::vector<std::vector<Knot>> to(size);
  for (const Knot& knot : knots) {
    std::size_t owner = 0;
    for (const Index i : knot.column) owner = owner * 31 + static_cast<std::size_t>(i);
    to[owner % size].push_back(knot);
  }
  knots = joined(team.exchange(std::move(to)));
  const auto order = [](const Knot& a, const Knot& b) {
    return std::tuple(a.column, -a.height, a.rate) < std::tuple(b.column, -b.height, b.rate);
  };
  std::sort(knots.begin(), knots.end(), order);
  std::vector<Knot> merged;
  for (const Knot& knot : knots)
    if (!merged.empty() && merged.back().column == knot.column &&
        merged.back().height == knot.height)
      merged.back().rate += knot.rate;
    else
      merged.push_back(knot);
  merged = joined(team.gather(merged));
  std::sort(merged.begin(), merged.end(), order);
  double most = 0;  // rate of a knot
  for (const Knot& knot : merged) most = std::max(most, std::abs(knot.rate));
  for (const Knot& knot : merged) {
    if (columns_.empty() || columns_.back() != knot.column) {
      columns_.push_back(knot.column);
      first_.push_back(static_cast<Index>(levels_.size()));
      levels_.push_back({knot.height, 0.0, knot.rate});
      continue;
    }
    const Level& above = levels_.back();
    constexpr double rounding = 1e-9;  // of rates: where nothing lies
    const double depth = above.height - knot.height;
    if (above.rate <= rounding * most && depth > lattice.width[lattice.up])
      levels_.push_back({knot.height, 0.0, knot.rate});
    else
      levels_.push_back({knot.height, above.weight + above.rate * depth, above.rate + knot.rate});
  }
  first_.push_back(static_cast<Index>(levels_.size()));
}

template <int Dim>
void Overburden<Dim>::add(const Piece& piece, std::vector<Knot>& to) const {
  if (!(piece.volume > 0)) return;
  const double part = std::pow(piece.volume / lattice_.width.prod(), 1.0 / Dim);
  const double half = 0.5 * part * lattice_.width[lattice_.up];
  double area = 1.0;
  std::array<Index, plan> low{}, high{};
  const auto cell_at = [&](int d, double x) {
    return static_cast<Index>(std::floor((x - lattice_.origin[d]) / lattice_.width[d]));
  };
  for (std::size_t k = 0; k < plan; ++k) {
    const int d = across_[k];
    area *= lattice_.width[d];
    const double reach = lattice_.aligned ? 0.0 : 0.5 * part * lattice_.width[d];
    low[k] = cell_at(d, piece.x[d] - reach);
    high[k] = cell_at(d, piece.x[d] + reach);
  }
  const auto share_along = [&](std::size_t k, Index i) {  // of the box's length
    const int d = across_[k];
    if (low[k] == high[k]) return 1.0;
    const double length = part * lattice_.width[d];
    const double from = lattice_.origin[d] + static_cast<double>(i) * lattice_.width[d];
    const double a = std::max(from, piece.x[d] - 0.5 * length);
    const double b = std::min(from + lattice_.width[d], piece.x[d] + 0.5 * length);
    return std::max(0.0, b - a) / length;
  };
  const double y = height_of(piece.x), rate = piece.weight / (area * 2.0 * half);
  Column column = low;
  for (;;) {
    double share = 1.0;
    for (std::size_t k = 0; k < plan; ++k) share *= share_along(k, column[k]);
    if (share > 0) {
      to.push_back({column, y + half, share * rate});
      to.push_back({column, y - half, -share * rate});
    }
    std::size_t k = 0;
    while (k < plan && ++column[k] > high[k]) column[k] = low[k], ++k;
    if (k == plan) return;
  }
}

template <int Dim>
auto Overburden<Dim>::levels(const Column& column) const -> std::pair<const Level*, const Level*> {
  const auto at = std::lower_bound(columns_.begin(), columns_.end(), column);
  if (at == columns_.end() || *at != column) return {nullptr, nullptr};
  const auto i = static_cast<std::size_t>(at - columns_.begin());
  return {levels_.data() + first_[i], levels_.data() + first_[i + 1]};
}

template <int Dim>
double Overburden<Dim>::weight_above(const Column& column, double height) const {
  const auto [first, last] = levels(column);
  const Level* below =
      std::partition_point(first, last, [&](const Level& level) { return level.height >= height; });
  if (below == first) return 0.0;
  const Level& from = *(below - 1);
  return from.weight + from.rate * (from.height - height);
}

template <int Dim>
double Overburden<Dim>::at(const Vec<Dim>& x) const {
  const double height = height_of(x);
  Column column{};
  for (std::size_t k = 0; k < plan; ++k) {
    const int d = across_[k];
    column[k] = static_cast<Index>(std::floor((x[d] - lattice_.origin[d]) / lattice_.width[d]));
  }
  const double here = weight_above(column, height);
  double sum = here;
  for (std::size_t k = 0; k < plan; ++k) {
    const int d = across_[k];
    Column before = column, after = column;
    --before[k], ++after[k];
    const bool has_before = levels(before).first != nullptr;
    const bool has_after = levels(after).first != nullptr;
    const double back = here - weight_above(before, height);
    const double ahead = weight_above(after, height) - here;
    const double slope = has_before && has_after ? limited(back, ahead)
                         : has_before            ? back
                         : has_after             ? ahead
                                                 : 0.0;
    const double centre =
        lattice_.origin[d] + (static_cast<double>(column[k]) + 0.5) * lattice_.width[d];
    sum += slope * (x[d] - centre) / lattice_.width[d];
  }
  return std::max(0.0, sum);
}

template class Overburden<2>;
template class Overburden<3>;

}  // namespace lahar
