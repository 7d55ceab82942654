/// \file What processes that make a mesh from tables together tell each other.
#pragma once

#include <array>
#include <limits>
#include <vector>

#include "physics/base/types.h"

namespace lahar {

/// Cells of a table on their way from one holder of a part of the mesh to another.
template <int Dim>
struct TablePiece {
  std::vector<Index> cells;       ///< global ids, ascending
  std::vector<Local> cell_nodes;  ///< of each cell, file order, positions in `nodes`
  std::vector<Index> nodes;       ///< global ids, ascending
  std::vector<Vec<Dim>> x;        ///< [m] of `nodes`
};

/// What follows from all cells of a mesh together, as far as they have been added. They are to be
/// added in the order of their ids, in which sums are rounded.
template <int Dim>
struct CellSums {
  using Point = std::array<double, static_cast<std::size_t>(Dim)>;
  static Point all(double value) {
    Point p;
    p.fill(value);
    return p;
  }
  static constexpr double infinity = std::numeric_limits<double>::infinity();

  Point low = all(infinity), high = all(-infinity);                ///< [m] of the cells
  Point padded_low = all(infinity), padded_high = all(-infinity);  ///< [m] of what touches them
  Point size{}, padded_size{};                                     ///< [m] sums of their edges
  bool boxes = true;                                               ///< to the last bit
};

}  // namespace lahar
