/// \file Recursive coordinate bisection of cell centres.
#pragma once

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>
#include <vector>

#include "physics/base/types.h"

namespace lahar {

/// Parts that so many cells are cut into.
inline Index bisection_parts(Index cells, Index target_cells) {
  return std::max<Index>(
      1, std::llround(static_cast<double>(cells) / static_cast<double>(target_cells)));
}

/// The rules of a cut, which depend on some cells as a set: several processes that have some of
/// them each can follow them together.
struct BisectionRules {
  /// Centres closer than this are one layer of cells [mean cells].
  static constexpr double same_layer = 1e-6;

  /// The longest axis of a box around centres [mean cells].
  template <int Dim>
  static int axis(const Vec<Dim>& low, const Vec<Dim>& high) {
    int axis = 0;
    for (int d = 1; d < Dim; ++d)
      if (high[d] - low[d] > high[axis] - low[axis] + same_layer) axis = d;
    return axis;
  }
  /// How many of n cells are to lie before the cut into `parts`.
  static Index middle(Index n, Index parts) { return n * (parts / 2) / parts; }
  /// The cut goes through a layer of cells of which `before` and `behind` are the sides: it moves
  /// to the nearer one, if that leaves cells on both sides. Regular grids then come out as bricks.
  static Index aligned(Index before, Index middle, Index behind, Index n) {
    const bool can_before = before > 0, can_behind = behind < n;
    if (can_before && (!can_behind || middle - before <= behind - middle)) return before;
    return can_behind ? behind : middle;
  }
  /// Parts for the first `middle` of n cells.
  static Index first_parts(Index middle, Index n, Index parts) {
    const double share = static_cast<double>(middle) / static_cast<double>(n);
    return std::clamp<Index>(std::llround(share * static_cast<double>(parts)),
                             std::max<Index>(1, parts - (n - middle)), std::min(parts - 1, middle));
  }
};

/// By all centres in one place.
template <int Dim>
class Bisection {
 public:
  /// Centres in units of the mean cell along each axis, cells in the order of their ids.
  explicit Bisection(std::vector<Vec<Dim>> centre)
      : centre_(std::move(centre)), order_(centre_.size()) {
    std::iota(order_.begin(), order_.end(), Local{0});
  }

  /// Cells of each part, ascending, parts in the order of the tree's leaves.
  void cut(Index parts, std::vector<Index>& first, std::vector<Local>& cells) {
    first.assign(1, 0);
    split(0, static_cast<Index>(order_.size()), parts, first);
    cells = std::move(order_);
  }

 private:
  using Rules = BisectionRules;

  void split(Index begin, Index end, Index parts, std::vector<Index>& first) {
    const auto at = [&](Index i) { return order_.begin() + i; };
    if (parts == 1) {
      std::sort(at(begin), at(end));
      first.push_back(end);
      return;
    }
    const int axis = longest_axis(begin, end);
    Index middle = begin + Rules::middle(end - begin, parts);
    // Ties by id, so that the cut does not depend on the order in which cells come.
    std::nth_element(at(begin), at(middle), at(end), [&](Local a, Local b) {
      const double xa = x(a, axis), xb = x(b, axis);
      return xa != xb ? xa < xb : a < b;
    });
    middle = align_to_layer(begin, middle, end, axis);
    const Index left = Rules::first_parts(middle - begin, end - begin, parts);
    split(begin, middle, left, first);
    split(middle, end, parts - left, first);
  }

  double x(Local cell, int axis) const { return centre_[static_cast<std::size_t>(cell)][axis]; }
  Local cell(Index i) const { return order_[static_cast<std::size_t>(i)]; }

  int longest_axis(Index begin, Index end) const {
    Vec<Dim> low = centre_[static_cast<std::size_t>(cell(begin))], high = low;
    for (Index i = begin; i < end; ++i) {
      low = low.cwiseMin(centre_[static_cast<std::size_t>(cell(i))]);
      high = high.cwiseMax(centre_[static_cast<std::size_t>(cell(i))]);
    }
    return Rules::axis<Dim>(low, high);
  }

  Index align_to_layer(Index begin, Index middle, Index end, int axis) {
    const double level = x(cell(middle), axis);
    const auto before =
        std::partition(order_.begin() + begin, order_.begin() + middle,
                       [&](Local c) { return x(c, axis) < level - Rules::same_layer; });
    const auto behind = std::partition(order_.begin() + middle, order_.begin() + end, [&](Local c) {
      return x(c, axis) <= level + Rules::same_layer;
    });
    return begin + Rules::aligned(before - order_.begin() - begin, middle - begin,
                                  behind - order_.begin() - begin, end - begin);
  }

  std::vector<Vec<Dim>> centre_;
  std::vector<Local> order_;
};

}  // namespace lahar
