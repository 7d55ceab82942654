/// \file Meshes whose files list the nodes around each cell as well (GIMP: ED2Q16G, ED3H64G).
#pragma once

#include <string>

#include "io/base/side_files.h"
#include "io/mesh/mesh_file.h"

namespace lahar {

/// Nodes of a cell in such a file beyond its corners.
template <int Dim>
inline constexpr int ring_nodes = Dim == 2 ? 12 : 56;

/// Append the cells that the nodes around the listed ones form where none is listed, so that every
/// node has a cell. Returns what is wrong, with the cell first ("cell 3 ..."); empty if nothing is:
/// the nodes of a cell have to be those of a grid of boxes as large as it, whatever their order.
template <int Dim>
std::string add_ring_cells(MeshTables<Dim>& mesh);

/// The same of rows that a team has read, with the further nodes of each cell behind its corners:
/// every member gets its part of the cells that there are then, with the ids that one process
/// alone gives them. False, for all members, if anything is wrong. Collective.
template <int Dim>
bool add_ring_cells(MeshRows<Dim>& rows, const Team& team);

}  // namespace lahar
