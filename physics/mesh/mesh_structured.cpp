/// \file Structured grid: the faces of cell i along axis d lie at origin_d + i spacing_d.
#include "physics/mesh/mesh_structured.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "physics/base/error.h"
#include "physics/mesh/inverse_mapping.h"
#include "physics/mesh/mesh_tolerance.h"

namespace lahar {
namespace {

/// A cell must be wider than this fraction of the largest coordinate, or rounding swallows it [-].
constexpr double smallest_relative_spacing = 1e-12;

template <int Dim>
void check(const Vec<Dim>& origin, const Vec<Dim>& spacing, const std::array<Index, Dim>& counts) {
  std::vector<Problem> problems;
  const auto add = [&](std::string message) {
    problems.emplace_back().message = "structured mesh: " + std::move(message);
  };
  double total = 1;
  for (int d = 0; d < Dim; ++d) {
    const char axis = "xyz"[d];
    if (!std::isfinite(origin[d]))
      add(fmt::format("the origin's {} is {}; it must be a finite number", axis, origin[d]));
    if (!(spacing[d] > 0) || !std::isfinite(spacing[d]))
      add(fmt::format("the cell size along {} is {}; it must be above 0", axis, spacing[d]));
    if (counts[d] <= 0)
      add(fmt::format("{} cells along {}; at least 1 is needed", counts[d], axis));
    total *= static_cast<double>(std::max<Index>(counts[d], 0)) + 1;
  }
  if (total > 4e18) add(fmt::format("{:g} nodes are more than can be numbered", total));
  for (int d = 0; d < Dim && problems.empty(); ++d) {
    const double far = std::max(std::abs(origin[d]), std::abs(origin[d] + spacing[d] * counts[d]));
    if (spacing[d] < smallest_relative_spacing * far || !std::isfinite(far))
      add(fmt::format("cells of {:g} along {} are lost in rounding at coordinates of {:g}",
                      spacing[d], "xyz"[d], far));
  }
  if (!problems.empty()) throw InputError(std::move(problems));
}

}  // namespace

template <int Dim>
StructuredGrid<Dim>::StructuredGrid(const Point& o, const Point& s, const Counts& n)
    : origin(o), spacing(s), counts(n) {
  check<Dim>(origin, spacing, counts);
}

template <int Dim>
Index StructuredGrid<Dim>::n_nodes() const {
  Index n = 1;
  for (Index c : counts) n *= c + 1;
  return n;
}

template <int Dim>
Index StructuredGrid<Dim>::n_cells() const {
  Index n = 1;
  for (Index c : counts) n *= c;
  return n;
}

/// A single rounding (fma), so that the value does not depend on how the compiler contracts it.
template <int Dim>
double StructuredGrid<Dim>::coordinate(int d, Index i) const {
  return std::fma(static_cast<double>(i), spacing[d], origin[d]);
}

/// Mean of the corners, added in file order: the sum that a mesh from tables makes.
template <int Dim>
double StructuredGrid<Dim>::centre(int d, Index i) const {
  const double low = coordinate(d, i), high = coordinate(d, i + 1);
  double sum = 0;
  for (int k = 0; k < corners<Dim>; ++k) sum += (tensor_corner(k) >> d) & 1 ? high : low;
  return sum / corners<Dim>;
}

template <int Dim>
double StructuredGrid<Dim>::natural(int d, Index i, double x) const {
  return 2.0 * (x - centre(d, i)) / (coordinate(d, i + 1) - coordinate(d, i));
}

template <int Dim>
typename StructuredGrid<Dim>::Counts StructuredGrid<Dim>::cell_position(Index cell) const {
  Counts ijk;
  for (int d = 0; d < Dim; ++d) {
    ijk[d] = cell % counts[d];
    cell /= counts[d];
  }
  return ijk;
}

template <int Dim>
Index StructuredGrid<Dim>::cell_id(const Counts& ijk) const {
  Index id = 0;
  for (int d = Dim - 1; d >= 0; --d) id = id * counts[d] + ijk[d];
  return id;
}

template <int Dim>
Vec<Dim> StructuredGrid<Dim>::node(Index id) const {
  Point x;
  for (int d = 0; d < Dim; ++d) {
    x[d] = coordinate(d, id % (counts[d] + 1));
    id /= counts[d] + 1;
  }
  return x;
}

template <int Dim>
typename StructuredGrid<Dim>::Corners StructuredGrid<Dim>::cell_nodes_tensor(Index cell) const {
  const Counts ijk = cell_position(cell);
  Corners nodes;
  for (int a = 0; a < corners<Dim>; ++a) {
    Index id = 0;
    for (int d = Dim - 1; d >= 0; --d) id = id * (counts[d] + 1) + ijk[d] + ((a >> d) & 1);
    nodes[a] = id;
  }
  return nodes;
}

template <int Dim>
typename StructuredGrid<Dim>::Corners StructuredGrid<Dim>::cell_nodes(Index cell) const {
  const Corners tensor = cell_nodes_tensor(cell);
  Corners nodes;
  for (int k = 0; k < corners<Dim>; ++k) nodes[k] = tensor[tensor_corner(k)];
  return nodes;
}

template <int Dim>
CellGeometry<Dim> StructuredGrid<Dim>::geometry(Index cell) const {
  const Counts ijk = cell_position(cell);
  CellGeometry<Dim> g;
  g.cartesian = true;
  for (int d = 0; d < Dim; ++d) {
    const double low = coordinate(d, ijk[d]), high = coordinate(d, ijk[d] + 1);
    g.centre[d] = centre(d, ijk[d]);
    g.length[d] = high - low;
    for (int a = 0; a < corners<Dim>; ++a) g.corner[a][d] = (a >> d) & 1 ? high : low;
  }
  return g;
}

template <int Dim>
std::pair<Vec<Dim>, Vec<Dim>> StructuredGrid<Dim>::bounds() const {
  return {node(0), node(n_nodes() - 1)};
}

/// Lowest i in [from, to] whose closed interval holds x; -1 if none. Because boxes are products of
/// intervals, the lowest id is the lowest position on every axis.
template <int Dim>
Index StructuredGrid<Dim>::lowest_on_axis(int d, double x, Index from, Index to,
                                          double tolerance) const {
  const double position = (x - origin[d]) / spacing[d];
  if (!(position > from - 2.0 && position < to + 3.0)) return -1;
  const Index guess = static_cast<Index>(std::floor(position));
  const double limit = 1.0 + tolerance;
  for (Index i = std::max(from, guess - 1); i <= std::min(to, guess + 1); ++i) {
    const double xi = natural(d, i, x);
    if (xi >= -limit && xi <= limit) return i;
  }
  return -1;
}

template <int Dim>
typename StructuredGrid<Dim>::Found StructuredGrid<Dim>::found(const Counts& ijk,
                                                               const Point& x) const {
  Found result;
  result.cell = cell_id(ijk);
  for (int d = 0; d < Dim; ++d) result.xi[d] = natural(d, ijk[d], x[d]);
  result.xi = clamp_to_cell<Dim>(result.xi);
  return result;
}

template <int Dim>
typename StructuredGrid<Dim>::Found StructuredGrid<Dim>::locate(const Point& x) const {
  for (bool tolerant : {false, true}) {
    Counts ijk;
    bool inside = true;
    for (int d = 0; d < Dim && inside; ++d) {
      const double tolerance =
          tolerant ? touch_tolerance(x.template lpNorm<Eigen::Infinity>(), spacing[d]) : 0.0;
      ijk[d] = lowest_on_axis(d, x[d], 0, counts[d] - 1, tolerance);
      inside = ijk[d] >= 0;
    }
    if (inside) return found(ijk, x);
  }
  return {-1, Point::Zero()};
}

/// The rule of Mesh::locate_from without a walk: own cell, else the lowest of the cells around it.
template <int Dim>
typename StructuredGrid<Dim>::Found StructuredGrid<Dim>::locate_from(const Point& x,
                                                                     Index cell) const {
  if (cell < 0 || cell >= n_cells()) return locate(x);
  const Counts own = cell_position(cell);
  Counts ijk;
  bool inside_own = true, near = true;
  for (int d = 0; d < Dim; ++d) inside_own &= std::abs(natural(d, own[d], x[d])) <= 1.0;
  if (inside_own) return found(own, x);
  for (int d = 0; d < Dim && near; ++d) {
    ijk[d] = lowest_on_axis(d, x[d], std::max<Index>(own[d] - 1, 0),
                            std::min(own[d] + 1, counts[d] - 1), 0.0);
    near = ijk[d] >= 0;
  }
  return near ? found(ijk, x) : locate(x);
}

template <int Dim>
std::vector<Index> StructuredGrid<Dim>::cells_in(Counts low, Counts high, Index except) const {
  for (int d = 0; d < Dim; ++d) {
    low[d] = std::max<Index>(low[d], 0);
    high[d] = std::min(high[d], counts[d] - 1);
  }
  std::vector<Index> cells;
  Counts ijk = low;
  for (bool more = true; more;) {
    const Index id = cell_id(ijk);
    if (id != except) cells.push_back(id);
    int d = 0;
    while (d < Dim && ++ijk[d] > high[d]) ijk[d] = low[d], ++d;
    more = d < Dim;
  }
  return cells;
}

template <int Dim>
std::vector<Index> StructuredGrid<Dim>::neighbours(Index cell) const {
  Counts low = cell_position(cell), high = low;
  for (int d = 0; d < Dim; ++d) --low[d], ++high[d];
  return cells_in(low, high, cell);
}

template <int Dim>
std::vector<Index> StructuredGrid<Dim>::node_cells(Index id) const {
  Counts low, high;
  for (int d = 0; d < Dim; ++d) {
    high[d] = id % (counts[d] + 1);
    low[d] = high[d] - 1;
    id /= counts[d] + 1;
  }
  return cells_in(low, high, -1);
}

template class StructuredGrid<2>;
template class StructuredGrid<3>;

}  // namespace lahar
