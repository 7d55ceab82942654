/// \file Vertical stresses of particles in columns of a grid, for which nodes are in balance.
#pragma once

#include <span>
#include <vector>

#include "physics/model/shape_functions.h"

namespace lahar {

/// Particles of a column at the same height.
struct ColumnRow {
  double height;  ///< in cells, from the lowest node of the mesh on
  double half;    ///< in cells: half of a particle's height
  double volume;  ///< [m^3] of all of them
  double weight;  ///< [N]
  double stress;  ///< [Pa] vertical, in compression
};

/// Sums over particles are not the integrals that functions of nodes have. The weight above gives
/// stresses whose forces differ from the weights of nodes near the ground surface, and where layers
/// cut cells. Returns what is to be added to the stress of each row, so that all nodes above the
/// lowest cell with particles are in balance. Of all such changes it is the least by volume, in
/// shares of the stress or, where that is less, of the weight of a cell:
///     sum_k V_k sigma_k dN_i / dy = sum_k W_k N_i.
/// Nothing is added where that would take more than half of the weight of a cell: the column is not
/// in balance by itself.
/// Rows ascend. `cell` is the height of a cell [m], `cells` how many there are.
std::vector<double> balance_column(std::span<const ColumnRow> rows, double cell, int cells,
                                   ShapeFunctions functions);

}  // namespace lahar
