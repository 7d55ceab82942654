/// \file Tables of a regular mesh of any element: a grid of boxes, each one cell, or cut into
/// simplices.
#pragma once

#include "physics/element.h"

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

}  // namespace lahar
