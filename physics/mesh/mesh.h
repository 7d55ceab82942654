/// \file The background mesh: structured boxes (nothing stored), or cells of any Lagrange element
/// from tables.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "physics/base/types.h"
#include "physics/mesh/element_map.h"
#include "physics/mesh/mesh_share.h"

namespace lahar {

/// What the inverse mapping of one Q4 or H8 cell needs.
/// Cartesian: xi = 2 (x - centre) / length per axis. Isoparametric: corner coordinates.
template <int Dim>
struct CellGeometry {
  Vec<Dim> centre;                            ///< [m] mean of the corners
  Vec<Dim> length;                            ///< [m] edge lengths (Cartesian cells only)
  std::array<Vec<Dim>, corners<Dim>> corner;  ///< [m] in tensor order
  bool cartesian;
};

/// The nodes of one cell, in file order.
template <int Dim>
struct CellNodes {
  std::array<Index, static_cast<std::size_t>(most_nodes<Dim>)> id;
  int count;

  const Index* begin() const { return id.data(); }
  const Index* end() const { return id.data() + count; }
};

/// Background mesh. Node and cell ids are 0-based and dense. All cells are of one element. Two
/// orders of the corners of Q4 and H8 cells occur: *file order* (CB-Geo: Q4 counter-clockwise, H8
/// bottom then top) and *tensor order*, in which bit d of the corner's number says whether it lies
/// on the + side of natural axis d. In a Cartesian cell the natural axes are the global ones,
/// whatever rotation the file order has. What is said to be of multilinear meshes is for Q4 and H8
/// alone.
///
/// A mesh from tables may be a *part*: it holds some of the cells, with their nodes, and says of
/// them what the whole mesh would. Ids, numbers of cells and nodes, bounds and is_cartesian() are
/// the whole mesh's; asking a part about a cell or node that it does not hold is a mistake of the
/// caller's (an assertion), except where it is said what happens then.
///
/// A *share* is a part that several processes have of a mesh before it is known who needs what: of
/// its cells it knows nodes and measures, but not which are next to each other or hold a point
/// (locate(), is_near(), widened(), cells_near(), neighbours() and node_cells() are not for it).
/// Parts with all are made of shares by part().
template <int Dim>
class Mesh {
 public:
  using Point = Vec<Dim>;
  using Corners = std::array<Index, corners<Dim>>;

  /// A grid of equal boxes that stores no coordinates. Cell (i,j,k) has id i + nx (j + ny k); nodes
  /// likewise with nx + 1. Throws InputError unless cell_size > 0 and counts > 0, and where cells
  /// are so small against their coordinates that rounding swallows them.
  static Mesh structured(const Point& origin, const Point& cell_size,
                         const std::array<Index, Dim>& counts);

  /// A mesh from tables, corners in file order. `isoparametric` false: every cell must be an
  /// axis-aligned box (to six digits). Throws InputError with one problem per bad node or cell
  /// (coordinates not finite, unknown node, repeated node, inverted or flat, not a box, more than
  /// two cells on a face); at most 20 are listed, the rest is counted. Nodes without a cell are
  /// accepted.
  static Mesh from_tables(std::vector<Point> nodes, std::vector<Corners> cells, bool isoparametric);
  /// The same of any element; the nodes of the cells one after the other. Simplices cannot be
  /// boxes.
  static Mesh from_tables(std::vector<Point> nodes, Element element, std::span<const Index> cells,
                          bool isoparametric);

  /// A share with cells that someone read; complete() must follow. `own` has nodes of its cells
  /// only. Throws InputError as from_tables() where a cell is not as it should be (of ids in the
  /// message: those in `own`).
  static Mesh share(TablePiece<Dim> own, Element element, Index n_nodes, Index n_cells,
                    bool isoparametric);
  /// Add the cells held. Who has shares with ascending cells adds them one after the other, and
  /// then completes each with the sums of all.
  void add_to(CellSums<Dim>& sums) const;
  void complete(const CellSums<Dim>& sums);
  /// A share with these cells, held here, and those in pieces of pack(). Tables only.
  Mesh share(std::span<const Index> cells, std::vector<std::vector<std::byte>> pieces = {}) const;
  bool is_share() const;

  /// These cells (ascending, held here) and those in pieces that pack() made of other parts of the
  /// same mesh, which are released one by one. The result depends on the cells alone, not on where
  /// they came from. A structured mesh has no parts: returns all of it. Throws
  /// std::invalid_argument where a piece is damaged or of another mesh.
  Mesh part(std::span<const Index> cells, std::vector<std::vector<std::byte>> pieces = {}) const;
  /// Cells held here (ascending) with their nodes, for another process of the same run. Nothing of
  /// a structured mesh.
  std::vector<std::byte> pack(std::span<const Index> cells) const;
  bool holds(Index cell) const;
  std::size_t bytes() const;  ///< of memory that the tables take

