/// \file Which cell holds a point, in a mesh from tables: walk, neighbours, bounding grid.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "physics/error.h"
#include "physics/inverse_mapping.h"
#include "physics/mesh_table.h"
#include "physics/mesh_tolerance.h"

namespace lahar {
namespace {

/// Bounding boxes are widened by this fraction of their size before they are binned [-], so that a
/// point which only touches a cell finds it; added to the touch tolerance.
constexpr double box_padding = 1e-8;
/// A walk ends for certain only this many touch tolerances away from every face of the cell.
constexpr double clear_of_faces = 100;
/// A particle moves less than a cell per step: a longer walk is left to the search.
constexpr int longest_walk = 32;
/// Where Newton fails: it came near the cell [natural coordinates] and near the point [cell sizes].
constexpr double near_cell = 1.1, near_point = 1e-3;

template <int Dim>
double magnitude(const Vec<Dim>& x) {
  return x.template lpNorm<Eigen::Infinity>();
}

/// Shortest extent of a cell [m], the length that the tolerance is relative to.
template <int Dim>
double shortest_extent(const CellGeometry<Dim>& cell) {
  if (cell.cartesian) return cell.length.minCoeff();
  Vec<Dim> low = cell.corner[0], high = low;
  for (const auto& X : cell.corner) low = low.cwiseMin(X), high = high.cwiseMax(X);
  return (high - low).minCoeff();
}

/// The point is inside the cell's bounding box and the inverse map failed. Try again from several
/// places in the cell; none found and none close means that the point is not in the cell.
template <int Dim>
bool inverse_map_hard(Index id, const CellGeometry<Dim>& cell, const Vec<Dim>& x, Vec<Dim>& xi) {
  Vec<Dim> low = cell.corner[0], high = low;
  for (const auto& X : cell.corner) low = low.cwiseMin(X), high = high.cwiseMax(X);
  if ((x.array() < low.array()).any() || (x.array() > high.array()).any()) return false;
  const double size = (high - low).norm();
  bool near = false;
  for (int start = 0; start <= corners<Dim>; ++start) {
    for (int d = 0; d < Dim; ++d) xi[d] = start == corners<Dim> ? 0.0 : 0.6 * corner_sign(start, d);
    double residual;
    if (inverse_map_newton<Dim>(cell, x, xi, residual)) return true;
    near |= magnitude<Dim>(xi) <= near_cell && residual < near_point * size;
  }
  if (!near) return false;
  throw SimulationError(fmt::format(
      "the inverse mapping of cell {} does not converge at ({}): the cell is too distorted there",
      id, fmt::join(x.data(), x.data() + Dim, ", ")));
}

}  // namespace

template <int Dim>
bool BoundingGrid<Dim>::contains(const Vec<Dim>& x) const {
  return (x.array() >= low.array()).all() && (x.array() <= high.array()).all();
}

template <int Dim>
std::array<Index, Dim> BoundingGrid<Dim>::position(const Vec<Dim>& x) const {
  std::array<Index, Dim> p;
  for (int d = 0; d < Dim; ++d) {
    const auto i = static_cast<Index>((x[d] - low[d]) * bins_per_metre[d]);
    p[d] = std::clamp<Index>(i, 0, counts[d] - 1);
  }
  return p;
}

template <int Dim>
Index BoundingGrid<Dim>::bin(const std::array<Index, Dim>& p) const {
  Index id = 0;
  for (int d = Dim - 1; d >= 0; --d) id = id * counts[d] + p[d];
  return id;
}

/// Bounding box of a cell, widened by everything that counts as touching it.
template <int Dim>
std::pair<Vec<Dim>, Vec<Dim>> CellTable<Dim>::padded_bounds(Index cell) const {
  const auto [low, high] = cell_bounds(cell);
  const double scale = std::max(magnitude<Dim>(low), magnitude<Dim>(high));
  const Point size = high - low;
  const Point pad = (box_padding + touch_tolerance(scale, size.minCoeff())) * size;
  return {low - pad, high + pad};
}

/// Bins as large as the mean bounding box of a cell; fewer where the mesh fills its bounds badly.
template <int Dim>
void CellTable<Dim>::build_bounding_grid() {
  Point mean = Point::Zero();
  grid_.low = bounds_.first;
  grid_.high = bounds_.second;
  for (Index c = 0; c < n_cells(); ++c) {
    const auto [low, high] = padded_bounds(c);
    mean += high - low;
    grid_.low = grid_.low.cwiseMin(low);
    grid_.high = grid_.high.cwiseMax(high);
  }
  const Point extent = grid_.high - grid_.low;
  Point bins = extent.cwiseQuotient(mean / static_cast<double>(n_cells())).cwiseMax(1.0);
  const double excess = bins.prod() / (2.0 * static_cast<double>(n_cells()));
  if (excess > 1) bins = (bins / std::pow(excess, 1.0 / Dim)).cwiseMax(1.0);
  Index n_bins = 1;
  for (int d = 0; d < Dim; ++d) {
    grid_.counts[d] = static_cast<Index>(bins[d]);
    grid_.bins_per_metre[d] = static_cast<double>(grid_.counts[d]) / extent[d];
    n_bins *= grid_.counts[d];
  }

  const auto for_each_bin = [&](Index c, auto&& visit) {
    const auto [low, high] = padded_bounds(c);
    const auto from = grid_.position(low), to = grid_.position(high);
    auto p = from;
    for (bool more = true; more;) {
      visit(grid_.bin(p));
      int d = 0;
      while (d < Dim && ++p[d] > to[d]) p[d] = from[d], ++d;
      more = d < Dim;
    }
  };
  auto& first = grid_.cells.first;
  first.assign(n_bins + 1, 0);
  for (Index c = 0; c < n_cells(); ++c) for_each_bin(c, [&](Index b) { ++first[b + 1]; });
  for (Index b = 0; b < n_bins; ++b) first[b + 1] += first[b];
  grid_.cells.item.resize(first.back());
  std::vector<Index> next(first.begin(), first.end() - 1);
  for (Index c = 0; c < n_cells(); ++c)
    for_each_bin(c, [&](Index b) { grid_.cells.item[next[b]++] = static_cast<Local>(c); });
}

template <int Dim>
std::optional<Vec<Dim>> CellTable<Dim>::natural_coordinates(Index cell, const Point& x) const {
  const CellGeometry<Dim> g = geometry(cell);
  Point xi;
  if (!inverse_map<Dim>(g, x, xi) && !inverse_map_hard<Dim>(cell, g, x, xi)) return std::nullopt;
  if (!in_closed_cell<Dim>(xi)) return std::nullopt;
  return clamp_to_cell<Dim>(xi);
}

/// False where natural_coordinates() and the touch tolerance cannot hold, at less cost.
template <int Dim>
bool CellTable<Dim>::may_contain(Index cell, const Point& x) const {
  const auto [low, high] = padded_bounds(cell);
  return (x.array() >= low.array()).all() && (x.array() <= high.array()).all();
}

template <int Dim>
typename CellTable<Dim>::Found CellTable<Dim>::locate(const Point& x) const {
  if (!grid_.contains(x)) return {-1, Point::Zero()};
  const auto candidates = grid_.cells[grid_.bin(grid_.position(x))];
  for (Local c : candidates) {
    if (!may_contain(c, x)) continue;
    if (const auto xi = natural_coordinates(c, x)) return {c, *xi};
  }
  for (Local c : candidates) {
    if (!may_contain(c, x)) continue;
    const CellGeometry<Dim> g = geometry(c);
    const double limit = 1.0 + touch_tolerance(magnitude<Dim>(x), shortest_extent<Dim>(g));
    Point xi;
    if (inverse_map<Dim>(g, x, xi) && magnitude<Dim>(xi) <= limit)
      return {c, clamp_to_cell<Dim>(xi)};
  }
  return {-1, Point::Zero()};
}

template <int Dim>
typename CellTable<Dim>::Found CellTable<Dim>::walk(const Point& x, Index cell, Point xi) const {
  for (int step = 0; step < longest_walk; ++step) {
    int axis = 0;
    const double farthest = xi.cwiseAbs().maxCoeff(&axis);
    if (!std::isfinite(farthest)) break;
    const Local next = face_neighbour_[cell][2 * axis + (xi[axis] > 0)];
    if (next < 0) break;
    cell = next;
    const CellGeometry<Dim> g = geometry(cell);
    const bool mapped = inverse_map<Dim>(g, x, xi);
    const double tolerance = touch_tolerance(magnitude<Dim>(x), shortest_extent<Dim>(g));
    if (mapped && magnitude<Dim>(xi) < 1.0 - clear_of_faces * tolerance) return {cell, xi};
    if (mapped && magnitude<Dim>(xi) < 1.0 + clear_of_faces * tolerance) break;  // on a face
  }
  return {-1, Point::Zero()};
}

template <int Dim>
typename CellTable<Dim>::Found CellTable<Dim>::locate_from(const Point& x, Index cell) const {
  if (!x.allFinite()) return {-1, Point::Zero()};
  if (cell < 0 || cell >= n_cells()) return locate(x);
  if (const auto xi = natural_coordinates(cell, x)) return {cell, *xi};
  Point xi;
  inverse_map<Dim>(geometry(cell), x, xi);
  // Strictly inside a cell, x is in no other one, and the order of the rule does not matter.
  if (const Found found = walk(x, cell, xi); found.cell >= 0) return found;
  for (Index c : neighbours(cell)) {
    if (!may_contain(c, x)) continue;
    if (const auto inside = natural_coordinates(c, x)) return {c, *inside};
  }
  return locate(x);
}

template struct BoundingGrid<2>;
template struct BoundingGrid<3>;
template std::pair<Vec<2>, Vec<2>> CellTable<2>::padded_bounds(Index) const;
template std::pair<Vec<3>, Vec<3>> CellTable<3>::padded_bounds(Index) const;
template bool CellTable<2>::may_contain(Index, const Vec<2>&) const;
template bool CellTable<3>::may_contain(Index, const Vec<3>&) const;
template void CellTable<2>::build_bounding_grid();
template void CellTable<3>::build_bounding_grid();
template std::optional<Vec<2>> CellTable<2>::natural_coordinates(Index, const Vec<2>&) const;
template std::optional<Vec<3>> CellTable<3>::natural_coordinates(Index, const Vec<3>&) const;
template typename CellTable<2>::Found CellTable<2>::locate(const Vec<2>&) const;
template typename CellTable<3>::Found CellTable<3>::locate(const Vec<3>&) const;
template typename CellTable<2>::Found CellTable<2>::walk(const Vec<2>&, Index, Vec<2>) const;
template typename CellTable<3>::Found CellTable<3>::walk(const Vec<3>&, Index, Vec<3>) const;
template typename CellTable<2>::Found CellTable<2>::locate_from(const Vec<2>&, Index) const;
template typename CellTable<3>::Found CellTable<3>::locate_from(const Vec<3>&, Index) const;

}  // namespace lahar
