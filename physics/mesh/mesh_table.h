/// \file A mesh of arbitrary cells of one element from tables, with its connectivity. Private to
/// Mesh.
#pragma once

#include <cstddef>
#include <span>
#include <utility>

#include "physics/base/id_map.h"
#include "physics/mesh/mesh.h"
#include "physics/mesh/mesh_share.h"

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

/// All cells of a mesh, or some. Ids are those of the whole mesh; a *row* is the position of a cell
/// or node in the arrays, which hold the cells and nodes that are held, ascending by id.
template <int Dim>
class CellTable {
 public:
  using Point = Vec<Dim>;
  using Corners = std::array<Index, corners<Dim>>;
  using Found = typename Mesh<Dim>::Found;

  CellTable(std::vector<Point> nodes, Element element, std::span<const Index> cells,
            bool isoparametric);

  /// mesh_table_part.cpp: see Mesh.
  CellTable(TablePiece<Dim> own, Element element, Index n_nodes, Index n_cells, bool isoparametric);
  void add_to(CellSums<Dim>& sums) const;
  void complete(const CellSums<Dim>& sums);
  CellTable part(std::span<const Index> cells, std::vector<std::vector<std::byte>> pieces,
                 bool connected) const;
  std::vector<std::byte> pack(std::span<const Index> cells) const;
  std::size_t bytes() const;

  Index n_nodes() const { return whole_.n_nodes; }
  Index n_cells() const { return whole_.n_cells; }
  bool holds(Index cell) const { return cell_ids_.row(cell) >= 0; }
  bool is_share() const { return !connected_; }
  Point mean_cell() const { return whole_.mean_cell; }
  Element element() const { return whole_.element; }
  bool is_cartesian() const { return whole_.cartesian; }
  Point node(Index id) const { return nodes_[node_row(id)]; }
  CellNodes<Dim> element_nodes(Index cell) const;
  Corners cell_nodes(Index cell) const;
  Corners cell_nodes_tensor(Index cell) const;
  CellGeometry<Dim> geometry(Index cell) const { return geometry_of(cell_row(cell)); }
  std::pair<Point, Point> bounds() const { return whole_.bounds; }
  std::pair<Point, Point> bounds(Index cell) const { return cell_bounds(cell_row(cell)); }
  Found locate(const Point& x) const;
  Found locate_from(const Point& x, Index cell) const;
  bool is_near(const Point& x, Index cell) const;
  std::vector<Index> widened(std::span<const Index> cells, int layers) const;
  std::vector<Index> cells_near(std::span<const Index> cells) const;
  Index n_bins() const;
  Index bin_of(const Point& x) const;
  std::vector<Index> bins_of(Index cell) const;
  std::vector<Index> bins_near(std::span<const Index> cells) const;
  std::vector<Index> neighbours(Index cell) const;
  std::vector<Index> node_cells(Index node) const;
  std::optional<Point> natural_coordinates(Index cell, const Point& x) const {
    return natural_of(cell_row(cell), x);
  }

 private:
  using Rows = std::array<Local, corners<Dim>>;
  using Face = std::array<Local, most_face_corners>;
  using Bins = std::array<Index, Dim>;
  /// What a part knows of all cells.
  struct Whole {
    Index n_nodes, n_cells;
    Element element;
    bool cartesian;
    std::pair<Point, Point> bounds;
    Point mean_cell;
  };

  CellTable(const CellTable& other, std::span<const Index> own,
            std::vector<std::vector<std::byte>> pieces, bool connected);
  void take(const TablePiece<Dim>& piece);
  void check_share(bool isoparametric) const;
  void build_bounds();
  void build_connectivity();
  void build_node_cells();
  void build_face_neighbours();
  void choose_bins(const CellSums<Dim>& sums);
  std::vector<Index> touched_bins() const;
  void fill_bins();
  TablePiece<Dim> piece(std::span<const Index> cells) const;
  /// What all parts of one mesh have in common.
  std::array<Index, 4> identity() const {
    return {Dim, static_cast<Index>(element()), n_nodes(), n_cells()};
  }

  std::vector<Index> marked_cells(const std::vector<char>& marked) const;
  Index cell_row(Index cell) const;
  Index node_row(Index node) const;
  bool is_multilinear() const { return whole_.element == multilinear<Dim>; }
  std::span<const Local> nodes_of(Index row) const {
    const auto n = static_cast<std::size_t>(info(whole_.element).nodes);
    return {cells_.data() + static_cast<std::size_t>(row) * n, n};
  }
  Rows corners_tensor(Index row) const;
  std::array<Face, static_cast<std::size_t>(most_faces<Dim>)> faces_of(Index row) const;
  CellGeometry<Dim> geometry_of(Index row) const;
  ElementGeometry<Dim> element_geometry_of(Index row) const;
  double shortest_extent(Index row) const;
  bool map_to(Index row, const Point& x, Point& xi) const;
  std::optional<Point> natural_of(Index row, const Point& x) const;
  std::vector<Local> ring(Index row) const;
  std::pair<Point, Point> cell_bounds(Index row) const;
  std::pair<Point, Point> padded(const std::pair<Point, Point>& bounds) const;
  std::pair<Point, Point> reach(Index row) const;
  bool may_contain(Index row, const Point& x) const;
  bool share_node(Index a, Index b) const;
  Found walk(const Point& x, Index row, Point xi) const;

  Whole whole_;
  bool connected_ = true;  ///< false: a share, which has nothing of what follows `curved_bounds_`
  IdMap cell_ids_, node_ids_;
  std::vector<Point> nodes_;
  std::vector<Local> cells_;  ///< rows of the nodes of each cell, file order
  /// For cells whose faces may bulge beyond their nodes; else empty.
  std::vector<std::pair<Point, Point>> curved_bounds_;
  /// Bounding boxes, widened by everything that counts as touching the cell.
  std::vector<std::pair<Point, Point>> padded_bounds_;
  CompressedRows node_cells_;
  /// Neighbour across each face (ElementInfo::face); -1 = none held.
  std::vector<std::array<Local, static_cast<std::size_t>(most_faces<Dim>)>> face_neighbour_;
  BoundingGrid<Dim> grid_;
};

/// The nodes of all cells of a mesh, one cell after the other.
struct CellList {
  Element element;
  std::span<const Index> ids;

  Index size() const {
    return static_cast<Index>(ids.size()) / static_cast<Index>(info(element).nodes);
  }
  std::span<const Index> operator[](Index cell) const {
    const auto n = static_cast<std::size_t>(info(element).nodes);
    return ids.subspan(static_cast<std::size_t>(cell) * n, n);
  }
};

/// Throw InputError with everything that is wrong with the tables of a mesh.
template <int Dim>
void check_tables(const std::vector<Vec<Dim>>& nodes, const CellList& cells, bool isoparametric);

/// True if a Q4 or H8 is an axis-aligned box to within `deviation` of its edges; corners in file
/// order.
template <int Dim>
bool is_box(const std::array<Vec<Dim>, corners<Dim>>& corner, double deviation);

/// Tensor order of the corners of a box, from their coordinates in file order: entry k is the
/// tensor number of corner k. Corners that share a number mean that this is no box.
template <int Dim>
std::array<int, corners<Dim>> box_orientation(const std::array<Vec<Dim>, corners<Dim>>& corner);

extern template class CellTable<2>;
extern template class CellTable<3>;

}  // namespace lahar
