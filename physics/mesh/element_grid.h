/// \file Tables of a regular mesh of any element: a grid of boxes, each one cell, or cut into
/// simplices.
#pragma once

#include <utility>

#include "physics/mesh/element.h"

namespace lahar {

/// Nodes, and the nodes of each cell one after the other, in file order.
template <int Dim>
struct ElementTables {
  Element element;
  std::vector<Vec<Dim>> nodes;  ///< [m]
  std::vector<Index> cells;
};

/// Boxes of the given edges, the first axis running fastest; nodes likewise. A square becomes 2
/// triangles, a cube 6 tetrahedra, all around the diagonal from its lowest to its highest corner.
template <int Dim>
ElementTables<Dim> element_grid(Element element, const Vec<Dim>& origin, const Vec<Dim>& cell_size,
                                const std::array<Index, Dim>& counts);

/// How many nodes and cells that makes.
template <int Dim>
struct ElementGrid {
  ElementGrid(Element element, const std::array<Index, Dim>& counts);
  Index n_nodes, n_cells;
};

/// Nodes [first, second) and cells [first, second) of the same tables.
template <int Dim>
ElementTables<Dim> element_grid_part(Element element, const Vec<Dim>& origin,
                                     const Vec<Dim>& cell_size,
                                     const std::array<Index, Dim>& counts,
                                     std::pair<Index, Index> nodes, std::pair<Index, Index> cells);

}  // namespace lahar