  Mesh(Mesh&&) noexcept;
  Mesh& operator=(Mesh&&) noexcept;
  ~Mesh();

  Index n_nodes() const;
  Index n_cells() const;
  bool is_structured() const;
  Element element() const;
  bool is_multilinear() const { return element() == multilinear<Dim>; }
  /// Multilinear, with the closed-form affine inverse mapping in every cell: structured, declared
  /// so, or boxes to the bit.
  bool is_cartesian() const;

  Point node(Index id) const;  ///< [m]
  CellNodes<Dim> element_nodes(Index cell) const;
  ElementGeometry<Dim> element_geometry(Index cell) const;
  Corners cell_nodes(Index cell) const;          ///< file order; multilinear meshes
  Corners cell_nodes_tensor(Index cell) const;   ///< tensor order; multilinear meshes
  CellGeometry<Dim> geometry(Index cell) const;  ///< multilinear meshes
  Point cell_centre(Index cell) const;           ///< [m] mean of the corners
  /// A box that holds the cell [m].
  std::pair<Point, Point> cell_bounds(Index cell) const;
  double cell_volume(Index cell) const;  ///< [m^2 per m of thickness, or m^3]
  /// Distance between opposite faces, for the time step limit [m]. Cartesian: the shortest edge.
  /// Isoparametric: the smallest height of the parallelepipeds that the edges span at each corner
  /// (other elements: ElementGeometry::size()).
  double cell_size(Index cell) const;
  /// Mean edges of the boxes around all cells [m]; tables only.
  Point mean_cell() const;
  /// Smallest box around the mesh.
  std::pair<Point, Point> bounds() const;

  /// Natural coordinates of x if x is in the closed cell (-1 <= xi <= 1 without tolerance), clamped
  /// to 1 - 2.2e-16; none otherwise. Throws SimulationError where the inverse map can neither be
  /// found nor be shown not to exist.
  std::optional<Point> natural_coordinates(Index cell, const Point& x) const;

  /// The lowest cell id that contains x; -1 if none, or if x is not finite. A point outside every
  /// cell by rounding only (1e-10 in natural coordinates, more where the coordinates themselves are
  /// coarser: mesh_tolerance.h) belongs to the cell it touches, lowest id first. In a part: of the
  /// cells held.
  struct Found {
    Index cell = -1;
    Point xi;  ///< natural coordinates, within 1 - 2.2e-16; zero if there is no cell
  };
  Found locate(const Point& x) const;

  /// Where a particle that was in `cell` is now: that cell while it contains x, else the first of
  /// the cells sharing a node with it in ascending id, else locate(x). Walks through face
  /// neighbours along the natural coordinates; the answer is the one of the rule. A part that holds
  /// the surroundings of `cell` (surrounding_cells() of its patch) gives the answer of the whole
  /// mesh, to the bit, for all x with is_near(x, cell); for others too, if that is in the patch, in
  /// one of its neighbours or outside the bounds; else it gives a cell of none of these, or -1.
  Found locate_from(const Point& x, Index cell) const;

  /// True if x is in the box around `cell` and the cells that share a node with it, widened by the
  /// size of `cell`, or outside the mesh's bounds; always in a structured mesh. Where a particle
  /// that left `cell` is in no cell and this is false, a part of the mesh cannot tell whether it is
  /// outside: it has moved too far in one step.
  bool is_near(const Point& x, Index cell) const;
  /// `cells` and so many layers of cells around them, ascending. Meshes from tables; takes time for
  /// `cells`, and a little for every cell held.
  std::vector<Index> widened(std::span<const Index> cells, int layers) const;
  /// Every cell that may hold an x with is_near(x, one of `cells`), ascending. Costs and
  /// limits as widened().
  std::vector<Index> cells_near(std::span<const Index> cells) const;

  /// Bins of a mesh from tables, in which points are looked for: boxes on a grid over all of it.
  Index n_bins() const;
  Index bin_of(const Point& x) const;            ///< -1 outside of all cells
  std::vector<Index> bins_of(Index cell) const;  ///< those that a cell touches, ascending
  /// The bins whose cells are cells_near(), ascending; a part or share must hold the cells around.
  std::vector<Index> bins_near(std::span<const Index> cells) const;

  /// Cells sharing at least one node with `cell`, ascending, without itself. In a part: those held.
  std::vector<Index> neighbours(Index cell) const;
  /// Cells that have this node, ascending. In a part: those held.
  std::vector<Index> node_cells(Index node) const;

  /// Structured meshes only.
  std::array<Index, Dim> counts() const;
  Point origin() const;
  Point spacing() const;

 private:
  struct Impl;
  explicit Mesh(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

extern template class Mesh<2>;
extern template class Mesh<3>;

}  // namespace lahar
