/// \file A mesh of arbitrary Q4 or H8 cells from tables, with its connectivity. Private to Mesh.
#pragma once

#include <cstddef>
#include <span>
#include <utility>

#include "physics/id_map.h"
#include "physics/mesh.h"

namespace lahar {

/// Rows of different lengths in one array: row i is item[first[i]] .. item[first[i + 1]].
struct CompressedRows {
  std::vector<Index> first;
  std::vector<Local> item;
  std::span<const Local> operator[](Index row) const {
    return {item.data() + first[row], item.data() + first[row + 1]};
  }
  std::size_t bytes() const {
    return first.capacity() * sizeof(Index) + item.capacity() * sizeof(Local);
  }
};

/// Uniform bins over the whole mesh, each with the cells held whose bounding box touches it,
/// ascending. A part of a mesh has the bins of the whole, and stores those that have cells.
template <int Dim>
struct BoundingGrid {
  Vec<Dim> low, high;               ///< [m] bounds of the mesh, slightly widened
  Vec<Dim> bins_per_metre;          ///< [1/m]
  std::array<Index, Dim> counts{};  ///< bins along each axis
  IdMap bins;                       ///< rows of `cells`
  CompressedRows cells;             ///< rows of the table

  bool contains(const Vec<Dim>& x) const;
  std::array<Index, Dim> position(const Vec<Dim>& x) const;
  Index bin(const std::array<Index, Dim>& position) const;
  std::span<const Local> cells_at(const Vec<Dim>& x) const;
};

/// Call visit(position) for the bins from `from` to `to` inclusive, ascending.
template <int Dim, class Visit>
void for_each_position(const std::array<Index, Dim>& from, const std::array<Index, Dim>& to,
                       Visit visit) {
  auto p = from;
  for (bool more = true; more;) {
    visit(p);
    int d = 0;
    while (d < Dim && ++p[d] > to[d]) p[d] = from[d], ++d;
    more = d < Dim;
  }
}

/// Cells of a table on their way from one holder of a part of the mesh to another.
template <int Dim>
struct TablePiece {
  std::vector<Index> cells;                                   ///< global ids, ascending
  std::vector<std::array<Local, corners<Dim>>> corner_nodes;  ///< file order, positions in `nodes`
  std::vector<Index> nodes;                                   ///< global ids, ascending
  std::vector<Vec<Dim>> x;                                    ///< [m] of `nodes`
};

/// All cells of a mesh, or some. Ids are those of the whole mesh; a *row* is the position of a cell
/// or node in the arrays, which hold the cells and nodes that are held, ascending by id.
template <int Dim>
class CellTable {
 public:
  using Point = Vec<Dim>;
  using Corners = std::array<Index, corners<Dim>>;
  using Found = typename Mesh<Dim>::Found;
  static constexpr int faces = 2 * Dim;

  CellTable(std::vector<Point> nodes, const std::vector<Corners>& cells, bool isoparametric);

  /// mesh_table_part.cpp: see Mesh::part and Mesh::pack.
  CellTable part(std::span<const Index> cells,
                 std::span<const std::vector<std::byte>> pieces) const;
  std::vector<std::byte> pack(std::span<const Index> cells) const;
  std::size_t bytes() const;

  Index n_nodes() const { return whole_.n_nodes; }
  Index n_cells() const { return whole_.n_cells; }
  bool holds(Index cell) const { return cell_ids_.row(cell) >= 0; }
  bool is_cartesian() const { return whole_.cartesian; }
  Point node(Index id) const { return nodes_[node_row(id)]; }
  Corners cell_nodes(Index cell) const;
  Corners cell_nodes_tensor(Index cell) const;
  CellGeometry<Dim> geometry(Index cell) const { return geometry_of(cell_row(cell)); }
  std::pair<Point, Point> bounds() const { return whole_.bounds; }
  Found locate(const Point& x) const;
  Found locate_from(const Point& x, Index cell) const;
  bool is_near(const Point& x, Index cell) const;
  std::vector<Index> widened(std::span<const Index> cells, int layers) const;
  std::vector<Index> cells_near(std::span<const Index> cells) const;
  std::vector<Index> neighbours(Index cell) const;
  std::vector<Index> node_cells(Index node) const;
  std::optional<Point> natural_coordinates(Index cell, const Point& x) const {
    return natural_of(cell_row(cell), x);
  }

 private:
  using Rows = std::array<Local, corners<Dim>>;
  using Bins = std::array<Index, Dim>;
  /// What a part knows of all cells.
  struct Whole {
    Index n_nodes, n_cells;
    bool cartesian;
    std::pair<Point, Point> bounds;
  };

  CellTable(const CellTable& other, std::span<const TablePiece<Dim>> pieces);
  void build_node_cells();
  void build_face_neighbours();
  void choose_bins();
  std::vector<Index> touched_bins() const;
  void fill_bins();
  TablePiece<Dim> piece(std::span<const Index> cells) const;

  std::vector<Index> marked_cells(const std::vector<char>& marked) const;
  Index cell_row(Index cell) const;
  Index node_row(Index node) const;
  Rows corners_tensor(Index row) const;
  CellGeometry<Dim> geometry_of(Index row) const;
  std::optional<Point> natural_of(Index row, const Point& x) const;
  std::vector<Local> ring(Index row) const;
  std::pair<Point, Point> cell_bounds(Index row) const;
  std::pair<Point, Point> padded_bounds(Index row) const;
  std::pair<Point, Point> reach(Index row) const;
  bool may_contain(Index row, const Point& x) const;
  bool share_node(Index a, Index b) const;
  Found walk(const Point& x, Index row, Point xi) const;

  Whole whole_;
  IdMap cell_ids_, node_ids_;
  std::vector<Point> nodes_;
  std::vector<Rows> cells_;  ///< rows of the corners, file order
  CompressedRows node_cells_;
  /// Neighbour across face 2 d + (0: minus side, 1: plus side) of natural axis d; -1 = none held.
  std::vector<std::array<Local, faces>> face_neighbour_;
  BoundingGrid<Dim> grid_;
};

/// Throw InputError with everything that is wrong with the tables of a mesh.
template <int Dim>
void check_tables(const std::vector<Vec<Dim>>& nodes,
                  const std::vector<std::array<Index, corners<Dim>>>& cells, bool isoparametric);

/// True if every cell is an axis-aligned box to within `deviation` of its edges.
template <int Dim>
bool all_boxes(const std::vector<Vec<Dim>>& nodes,
               const std::vector<std::array<Index, corners<Dim>>>& cells, double deviation);

/// Tensor order of the corners of a box, from their coordinates in file order: entry k is the
/// tensor number of corner k. Corners that share a number mean that this is no box.
template <int Dim>
std::array<int, corners<Dim>> box_orientation(const std::array<Vec<Dim>, corners<Dim>>& corner);

extern template class CellTable<2>;
extern template class CellTable<3>;

}  // namespace lahar
