/// \file Which cell holds a point, in a mesh from tables: walk, neighbours, bounding grid.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "physics/base/error.h"
#include "physics/mesh/inverse_mapping.h"
#include "physics/mesh/mesh_table.h"
#include "physics/mesh/mesh_tolerance.h"

namespace lahar {
namespace {

/// Bounding boxes are widened by this fraction of their size before they are binned [-], so that a
/// point which only touches a cell finds it; added to the touch tolerance.
constexpr double box_padding = 1e-8;
/// A walk ends for certain only this many touch tolerances away from every face of the cell.
constexpr double clear_of_faces = 100;
/// Walks that go round in circles, which distorted cells can cause, are left to the search.
constexpr int longest_walk = 32;
/// Where Newton fails: it came near the cell [natural coordinates] and near the point [cell sizes].
constexpr double near_cell = 1.1, near_point = 1e-3;

template <int Dim>
double magnitude(const Vec<Dim>& x) {
  return x.template lpNorm<Eigen::Infinity>();
}

template <int Dim>
[[noreturn]] void undecided(Index id, const Vec<Dim>& x) {
  throw SimulationError(fmt::format(
      "the inverse mapping of cell {} does not converge at ({}): the cell is too distorted there",
      id, fmt::join(x.data(), x.data() + Dim, ", ")));
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
  if (near) undecided<Dim>(id, x);
  return false;
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

/// The cells held in the bin that x is in.
template <int Dim>
std::span<const Local> BoundingGrid<Dim>::cells_at(const Vec<Dim>& x) const {
  const Index row = bins.row(bin(position(x)));
  return row < 0 ? std::span<const Local>() : cells[row];
}

/// A cell's bounding box, widened by everything that counts as touching it.
template <int Dim>
std::pair<Vec<Dim>, Vec<Dim>> CellTable<Dim>::padded(const std::pair<Point, Point>& bounds) const {
  const auto& [low, high] = bounds;
  const double scale = std::max(magnitude<Dim>(low), magnitude<Dim>(high));
  const Point size = high - low;
  const Point pad = (box_padding + touch_tolerance(scale, size.minCoeff())) * size;
  return {low - pad, high + pad};
}

/// Bins as large as the mean bounding box of a cell; fewer where the mesh fills its bounds badly.
template <int Dim>
void CellTable<Dim>::choose_bins(const CellSums<Dim>& sums) {
  const Point mean(sums.padded_size.data());
  grid_.low = Point(sums.padded_low.data());
  grid_.high = Point(sums.padded_high.data());
  const Point extent = grid_.high - grid_.low;
  Point bins = extent.cwiseQuotient(mean / static_cast<double>(n_cells())).cwiseMax(1.0);
  const double excess = bins.prod() / (2.0 * static_cast<double>(n_cells()));
  if (excess > 1) bins = (bins / std::pow(excess, 1.0 / Dim)).cwiseMax(1.0);
  for (int d = 0; d < Dim; ++d) {
    grid_.counts[d] = static_cast<Index>(bins[d]);
    grid_.bins_per_metre[d] = static_cast<double>(grid_.counts[d]) / extent[d];
  }
}

/// Put the cells held into the bins that grid_.bins has rows for.
template <int Dim>
void CellTable<Dim>::fill_bins() {
  const Index n = cell_ids_.size();
  const auto for_each_row = [&](Index c, auto&& visit) {
    const auto [low, high] = padded_bounds_[c];
    for_each_position<Dim>(grid_.position(low), grid_.position(high),
                           [&](const Bins& p) { visit(grid_.bins.row(grid_.bin(p))); });
  };
  auto& first = grid_.cells.first;
  first.assign(grid_.bins.size() + 1, 0);
  for (Index c = 0; c < n; ++c) for_each_row(c, [&](Index b) { ++first[b + 1]; });
  for (Index b = 0; b < grid_.bins.size(); ++b) first[b + 1] += first[b];
  grid_.cells.item.resize(first.back());
  std::vector<Index> next(first.begin(), first.end() - 1);
  for (Index c = 0; c < n; ++c)
    for_each_row(c, [&](Index b) { grid_.cells.item[next[b]++] = static_cast<Local>(c); });
}

/// The length that the tolerance is relative to [m].
template <int Dim>
double CellTable<Dim>::shortest_extent(Index row) const {
  if (is_cartesian()) return geometry_of(row).length.minCoeff();
  const auto [low, high] = cell_bounds(row);
  return (high - low).minCoeff();
}

/// Natural coordinates, also beyond the cell; false where none are found, and xi is an estimate.
template <int Dim>
bool CellTable<Dim>::map_to(Index row, const Point& x, Point& xi) const {
  if (is_multilinear()) return inverse_map<Dim>(geometry_of(row), x, xi);
  return quick_inverse_map<Dim>(element_geometry_of(row), x, xi);
}

template <int Dim>
std::optional<Vec<Dim>> CellTable<Dim>::natural_of(Index row, const Point& x) const {
  if (!is_multilinear()) {
    if (!may_contain(row, x)) return std::nullopt;
    Point xi;
    const Mapped mapped = inverse_map<Dim>(element_geometry_of(row), x, xi);
    if (mapped == Mapped::undecided) undecided<Dim>(cell_ids_.id(row), x);
    if (mapped == Mapped::no || !in_closed_cell<Dim>(element(), xi)) return std::nullopt;
    return clamp_to_cell<Dim>(element(), xi);
  }
  const CellGeometry<Dim> g = geometry_of(row);
  Point xi;
  if (!inverse_map<Dim>(g, x, xi) && !inverse_map_hard<Dim>(cell_ids_.id(row), g, x, xi))
    return std::nullopt;
  if (!in_closed_cell<Dim>(xi)) return std::nullopt;
  return clamp_to_cell<Dim>(xi);
}

/// False where natural_of() and the touch tolerance cannot hold, at less cost.
template <int Dim>
bool CellTable<Dim>::may_contain(Index row, const Point& x) const {
  const auto& [low, high] = padded_bounds_[row];
  return (x.array() >= low.array()).all() && (x.array() <= high.array()).all();
}

template <int Dim>
typename CellTable<Dim>::Found CellTable<Dim>::locate(const Point& x) const {
  if (!grid_.contains(x)) return {-1, Point::Zero()};
  const auto candidates = grid_.cells_at(x);
  for (Local c : candidates) {
    if (!may_contain(c, x)) continue;
    if (const auto xi = natural_of(c, x)) return {cell_ids_.id(c), *xi};
  }
  for (Local c : candidates) {
    if (!may_contain(c, x)) continue;
    const double tolerance = touch_tolerance(magnitude<Dim>(x), shortest_extent(c));
    Point xi;
    const bool mapped = is_multilinear()
                            ? inverse_map<Dim>(geometry_of(c), x, xi)
                            : inverse_map<Dim>(element_geometry_of(c), x, xi) == Mapped::yes;
    if (mapped && outside_by<Dim>(element(), xi) <= tolerance)
      return {cell_ids_.id(c), clamp_to_cell<Dim>(element(), xi)};
  }
  return {-1, Point::Zero()};
}

template <int Dim>
bool CellTable<Dim>::share_node(Index a, Index b) const {
  const auto of_a = nodes_of(a);
  for (Local node : nodes_of(b))
    if (std::find(of_a.begin(), of_a.end(), node) != of_a.end()) return true;
  return false;
}

/// Where a walk through face neighbours ends: the only cell around x, or none if not so simple. It
/// stays among the cells around the first, so that any part of the mesh which has these answers
/// alike.
template <int Dim>
typename CellTable<Dim>::Found CellTable<Dim>::walk(const Point& x, Index start, Point xi) const {
  Index row = start;
  for (int step = 0; step < longest_walk; ++step) {
    if (!xi.allFinite()) break;
    const Local next = face_neighbour_[row][nearest_face<Dim>(element(), xi)];
    if (next < 0 || !share_node(start, next)) break;
    row = next;
    const bool mapped = map_to(row, x, xi);
    const double outside = outside_by<Dim>(element(), xi);
    const double tolerance = touch_tolerance(magnitude<Dim>(x), shortest_extent(row));
    if (mapped && outside < -clear_of_faces * tolerance) return {cell_ids_.id(row), xi};
    if (mapped && outside < clear_of_faces * tolerance) break;  // on a face
  }
  return {-1, Point::Zero()};
}

template <int Dim>
typename CellTable<Dim>::Found CellTable<Dim>::locate_from(const Point& x, Index cell) const {
  if (!x.allFinite()) return {-1, Point::Zero()};
  const Index row = cell_ids_.row(cell);
  if (row < 0) return locate(x);
  if (const auto xi = natural_of(row, x)) return {cell, *xi};
  Point xi;
  map_to(row, x, xi);
  // Strictly inside a cell, x is in no other one, and the order of the rule does not matter.
  if (const Found found = walk(x, row, xi); found.cell >= 0) return found;
  for (Local c : ring(row)) {
    if (!may_contain(c, x)) continue;
    if (const auto inside = natural_of(c, x)) return {cell_ids_.id(c), *inside};
  }
  return locate(x);
}

/// A box around the cell and those that share a node with it, wider by the cell on every side.
template <int Dim>
std::pair<Vec<Dim>, Vec<Dim>> CellTable<Dim>::reach(Index row) const {
  auto [low, high] = cell_bounds(row);
  const Point beyond = high - low;
  for (Local node : nodes_of(row)) {
    for (Local c : node_cells_[node]) {
      const auto [c_low, c_high] = cell_bounds(c);
      low = low.cwiseMin(c_low);
      high = high.cwiseMax(c_high);
    }
  }
  return {low - beyond, high + beyond};
}

template <int Dim>
bool CellTable<Dim>::is_near(const Point& x, Index cell) const {
  if (!grid_.contains(x)) return true;
  const auto [low, high] = reach(cell_row(cell));
  return (x.array() >= low.array()).all() && (x.array() <= high.array()).all();
}

template class CellTable<2>;
template class CellTable<3>;
template struct BoundingGrid<2>;
template struct BoundingGrid<3>;

}  // namespace lahar
