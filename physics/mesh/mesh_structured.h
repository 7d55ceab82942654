/// \file A grid of equal boxes; everything about a cell is computed from its id. Private to Mesh.
#pragma once

#include <utility>

#include "physics/mesh/mesh.h"

namespace lahar {

template <int Dim>
class StructuredGrid {
 public:
  using Point = Vec<Dim>;
  using Corners = std::array<Index, corners<Dim>>;
  using Found = typename Mesh<Dim>::Found;
  using Counts = std::array<Index, Dim>;

  StructuredGrid(const Point& origin, const Point& spacing, const Counts& counts);

  Index n_nodes() const;
  Index n_cells() const;
  bool is_cartesian() const { return true; }
  Point node(Index id) const;
  Corners cell_nodes(Index cell) const;
  Corners cell_nodes_tensor(Index cell) const;
  CellGeometry<Dim> geometry(Index cell) const;
  std::pair<Point, Point> bounds() const;
  Found locate(const Point& x) const;
  Found locate_from(const Point& x, Index cell) const;
  std::vector<Index> neighbours(Index cell) const;
  std::vector<Index> node_cells(Index node) const;

  Point origin, spacing;
  Counts counts;

 private:
  double coordinate(int d, Index i) const;
  double centre(int d, Index i) const;
  double natural(int d, Index i, double x) const;
  Index lowest_on_axis(int d, double x, Index from, Index to, double tolerance) const;
  Found found(const Counts& ijk, const Point& x) const;
  Counts cell_position(Index cell) const;
  Index cell_id(const Counts& ijk) const;
  /// Cells from `low` to `high` inclusive, ascending, without `except`.
  std::vector<Index> cells_in(Counts low, Counts high, Index except) const;
};

extern template class StructuredGrid<2>;
extern template class StructuredGrid<3>;

}  // namespace lahar
