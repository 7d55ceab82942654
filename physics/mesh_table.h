/// \file A mesh of arbitrary Q4 or H8 cells from tables, with its connectivity. Private to Mesh.
#pragma once

#include <span>
#include <utility>

#include "physics/mesh.h"

namespace lahar {

/// Rows of different lengths in one array: row i is item[first[i]] .. item[first[i + 1]].
struct CompressedRows {
  std::vector<Index> first;
  std::vector<Local> item;
  std::span<const Local> operator[](Index row) const {
    return {item.data() + first[row], item.data() + first[row + 1]};
  }
};

/// Uniform bins over the mesh, each with the cells whose bounding box touches it, ascending.
template <int Dim>
struct BoundingGrid {
  Vec<Dim> low, high;               ///< [m] bounds of the mesh, slightly widened
  Vec<Dim> bins_per_metre;          ///< [1/m]
  std::array<Index, Dim> counts{};  ///< bins along each axis
  CompressedRows cells;

  bool contains(const Vec<Dim>& x) const;
  std::array<Index, Dim> position(const Vec<Dim>& x) const;
  Index bin(const std::array<Index, Dim>& position) const;
};

template <int Dim>
class CellTable {
 public:
  using Point = Vec<Dim>;
  using Corners = std::array<Index, corners<Dim>>;
  using Found = typename Mesh<Dim>::Found;
  static constexpr int faces = 2 * Dim;

  CellTable(std::vector<Point> nodes, std::vector<Corners> cells, bool isoparametric);

  Index n_nodes() const { return static_cast<Index>(nodes_.size()); }
  Index n_cells() const { return static_cast<Index>(cells_.size()); }
  bool is_cartesian() const { return cartesian_; }
  Point node(Index id) const { return nodes_[id]; }
  Corners cell_nodes(Index cell) const { return cells_[cell]; }
  Corners cell_nodes_tensor(Index cell) const;
  CellGeometry<Dim> geometry(Index cell) const;
  std::pair<Point, Point> bounds() const { return bounds_; }
  Found locate(const Point& x) const;
  Found locate_from(const Point& x, Index cell) const;
  std::vector<Index> neighbours(Index cell) const;
  std::vector<Index> node_cells(Index node) const;
  std::optional<Point> natural_coordinates(Index cell, const Point& x) const;

 private:
  /// mesh_table_check.cpp: throw InputError with everything that is wrong with the tables.
  void check(bool isoparametric) const;
  /// True if every cell is an axis-aligned box to within `deviation` of its edges.
  bool all_boxes(double deviation) const;
  void build_node_cells();
  void build_face_neighbours();
  void build_bounding_grid();
  std::pair<Point, Point> cell_bounds(Index cell) const;
  std::pair<Point, Point> padded_bounds(Index cell) const;
  bool may_contain(Index cell, const Point& x) const;
  /// Where a walk through face neighbours ends: the only cell around x, or none if not so simple.
  Found walk(const Point& x, Index cell, Point xi) const;

  std::vector<Point> nodes_;
  std::vector<Corners> cells_;  ///< file order
  bool cartesian_ = false;
  std::pair<Point, Point> bounds_;
  CompressedRows node_cells_;
  /// Neighbour across face 2 d + (0: minus side, 1: plus side) of natural axis d; -1 = boundary.
  std::vector<std::array<Local, faces>> face_neighbour_;
  BoundingGrid<Dim> grid_;
};

/// Tensor order of the corners of a box, from their coordinates in file order: entry k is the
/// tensor number of corner k. Corners that share a number mean that this is no box.
template <int Dim>
std::array<int, corners<Dim>> box_orientation(const std::array<Vec<Dim>, corners<Dim>>& corner);

extern template class CellTable<2>;
extern template class CellTable<3>;

}  // namespace lahar
